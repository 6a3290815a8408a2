"""Intervals in which each process of a run computed, waited and recorded, from `record.trace` (process/trace.py)."""

import csv
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from colluvium.results.run import Run

ACTIVITIES = ("computing", "waiting", "recording")
ENDING = ".trace.csv"


class Intervals(NamedTuple):
    """Intervals of one process in order of time. stage, activity (n,) names; step (n,): completed steps of the stage."""

    stage: NDArray[np.str_]
    step: NDArray[np.int64]
    activity: NDArray[np.str_]
    begin: NDArray[np.float64]  # (n,) [s]
    end: NDArray[np.float64]  # (n,) [s]

    def where(self, mask: NDArray[np.bool_]) -> "Intervals":
        """The Intervals of a mask (n,)."""
        return Intervals(self.stage[mask], self.step[mask], self.activity[mask], self.begin[mask], self.end[mask])

    def shares(self) -> dict[str, float]:
        """Share of the time [-] by activity; 0 without intervals."""
        spent = self.end - self.begin
        whole = float(spent.sum()) or 1.0
        return {name: float(spent[self.activity == name].sum()) / whole for name in ACTIVITIES}


def intervals(run: Run) -> dict[str, Intervals]:
    """Intervals by process ("fdm.rank0", "dem.rank1", ...); empty without a trace."""
    found = {path.name.removesuffix(ENDING): path for folder in reversed(run.folders) for path in folder.glob(f"*{ENDING}")}
    return {name: _read(found[name]) for name in sorted(found, key=lambda name: int(name.rpartition("rank")[2]))}


def _read(path: Path) -> Intervals:
    with open(path, newline="", encoding="utf-8") as file:
        rows = list(csv.reader(file))[1:]
    stage, step, activity, begin, end = zip(*rows, strict=True) if rows else ((),) * 5
    began, ended = (np.array(values, dtype=np.float64) for values in (begin, end))
    return Intervals(np.array(stage, dtype=str), np.array(step, dtype=np.int64), np.array(activity, dtype=str), began, ended)
