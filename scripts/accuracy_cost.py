"""What accuracy costs: error against wall time of known problems; writes docs/accuracy.md and its pictures.

    python scripts/accuracy_cost.py W1|W2|W3|W5 [--fast] [--json FILE] [--page FILE]

--fast: coarse meshes only, in seconds; the page says so. Only the section of the workload is rewritten.
"""

import argparse
import importlib
import json
from pathlib import Path

import pages

SCRIPTS = Path(__file__).resolve().parent
PAGE = SCRIPTS.parent / "docs" / "accuracy.md"
HEAD = """# What accuracy costs

Made by `scripts/accuracy_cost.py`; each section by its workload. Times are medians on one core, taken one after the other.
"""


def workloads():
    """Modules of the workloads that exist, by name: {"W1": "w1_holes", ...}."""
    files = sorted((SCRIPTS / "accuracy").glob("w[0-9]*_*.py"))
    return {path.stem.partition("_")[0].upper(): path.stem for path in files}


def parser():
    """Options of the command line."""
    p = argparse.ArgumentParser(description=__doc__.partition(":")[0])
    p.add_argument("workload", choices=workloads())
    p.add_argument("--fast", action="store_true", help="coarse meshes only")
    p.add_argument("--json", metavar="FILE", type=Path, help="write the rows to FILE")
    p.add_argument("--page", metavar="FILE", type=Path, default=PAGE, help="page to write; pictures/ is beside it")
    return p


def main(argv=None):
    """Compute one workload, print its table, draw it, write its section."""
    options = parser().parse_args(argv)
    workload = importlib.import_module(f"accuracy.{workloads()[options.workload]}")
    rows = workload.run(options.fast)
    print(pages.plain(rows, workload.COLUMNS))
    if options.json:
        options.json.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    picture = options.page.parent / "pictures" / workload.PICTURE
    picture.parent.mkdir(parents=True, exist_ok=True)
    workload.draw(rows, picture)
    pages.write_section(options.page, options.workload, section(options, workload, rows), HEAD)


def section(options, workload, rows):
    """Markdown of one workload."""
    mode = f"python scripts/accuracy_cost.py {options.workload}{' --fast' if options.fast else ''}"
    parts = [f"## {options.workload}: {workload.TITLE}", f"`{mode}`", f"![{workload.TITLE}](pictures/{workload.PICTURE})"]
    return "\n\n".join([*parts, workload.READ.strip(), pages.markdown(rows, workload.COLUMNS)])


if __name__ == "__main__":
    main()
