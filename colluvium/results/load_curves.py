"""Load against displacement of moved boundaries, and stress against strain between walls: from histories.

A moved boundary has the histories `moved_x:NAME`, `moved_y:NAME` and its reaction, a wall has its middle and the force or
pressure on it. Strain of a sample is the change of the distance between a moved wall and the wall opposite over the distance at
the start of the stage, shortening positive.
"""

from typing import Any, NamedTuple

import numpy as np

from colluvium.results import walls
from colluvium.results.run import Run

PARALLEL = 0.95  # least cosine between two opposite walls


class Curve(NamedTuple):
    """Loads over one motion: labels with their units, values (n,) of x, and (n,) of y by the name of each line."""

    title: str
    x_label: str
    x_unit: str
    y_label: str
    y_unit: str
    x: np.ndarray
    y: dict[str, np.ndarray]


def curves(run: Run) -> list[Curve]:
    """All curves of a run; none where nothing is moved."""
    return [*_of_boundaries(run), *_of_walls(run)]


def _of_boundaries(run: Run) -> list[Curve]:
    """Reaction of each moved boundary in the direction of its motion."""
    found = []
    for name in run.files[0].history_names() if 0 in run.files else ():
        kind, _, label = name.partition(":")
        other = f"reaction_{kind[-1]}:{label}"
        if kind in ("moved_x", "moved_y") and run.has_history(other, 0):
            (steps, moved), (at, force) = run.history(name, 0), run.history(other, 0)
            load = np.interp(steps, at, force)
            side = np.sign(moved[np.abs(moved).argmax()]) if len(moved) else 0.0
            if side:
                words = "settlement" if kind == "moved_y" and side < 0.0 else "displacement"
                found.append(Curve(f"boundary {label}", words, "m", "load", "N", side * moved, {"reaction": side * load}))
    return found


def _of_walls(run: Run) -> list[Curve]:
    """Pressure, or force where walls have none, over the strain between each wall that a stage moves and its opposite."""
    found = []
    ends = walls.ends(run, 0)
    for stage in run.scene.get("stage", ()):
        for table in stage.get("wall") or ():
            name = table.get("name")
            if name in ends and any(table.get("velocity") or ()) and stage["name"] in run.stages:
                found += _of_wall(run, stage["name"], str(name), ends)
    return found


def _of_wall(run: Run, stage: str, name: str, ends: dict[str, np.ndarray]) -> list[Curve]:
    along = np.diff(ends[name], axis=0)[0]
    normal = np.array([-along[1], along[0]]) / np.hypot(*along)
    steps, path = _path(run, name)
    own = _within(run, stage, steps)
    opposite = _opposite(ends, name, normal)
    if not own.any():
        return []
    steps, moved = steps[own], (path[own] - path[own][0]) @ normal
    if opposite is None:
        x, x_label, x_unit = np.abs(moved), f"displacement of {name}", "m"
    else:
        other = np.column_stack([np.interp(steps, *column) for column in zip(*_columns(run, opposite), strict=True)])
        gap = np.abs((path[own] - other) @ normal)
        x, x_label, x_unit = 100.0 * (1.0 - gap / gap[0]), f"shortening between {name} and {opposite}", "%"
    lines = {wall: f"wall_pressure:{wall}" for wall in ends if run.has_history(f"wall_pressure:{wall}")}
    title = f"stage {stage}: wall {name}"
    if lines:
        y = {wall: np.interp(steps, *run.history(line)) for wall, line in lines.items()}
        return [Curve(title, x_label, x_unit, "pressure on the walls", "Pa", x, y)]
    force = np.column_stack([np.interp(steps, *run.history(f"wall_force_{axis}:{name}")) for axis in "xy"])
    return [Curve(title, x_label, x_unit, "normal force on the wall", "N", x, {name: np.abs(force @ normal)})]


def _columns(run: Run, name: str) -> list[Any]:
    """Steps and values of both coordinates of the middle of a wall, as two pairs."""
    return [run.history(f"wall_{axis}:{name}") for axis in "xy"]


def _path(run: Run, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Steps (n,) and the middle (n, 2) [m] of a wall."""
    (steps, x), (_, y) = _columns(run, name)
    return steps, np.column_stack((x, y))


def _within(run: Run, stage: str, steps: np.ndarray) -> np.ndarray:
    """(n,) whether steps belong to a stage, with the step before its first."""
    end = run.frames[run.last_frame(stage)].step
    before = [run.frames[run.last_frame(other)].step for other in run.stages[: run.stages.index(stage)]]
    return (steps >= max(before, default=0)) & (steps <= end)


def _opposite(ends: dict[str, np.ndarray], name: str, normal: np.ndarray) -> str | None:
    """Name of the farthest parallel wall, or None."""
    middle, found = ends[name].mean(axis=0), {}
    for other, line in ends.items():
        along = np.diff(line, axis=0)[0]
        if other != name and abs(along @ normal) <= np.sqrt(1.0 - PARALLEL**2) * np.hypot(*along):
            found[other] = abs((line.mean(axis=0) - middle) @ normal)
    return max(found, key=lambda other: found[other]) if found else None
