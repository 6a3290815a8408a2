"""Parts of plain pages of results: head, tables, pictures inside the file."""

import base64
from collections.abc import Iterable, Sequence
from html import escape
from pathlib import Path

STYLE = (
    "body{font:14px/1.5 system-ui,sans-serif;max-width:1000px;margin:2em auto;padding:0 1em;color:#1a1a1a}"
    "table{border-collapse:collapse;margin:1em 0}td,th{border-bottom:1px solid #c8c8c8;padding:.2em .8em;text-align:left}"
    "img{max-width:100%}"
)


def head(title: str, more_style: str = "") -> str:
    """Beginning of a page, with its title as heading."""
    return (
        f"<!doctype html><html lang=en><meta charset=utf-8><title>{escape(title)}</title><style>{STYLE}{more_style}</style>"
        f"<h1>{escape(title)}</h1>"
    )


def table(columns: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table; columns: their names as text, rows: cells as HTML."""
    names = "".join(f"<th>{escape(name)}</th>" for name in columns)
    body = "".join("<tr>" + "".join(f"<td>{cell}</td>" for cell in row) + "</tr>" for row in rows)
    return f"<table><tr>{names}</tr>{body}</table>"


def picture(path: Path) -> str:
    """A PNG file inside the page."""
    return f'<img alt="{escape(path.stem)}" src="data:image/png;base64,{base64.b64encode(path.read_bytes()).decode()}">'
