"""The point about which a scene is computed, and the scene with all its coordinates counted from there.

A gap or a strain is a difference of positions: at 5.5e6 m a position has a round-off of 9e-10 m, and k/2 times that is an
unbalanced force that no step removes. So nothing is computed far from zero:

    with a grid      about the point where the grid begins: its lower left corner, the centre of a ring
    discs alone      about the corner of the discs, in whole metres, if coordinates are more than FAR times the size of the scene

A scene that was read has the coordinates of its file, and so has all that a run writes or says. `local` is the one door in
between: servers, rules and forecasts compute the scene that it returns, and what leaves them is counted from its `origin`
(`in_the_scene`, coupler_protocol.geometry.spot). Keys that are places are declared as such (`place` of
coupler_protocol.scene.declare.quantity); who reads a file of places counts them from there. Coordinates are shifted as decimals:
5512345.03 from 5512345.0 on is 0.03.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from coupler_protocol.scene.declare import Table

Array = NDArray[np.float64]

FAR = 1000.0  # times the size of the scene
MISS = {True: 0.5, False: 1e-6}  # of a zone, by which a profile may miss the side of a net of equal zones, or of others


def local(scene: Any) -> Any:
    """The scene as it is computed: about its local origin. The same object if that is (0, 0) or if the scene is local already."""
    return about(scene, local_origin(scene)) if scene.drawn is scene else scene


def local_origin(scene: Any, discs: Array | None = None) -> Array:
    """Point (2,) [m] about which a scene is computed.

    discs: positions (n, 2) [m] of the discs where they come from a file.
    """
    if scene.grid is not None:
        return _corner(scene.grid)
    drawn = [np.array(w.polygon) for w in scene.window if w.polygon is not None] + ([] if discs is None else [discs])
    if scene.discs is None or not drawn:
        return np.zeros(2)
    points = np.concatenate(drawn)
    low, high = points.min(axis=0), points.max(axis=0)
    size = max(float((high - low).max()), 2.0 * scene.discs.radius)
    return np.floor(low) if np.abs(points).max() > FAR * size else np.zeros(2)


def _corner(grid: Any) -> Array:
    """Where the table [grid] begins (2,) [m]: at its `origin`, or as its profile says (meaning of that key)."""
    if grid.origin is not None or grid.profile is None:
        return np.array(grid.origin or (0.0, 0.0))
    x, y = np.transpose(grid.profile)
    left = float(x[0]) if abs(x[0]) > MISS[grid.regular] * grid.zone_size[0] else 0.0
    higher = y.min() > grid.height and (left != 0.0 or y.min() > FAR * grid.height)
    return np.array([left, _counted(float(y.max()), grid.height) if higher or y.max() <= 0.0 else 0.0])


def in_the_scene(points: Array, origin: Array | tuple[float, float]) -> Array:
    """Points (.., 2) [m] counted from `origin` in the coordinates of the scene; the same array where nothing was shifted."""
    return points + np.asarray(origin) if np.any(origin) else points


def about(scene: Any, origin: Array) -> Any:
    """The scene with all coordinates counted from the point `origin` (2,) [m]; files are left to who reads them."""
    if not np.any(origin):
        return scene
    found, point = counted(scene, origin), tuple(origin.tolist())
    found = found.model_copy(update={"grid": found.grid and found.grid.model_copy(update={"origin": point})})
    found.note_drawn(scene, point)
    return found


def counted(table: Any, origin: Array) -> Any:
    """A table of a scene with all places in it, and in tables inside, counted from the point `origin` (2,) [m]."""
    changes = {}
    for name, field in type(table).model_fields.items():
        value, extra = getattr(table, name), field.json_schema_extra
        place = extra.get("place") if isinstance(extra, dict) else None
        if isinstance(value, Table):
            changes[name] = counted(value, origin)
        elif isinstance(value, list) and value and isinstance(value[0], Table):
            changes[name] = [counted(item, origin) for item in value]
        elif place is not None and value is not None:
            start = origin if place == "xy" else np.full(2, origin["xy".index(str(place))])
            changes[name] = _shifted(value, start.tolist())
    changes = {name: value for name, value in changes.items() if value is not getattr(table, name)}
    return table.model_copy(update=changes) if changes else table


def _shifted(value: Any, start: list[float], axis: int = 0) -> Any:
    """Numbers, in sequences of sequences, counted from `start`: its first number for the first of a pair, else its second."""
    if isinstance(value, list | tuple):
        return type(value)(_shifted(item, start, k % 2) for k, item in enumerate(value))
    return _counted(value, start[axis])


def counted_points(points: Array, origin: Array | tuple[float, float]) -> Array:
    """Points (n, 2) [m] that were written as decimals, counted from `origin`; the same array where that is (0, 0)."""
    if not np.any(origin):
        return points
    return np.array([[_counted(value, start) for value, start in zip(p, origin, strict=True)] for p in points.tolist()])


def _counted(value: float, start: float) -> float:
    """A coordinate counted from `start`, with the decimals that both have: 5512345.03 from 5512345.0 is 0.03."""
    if start == 0.0:
        return value
    return round(value - start, int(-np.log10(2.0 * np.spacing(max(abs(value), abs(start))))))
