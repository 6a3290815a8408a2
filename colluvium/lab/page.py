"""The page report.html of a laboratory: its answers as tables, its pictures inside the file."""

import base64
from collections.abc import Sequence
from html import escape
from pathlib import Path
from typing import Any

from colluvium.lab.summary import UNITS, strength_in_words, value_in_words

STYLE = (
    "body{font:14px/1.5 system-ui,sans-serif;max-width:1000px;margin:2em auto;padding:0 1em;color:#1a1a1a}"
    "table{border-collapse:collapse;margin:1em 0}td,th{border-bottom:1px solid #c8c8c8;padding:.2em .8em;text-align:left}"
    "img{max-width:100%}"
)
HALF = "Same trials at another rate: mean change of an answer beside its standard deviation over seeds"


def write(title: str, found: dict[str, Any], pictures: Sequence[Path], path: Path) -> Path:
    """Writes the page; `pictures`: PNG files that it contains."""
    parts = [f"<!doctype html><html lang=en><meta charset=utf-8><title>{escape(title)}</title><style>{STYLE}</style>"]
    parts.append(f"<h1>{escape(title)}</h1>")
    for sample, own in found["samples"].items():
        parts.append(f"<h2>{escape(sample)}</h2>")
        parts += [f"<p>{when}: {escape(strength_in_words(own[when]))}</p>" for when in ("peak", "residual") if own.get(when)]
        parts.append(_means(own["means"]))
        parts += [_picture(picture) for picture in pictures if picture.name.startswith(f"{sample}_")]
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
    head = "".join(f"<th>{escape(name)}</th>" for name in columns)
    body = "".join("<tr>" + "".join(f"<td>{escape(_said(row[name]))}</td>" for name in columns) + "</tr>" for row in rows)
    return f"<table><tr>{head}</tr>{body}</table>"


def _said(value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    return "-" if value is None else f"{value:.4g}" if isinstance(value, float) else str(value)


def _picture(path: Path) -> str:
    data = base64.b64encode(path.read_bytes()).decode()
    return f'<p><img alt="{escape(path.stem)}" src="data:image/png;base64,{data}"></p>'
