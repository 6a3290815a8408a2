"""The quantity whose error is studied: a factor of safety, a history, or a field at a place.

    fos                         the factor that `colluvium fos` finds, of grid and discs where they are coupled, on the first mesh
    max_displacement@overload   the last value of a history, or the last one in a stage
    1:porosity                  a history of the discs of rank 1
    displacement_y(12.5, 9)     a field of the grid at a place, in the last frame (of a stage: @NAME behind it)
    stress_xx(0, 0, 2, 0, 1, 3) mean stress in a polygon: of the grid, of the discs with their rank before it
    1:stress_xx(1, 2, 0.5)      mean stress of the discs in a circle (x, y, radius)
    fabric_a@couple             anisotropy of the contacts, of rank 1 unless another one is named; also fabric_a_n, and the
                                directions fabric_theta_a and fabric_theta_n [deg]
    failure_gravity             gravity over that of the first stage at which a band joins toe and crest
    energy.error                largest energy_error of a side over the largest energy of its ledger (record.energy)

At a place, a field of gridpoints is linear in the triangle of a zone's corners, and a field of zones is that of the plane through
its values at the NEAREST centres, by least squares: both are exact for linear fields, also at the boundary.
"""

import re
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from colluvium.accuracy import measured
from colluvium.results.run import Run, open_run
from colluvium.running import searches
from coupler_protocol.problems import Problem, SceneError

FACTOR = "fos"
NEAREST = 9
_TEXT = re.compile(r"(?:(\d+):)?([a-z]\w*(?:[:.][\w.]+)?)(?:\(([^()]*)\))?(?:@(.+))?", re.IGNORECASE)
_PARTS = {"x": 0, "y": 1, "xx": 0, "yy": 1, "zz": 2, "xy": 3}  # columns of displacement and velocity, and of stress


class Quantity(NamedTuple):
    """A quantity as the user wrote it: name, rank or None, place [m] or None, stage or None.

    place: (x, y), a circle (x, y, radius), or the corners of a polygon (x1, y1, x2, y2, ..).
    """

    text: str
    name: str
    rank: int | None
    place: tuple[float, ...] | None
    stage: str | None

    @property
    def is_factor(self) -> bool:
        """Whether a search for a factor of safety gives it."""
        return self.name == FACTOR


def quantity_of(text: str, scene: Any) -> Quantity:
    """The quantity that a text describes; raises SceneError if it describes none."""
    found = _TEXT.fullmatch(text.strip())
    remedy = "for example fos, max_displacement@STAGE, 1:NAME or displacement_y(12.5, 9)"
    if not found:
        raise SceneError([Problem("--of", None, text, "is no quantity", remedy)])
    rank, name, place, stage = found.groups()
    if stage is not None and stage not in [one.name for one in scene.stage]:
        raise SceneError([Problem("--of", None, text, f"the scene has no stage {stage!r}", "name one of its stages")])
    if name == FACTOR and scene.grid is None:
        raise SceneError([Problem("--of", None, text, "discs alone have no factor of safety", "name a history")])
    point = None
    if place is not None:
        try:
            point = tuple(map(float, place.split(",")))
        except ValueError:
            point = ()
        if why := measured.fault_of_place(name, point, None if rank is None else int(rank)):
            raise SceneError([Problem("--of", None, text, f"({place}) is no place: {why}", remedy)])
    return Quantity(text, name, None if rank is None else int(rank), point, stage)


def value_of(quantity: Quantity, folder: Path) -> tuple[float, float]:
    """(value, half width of what is known of it) of a quantity from a finished run or search in a folder.

    Raises LookupError if the run did not record it, or the place is not in the ground.
    """
    if quantity.is_factor:
        return searches.value_of(folder)
    with open_run(folder) as run:
        if measured.knows(quantity):
            return measured.value_of(quantity, run)
        return (_of_history if quantity.place is None else _of_field)(quantity, run), 0.0


def _of_history(quantity: Quantity, run: Run) -> float:
    """The last value of a history, in the stage if one is named."""
    steps, values = run.history(quantity.name, quantity.rank)
    if quantity.stage is not None:
        last = run.frames[run.last_frame(quantity.stage)].step
        values = values[steps <= last]
    if not len(values):
        raise LookupError(f"history {quantity.name} has no value before the end of stage {quantity.stage}")
    return float(values[-1])


def _of_field(quantity: Quantity, run: Run) -> float:
    """A field of the grid at a place."""
    place = np.array(quantity.place)
    frame = len(run.frames) - 1 if quantity.stage is None else run.last_frame(quantity.stage)
    whole, _, part = quantity.name.rpartition("_")
    name, column = (whole, _PARTS[part]) if whole and part in _PARTS else (quantity.name, None)
    points, zones = run.gridpoints(frame), run.zones(frame)
    of = points if name in points else zones
    values = of[name]
    if column is not None:
        values = values[:, column]
    if values.ndim > 1:
        raise LookupError(f"{name} has several columns: name one of them, such as {name}_{'y' if of is points else 'yy'}")
    share, corners = _triangle(place, points.xy, zones.corners)
    if share.min() < -1e-9:
        raise LookupError(f"{quantity.place} is in no zone")
    return float(share @ values[corners]) if of is points else _plane_at(place, of.xy, values)


def _triangle(place: np.ndarray, xy: np.ndarray, zones: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Area coordinates (3,) of a place in the triangle of corners (3,) that it is in, or least outside of: two of each zone."""
    corners = np.concatenate([zones[:, [0, 1, 2]], zones[:, [0, 2, 3]]])
    a, b, c = (xy[corners[:, i]] for i in range(3))
    double = _cross(b - a, c - a)
    share = np.stack([_cross(b - place, c - place), _cross(c - place, a - place), _cross(a - place, b - place)], axis=1)
    found = np.full(share.shape, -np.inf)  # for triangles without an area
    np.divide(share, double[:, None], out=found, where=double[:, None] > 0.0)
    best = found.min(axis=1).argmax()
    return found[best], corners[best]


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])


def _plane_at(place: np.ndarray, xy: np.ndarray, values: np.ndarray) -> float:
    """Value at a place of the plane through the values at the nearest points."""
    away = xy - place
    near = np.argsort((away**2).sum(axis=1), kind="stable")[:NEAREST]
    columns = np.column_stack([np.ones(len(near)), away[near]])
    return float(np.linalg.lstsq(columns, values[near], rcond=None)[0][0])
