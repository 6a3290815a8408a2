"""Runs of the coupled scenes in tests/hard: what they end with, and what they leave."""

import json
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

import colluvium
from coupler_protocol.exits import DONE, RunEnded
from coupler_protocol.files import checkpoint
from verification.coupling.bits import DISCS, GRID


class Ended(NamedTuple):
    """A run that has ended: content of run.json, and the error with which it ended, or None."""

    info: dict
    error: RunEnded | None

    @property
    def code(self):
        """Exit code."""
        return self.error.code if self.error else DONE

    @property
    def said(self):
        """Text of the error, "" without."""
        return str(self.error or "")

    def row(self, stage):
        """Row of a stage in run.json."""
        return next(row for row in self.info["stages"] if row["name"] == stage)


def ended(tables, folder, **functions):
    """Computes tables of a scene into a folder, in one process; functions: on_step, on_stage of colluvium.run."""
    error = None
    try:
        colluvium.run(colluvium.Scene(**tables), folder, **functions).close()
    except RunEnded as caught:
        error = caught
    return Ended(json.loads((Path(folder) / "run.json").read_text(encoding="utf-8")), error)


def saved(folder, phase):
    """Number of sides that have left a checkpoint with this name, whole."""
    found = 0
    for side in (GRID, DISCS):
        with suppress(RunEnded, OSError):
            checkpoint.load(Path(folder) / f"{side}.{phase}.h5")
            found += 1
    return found
