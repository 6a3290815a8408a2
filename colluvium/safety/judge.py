"""Judge of a coupled trial: the verdict of fdm_server/fos/verdict.py on the motion of gridpoints and discs together.

It is the plugin of a trial (Judge.on_step), called on every side. Each side appends a row for every span to its own file:

    square   sum of m d^2 over its bodies, d: displacement in the span [kg m2]
    product  sum of m d d', d': displacement in the span before [kg m2]
    ratios   unbalanced ratio at each look

and the judge of the whole reads them:

    motion = sqrt(sum of squares / sum of masses)     similarity = sum of products / sqrt(sum of squares, this span and before)

with the ratio of the side where it is largest. Bodies are the gridpoints and the discs that are free; control discs move with the
gridpoints.

The grid gives the verdict on span k at the end of span k+1: by then every window has sent the force of a later step, so its rows
are complete, and the same step ends the trial whatever the speed of the processes.
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

from coupler_protocol.exits import EnvironmentFailed
from fdm_server.fos.verdict import Span, verdict

LOOKS = 4  # at the ratios in a span
SCRIPT = """# Judge of a trial, written by colluvium fos.
from colluvium.safety.judge import Judge

judge = Judge.read({folder!r})
EVERY = judge.every
on_step = judge.on_step
"""


@dataclass
class Meter:
    """Motion of one side in the present span."""

    begin: np.ndarray  # (n, 2) [m] displacement at the begin of the trial
    start: np.ndarray  # at the begin of the span
    before: np.ndarray  # motion of the span before
    ratios: list[float] = field(default_factory=list)

    def row(self, displacement: np.ndarray, mass: np.ndarray) -> dict[str, Any]:
        """The row of the span that ends; begins the next one."""
        moved, gone = displacement - self.start, displacement - self.begin
        row = {
            "square": float(mass @ (moved**2).sum(axis=1)),
            "product": float(mass @ (moved * self.before).sum(axis=1)),
            "mass": float(mass.sum()),
            "farthest": float(np.hypot(*gone.T).max(initial=0.0)),
            "ratios": self.ratios,
        }
        self.start, self.before, self.ratios = displacement.copy(), moved, []
        return row


@dataclass
class Judge:
    """One trial in the folder `folder`: stage, steps of a span, limits, number of windows."""

    folder: Path
    stage: str
    span: int
    ratio: float
    settlement: float
    gravity: float
    windows: int
    meters: dict[int, Meter] = field(default_factory=dict)  # by rank
    rows: list[dict[str, Any]] = field(default_factory=list)  # of the grid

    @classmethod
    def read(cls, folder: str | Path) -> "Judge":
        """The judge that `write` has written."""
        folder = Path(folder)
        return cls(folder, **json.loads((folder / "judge.json").read_text(encoding="utf-8")))

    def write(self) -> Path:
        """Writes judge.json, and the plugin that reads it; returns the path of the plugin."""
        about = {key: getattr(self, key) for key in ("stage", "span", "ratio", "settlement", "gravity", "windows")}
        (self.folder / "judge.json").write_text(json.dumps(about), encoding="utf-8")
        path = self.folder / "judge.py"
        path.write_text(SCRIPT.format(folder=str(self.folder.resolve())), encoding="utf-8")
        return path

    @property
    def every(self) -> int:
        """Steps between looks."""
        return self.span // LOOKS

    def on_step(self, moment: Any) -> str | None:
        """Notes a look at one side; the verdict on the spans so far, where the grid has one."""
        if moment.stage != self.stage:
            return None
        displacement, mass, ratio = _of_grid(moment, self.gravity) if moment.rank == 0 else _of_discs(moment, self.gravity)
        meter = self.meters.get(moment.rank)
        if meter is None:
            self.meters[moment.rank] = Meter(displacement.copy(), displacement.copy(), np.zeros_like(displacement))
            return None
        meter.ratios.append(ratio)
        if len(meter.ratios) < LOOKS:
            return None
        row = meter.row(displacement, mass)
        with rows_of(self.folder, moment.rank).open("a", encoding="utf-8") as file:
            file.write(json.dumps(row) + "\n")
        if moment.rank:
            return None
        self.rows.append(row)
        return self._verdict()

    def _verdict(self) -> str | None:
        """Verdict on all spans but the last, as text for the end of the stage."""
        count = len(self.rows) - 1
        if count < 1:
            return None
        sides = [self.rows, *(read_rows(self.folder, rank) for rank in range(1, self.windows + 1))]
        if any(len(side) < count for side in sides):
            raise EnvironmentFailed(f"{self.folder}: a window has not written its motion of span {count}: is it on this machine?")
        spans = spans_of([side[:count] for side in sides])
        return verdict(spans, self.ratio, self.settlement, farthest([side[:count] for side in sides]))


def rows_of(folder: Path, rank: int) -> Path:
    """File with the rows of a side."""
    return folder / f"motion.rank{rank}.jsonl"


def read_rows(folder: Path, rank: int) -> list[dict[str, Any]]:
    """Rows of a side so far, whole lines only."""
    path = rows_of(folder, rank)
    text = path.read_text(encoding="utf-8") if path.exists() else ""
    return [json.loads(line) for line in text.split("\n")[:-1]]


def spans_of(sides: Sequence[Sequence[dict[str, Any]]]) -> list[Span]:
    """Spans of all sides together; sides: rows of each, equally many."""
    spans, before = [], 0.0
    for rows in zip(*sides, strict=True):
        square, mass, product = (sum(row[key] for row in rows) for key in ("square", "mass", "product"))
        lengths = float(np.sqrt(square * before))
        similarity = float(np.clip(product / lengths, -1.0, 1.0)) if lengths > 0.0 else 0.0
        ratios = [max(look) for look in zip(*(row["ratios"] for row in rows), strict=True)]
        spans.append(Span(median(ratios), ratios[-1], float(np.sqrt(square / mass)), similarity))
        before = square
    return spans


def farthest(sides: Sequence[Sequence[dict[str, Any]]]) -> float:
    """Largest displacement [m] of a gridpoint or disc since the trial began."""
    return max((side[-1]["farthest"] for side in sides if side), default=0.0)


def _of_grid(moment: Any, gravity: float) -> tuple[np.ndarray, np.ndarray, float]:
    """Displacements (N, 2) [m], masses (N,) [kg] and unbalanced ratio of the grid."""
    from fdm_server.step.gridpoint_pass import unbalanced_ratio

    model, state = moment.model, moment.state
    return state.displacement, model.weight_mass, unbalanced_ratio(model, state, gravity)


def _of_discs(moment: Any, gravity: float) -> tuple[np.ndarray, np.ndarray, float]:
    """Displacements (n, 2) [m], masses (n,) [kg] of free discs and unbalanced ratio of a window."""
    from dem_server.observe.unbalanced_ratio import unbalanced_ratio

    model, state = moment.model, moment.state
    free = slice(model.ring, None)
    return state.displacement[free], state.weight[free], unbalanced_ratio(model, state, gravity)
