"""The page report.html of a sweep: what it says, its pictures inside the file, and a row with a link for every point."""

from collections.abc import Sequence
from html import escape
from pathlib import Path
from typing import Any

from colluvium.ensemble.answer import Setting
from colluvium.ensemble.study import Found
from colluvium.figures import page_parts

STYLE = "img{max-width:48%}iframe{width:49%;height:70vh;border:1px solid #c8c8c8}"
# Two runs side by side: the first click on "beside" fills the left frame, the next one the right one.
SCRIPT = (
    "let n=0;function beside(path){const f=document.getElementById('side'+(n++%2));f.src=path;f.hidden=false;"
    "f.scrollIntoView();return false}"
)


def write(title: str, said: Sequence[str], settings: Sequence[Setting], found: Sequence[Found], quantity: str,
          pictures: Sequence[Path], path: Path) -> Path:  # fmt: skip
    """Writes the page; `pictures`: PNG files that it contains. Links are relative: folders of runs stay beside the page."""
    parts = [page_parts.head(title, STYLE), f"<script>{SCRIPT}</script>", *(f"<p>{escape(text)}</p>" for text in said)]
    parts += [page_parts.picture(picture) for picture in pictures]
    parts += ["<h2>Settings</h2>", _settings(settings, quantity), "<h2>Points</h2>", _points(found, quantity, path.parent)]
    parts.append("<iframe id=side0 hidden></iframe> <iframe id=side1 hidden></iframe></html>\n")
    path.write_text("\n".join(parts), encoding="utf-8")
    return path


def _settings(settings: Sequence[Setting], quantity: str) -> str:
    keys = list(settings[0].values) if settings else []
    rows = [
        [
            *map(_said, one.values.values()),
            str(len(one.found)),
            *map(_said, (one.mean, *(one.interval or (None, None)), one.deviation)),
        ]
        for one in settings
    ]
    return page_parts.table([*keys, "seeds", f"mean of {quantity}", "95 % low", "high", "deviation"], rows)


def _points(found: Sequence[Found], quantity: str, root: Path) -> str:
    keys = list(found[0].point.values) if found else []
    rows = []
    for one in found:
        value = one.told["values"].get(quantity, (None,))[0]
        why = one.failed or one.told.get("lacking", {}).get(quantity, "")
        rows.append([*map(_said, one.point.values.values()), str(one.point.seed), _said(value), _links(one, root), escape(why)])
    return page_parts.table([*keys, "seed", quantity, "run", ""], rows)


def _links(one: Found, root: Path) -> str:
    """Links to a run: its report if it was drawn, else its folder."""
    folder = one.folder.relative_to(root.resolve()).as_posix()
    page = f"{folder}/report/report.html"
    if (root / page).is_file():
        return f'<a href="{page}">report</a> <a href="#" onclick="return beside(\'{page}\')">beside</a>'
    return f'<a href="{folder}/">folder</a>'


def _said(value: Any) -> str:
    return "-" if value is None else f"{value:.4g}" if isinstance(value, float) else escape(str(value))
