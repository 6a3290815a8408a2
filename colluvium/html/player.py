"""report.html: one file that shows all frames of a run in any browser, without a network."""

import json
from collections.abc import Sequence
from html import escape
from importlib import resources
from pathlib import Path
from string import Template
from typing import Any

from colluvium import closing
from colluvium.html import fabric_table, histories
from colluvium.html.contents import Contents
from colluvium.html.packing import Packing
from colluvium.results.run import Run

SCRIPTS = ("data.js", "draw.js", "values.js", "legend.js", "picture.js", "player.js")


def write(run: Run, path: Path) -> Path:
    """Writes the page of a run with frames; returns its path."""
    packing = Packing()
    drawn = histories.plots(run, packing)
    description = Contents(run, packing).description() | histories.description(run, drawn)
    page = Template(_part("page.html")).substitute(
        title=escape(_title(run)),
        facts=escape(_facts(run)),
        style=_part("style.css"),
        script="\n".join(_part(name) for name in SCRIPTS),
        description=json.dumps(description, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c"),
        arrays=packing.text(),
        last=len(run.frames) - 1,
        histories="\n".join(plot.svg for plot in drawn),
        closing="\n".join((_closing(run.info), fabric_table.section(run))),
        scene=escape(json.dumps(run.scene, indent=1, ensure_ascii=False)),
    )
    path.write_text(page, encoding="utf-8")
    return path


def _part(name: str) -> str:
    return resources.files(__package__).joinpath(name).read_text(encoding="utf-8")


def _title(run: Run) -> str:
    return run.info.get("title") or run.scene.get("title") or run.folders[0].name


def _facts(run: Run) -> str:
    info = run.info
    facts = [f"{len(run.frames)} frames", f"{run.frames[-1].step:,} steps"]
    if run.recorded(0):
        first = next(i for i in range(len(run.frames)) if run.has(i, 0))
        facts.append(f"{len(run.zones(first).corners):,} zones")
    for rank in run.windows:
        last = next(i for i in reversed(range(len(run.frames))) if run.has(i, rank))
        facts.append(f"{len(run.discs(last, rank).xy):,} discs (rank {rank})")
    if "seed" in info:
        facts.append(f"seed {info['seed']}")
    if "start" in info:
        facts.append(f"computed {info['start'][:10]}")
    if "colluvium" in info.get("versions", {}):
        facts.append(f"colluvium {info['versions']['colluvium']}")
    return " · ".join(facts)


def _closing(info: dict[str, Any]) -> str:
    """The closing tables and sentences from run.json."""
    if not info:
        return "<p>Not yet: the run has left no run.json.</p>"
    tables = ((closing.OUTCOME, closing.rows(info)), (closing.SECONDS, closing.times(info)))
    parts = [_table(columns, rows) for columns, rows in tables if rows]
    if parts:
        parts.append(
            '<p class="hint">P/l vs stress: rms difference between the discs\' forces on the rim and the stress of the zones '
            "beside it, over the rms stress. Times in seconds.</p>"
        )
    parts += [f"<p>{escape(sentence)}</p>" for sentence in closing.sentences(info)]
    return "\n".join(parts)


def _table(columns: Sequence[str], rows: list[list[str]]) -> str:
    side = ["left" if name in closing.TEXT_COLUMNS else "right" for name in columns]

    def line(tag: str, texts: Sequence[str]) -> str:
        cells = (f'<{tag} class="{where}">{escape(text)}</{tag}>' for where, text in zip(side, texts, strict=True))
        return f"<tr>{''.join(cells)}</tr>"

    body = "\n".join(line("td", row) for row in rows)
    return f"<table><thead>{line('th', columns)}</thead>\n<tbody>{body}</tbody></table>"
