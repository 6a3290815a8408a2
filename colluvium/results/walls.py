"""Walls of discs alone in a frame: the ends of the scene, moved like the recorded middle of each wall.

Walls translate only. Their middles are histories (`wall_x:NAME`, `wall_y:NAME`); between two recorded steps they are linear.
"""

from typing import Any

import numpy as np

from colluvium.results.run import Run
from coupler_protocol.scene.tables.discs import Wall, names_of_walls


def ends(run: Run, frame: int) -> dict[str, np.ndarray]:
    """Ends (2, 2) [m] of every wall in a frame by its name; empty without walls."""
    tables = (run.scene.get("discs") or {}).get("wall") or ()
    step = run.frames[frame].step
    names = names_of_walls([Wall.model_construct(name=table.get("name")) for table in tables])
    return {name: _moved(run, name, table, step) for name, table in zip(names, tables, strict=True)}


def _moved(run: Run, name: str, table: dict[str, Any], step: int) -> np.ndarray:
    start = np.array(table["ends"], dtype=float)
    middle = start.mean(axis=0)
    now = [_at(run, f"wall_{axis}:{name}", step, middle[k]) for k, axis in enumerate("xy")]
    return start + (np.array(now) - middle)


def _at(run: Run, name: str, step: int, at_start: float) -> float:
    """Value of a history at a step; the walls of the scene begin at step 0."""
    if not run.has_history(name):
        return at_start
    steps, values = run.history(name)
    return float(np.interp(step, np.append(0, steps), np.append(at_start, values)))
