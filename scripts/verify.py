"""Compare the codes with closed forms and published values; writes docs/verification.md.

    python scripts/verify.py continuum|discrete|coupling|hard [--fast] [--json FILE] [--case NAME ...] [--page FILE]

Exit code 1 if a row fails. Only the section's own part of the page is rewritten, and nothing of it where --case picks some cases.
--fast: coarser meshes, no studies; the page says so.
"""

import argparse
import json
import sys
from pathlib import Path

import pages
from verification import SECTIONS, runner

PAGE = Path(__file__).resolve().parent.parent / "docs" / "verification.md"
HEAD = """# Verification

Made by `scripts/verify.py`; each section by its own command. Every row compares a value the code computed with a closed form or a
published value. *error* is relative to the reference (absolute where that is 0), *order* is the observed order of convergence,
*seconds* is what the row took, compilation included.
"""


def parser():
    """Options of the command line."""
    p = argparse.ArgumentParser(description=__doc__.partition(";")[0])
    p.add_argument("section", choices=SECTIONS)
    p.add_argument("--fast", action="store_true", help="coarser meshes, no studies")
    p.add_argument("--json", metavar="FILE", type=Path, help="write the rows to FILE")
    p.add_argument("--case", metavar="NAME", action="append", help="only this case (may be repeated); the page stays as it is")
    p.add_argument("--page", metavar="FILE", type=Path, default=PAGE, help="page to write; pictures go to pictures/ beside it")
    return p


def main(argv=None):
    """Run the cases of a section; returns the exit code."""
    options = parser().parse_args(argv)
    package = runner.section(options.section)
    known = {case.NAME: case for case in package.CASES}
    unknown = [name for name in options.case or () if name not in known]
    if unknown:
        print(f"no case named {', '.join(unknown)}; there are {', '.join(known)}", file=sys.stderr)
        return 2
    chosen = [known[name] for name in options.case] if options.case else package.CASES
    rows = runner.run(chosen, options.fast, lambda row: print(_line(row), file=sys.stderr, flush=True))
    print(runner.table(rows))
    failed = [row for row in rows if not row["passed"]]
    print(f"{len(rows) - len(failed)} of {len(rows)} rows passed")
    if options.json:
        options.json.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    if not options.case:
        write(package, rows, options)
    return 1 if failed else 0


def write(package, rows, options):
    """Rewrite the section's part of the page."""
    pictures = options.page.parent / "pictures"
    pictures.mkdir(parents=True, exist_ok=True)
    with_study = [] if options.fast else [case for case in package.CASES if hasattr(case, "study")]
    studies = {case.NAME: case.study(pictures) for case in with_study}
    command = f"python scripts/verify.py {options.section}{' --fast' if options.fast else ''}"
    pages.write_section(options.page, options.section, runner.page_section(package, rows, command, studies), HEAD)


def _line(row):
    return f"{'passed' if row['passed'] else 'FAILED'}  {row['seconds']:7.2f} s  {row['case']}: {row['quantity']}"


if __name__ == "__main__":
    sys.exit(main())
