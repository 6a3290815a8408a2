"""The page report.html of a laboratory: its answers as tables, its pictures inside the file."""

from collections.abc import Sequence
from html import escape
from pathlib import Path
from typing import Any

from colluvium.figures import page_parts
from colluvium.lab.summary import UNITS, strength_in_words, value_in_words

HALF = "Same trials at another rate: mean change of an answer beside its standard deviation over seeds"


def write(title: str, found: dict[str, Any], pictures: Sequence[Path], path: Path) -> Path:
    """Writes the page; `pictures`: PNG files that it contains."""
    parts = [page_parts.head(title)]
    for sample, own in found["samples"].items():
        parts.append(f"<h2>{escape(sample)}</h2>")
        parts += [f"<p>{when}: {escape(strength_in_words(own[when]))}</p>" for when in ("peak", "residual") if own.get(when)]
        parts.append(_means(own["means"]))
        parts += [f"<p>{page_parts.picture(picture)}</p>" for picture in pictures if picture.name.startswith(f"{sample}_")]
    if found.get("rates"):
        rows = [row for row in found["rates"] if row["answer"] in UNITS]
        parts.append(f"<h2>{HALF}</h2>{_table(('sample', 'answer', 'full', 'slower', 'change', 'scatter', 'within'), rows)}")
    path.write_text("\n".join(parts) + "</html>\n", encoding="utf-8")
    return path


def _means(entries: Sequence[dict[str, Any]]) -> str:
    """Answers in rows, stresses in columns."""
    rows = [
        {"answer": name} | {f"{entry['pressure'] / 1e3:g} kPa": value_in_words(name, entry[name]) for entry in entries}
        for name in UNITS
        if name in entries[0]
    ]
    return _table(tuple(rows[0]), rows)


def _table(columns: Sequence[str], rows: Sequence[dict[str, Any]]) -> str:
    return page_parts.table(columns, ([escape(_said(row[name])) for name in columns] for row in rows))


def _said(value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    return "-" if value is None else f"{value:.4g}" if isinstance(value, float) else str(value)
