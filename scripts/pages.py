"""Pages made by scripts: tables as Markdown, and sections of a page that each have one owner.

A section stands between two comments, `<!-- begin NAME -->` and `<!-- end NAME -->`. Its owner rewrites what is between them and
nothing else; a section the page does not have yet is added at its end.
"""

import re
from pathlib import Path


def write_section(page, name, text, head=""):
    """Put `text` into section `name` of the Markdown file `page`; `head` begins a page that does not exist yet."""
    page = Path(page)
    begin, end = f"<!-- begin {name} -->", f"<!-- end {name} -->"
    section = f"{begin}\n{text.strip()}\n{end}"
    before = page.read_text(encoding="utf-8") if page.exists() else head.strip() + "\n"
    pattern = re.compile(re.escape(begin) + ".*?" + re.escape(end), re.DOTALL)
    if pattern.search(before):
        after = pattern.sub(lambda _: section, before, count=1)
    else:
        after = before.rstrip() + "\n\n" + section + "\n"
    page.parent.mkdir(parents=True, exist_ok=True)
    page.write_text(after, encoding="utf-8")


def cell(value):
    """A value as it stands in a table."""
    if value is None:
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "NO"
    if isinstance(value, float):
        return f"{value:.6g}"
    return str(value)


def markdown(rows, columns):
    """Table of row dicts; columns {key: heading} or {key: (heading, function of the value)}."""
    return "\n".join(
        [
            "| " + " | ".join(heading for heading, _ in _columns(columns)) + " |",
            "|" + "---|" * len(columns),
            *("| " + " | ".join(line) + " |" for line in _lines(rows, columns)),
        ]
    )


def folded(rows, columns):
    """The same table, hidden until somebody clicks on its first line."""
    return f"<details><summary>Table of {len(rows)} rows</summary>\n\n{markdown(rows, columns)}\n\n</details>"


def plain(rows, columns):
    """The same table for a terminal, columns aligned."""
    lines = [[heading for heading, _ in _columns(columns)], *_lines(rows, columns)]
    widths = [max(len(line[k]) for line in lines) for k in range(len(columns))]
    return "\n".join("  ".join(text.ljust(width) for text, width in zip(line, widths, strict=True)).rstrip() for line in lines)


def _columns(columns):
    return [(c, cell) if isinstance(c, str) else c for c in columns.values()]


def _lines(rows, columns):
    shown = [form for _, form in _columns(columns)]
    return [[form(row.get(key)) for key, form in zip(columns, shown, strict=True)] for row in rows]
