"""Discs alone far from the origin, as at UTM coordinates, are computed about a local origin.

A gap is a difference of positions: at 5.5e6 m it has a round-off of 9e-10 m, and k/2 times that is an unbalanced force that no
step removes. Where coordinates are more than FAR times the size of a scene, the scene is therefore computed about the corner of
its discs, in whole metres; all files of a run have the coordinates of the scene. Grids begin at x = 0, y = 0.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

FAR = 1000.0  # times the size of the scene


def local_origin(scene: Any, discs: Array | None = None) -> Array:
    """Point (2,) [m] about which a scene is computed; (0, 0) unless its discs are far from there.

    discs: positions (n, 2) [m] of the discs where they come from a file.
    """
    nowhere = np.zeros(2)
    if scene.grid is not None:
        return nowhere
    points = np.concatenate([np.reshape(w.polygon, (-1, 2)) for w in scene.window] + ([] if discs is None else [discs]))
    if not len(points):
        return nowhere
    low, high = points.min(axis=0), points.max(axis=0)
    size = max(float((high - low).max()), 2.0 * scene.discs.radius)
    return np.floor(low) if np.abs(points).max() > FAR * size else nowhere


def in_the_scene(points: Array, origin: Array | tuple[float, float]) -> Array:
    """Points (.., 2) [m] counted from `origin` in the coordinates of the scene; the same array where nothing was shifted."""
    return points + origin if np.any(origin) else points


def about(scene: Any, origin: Array) -> Any:
    """The scene with all coordinates counted from the point `origin` (2,) [m]; discs of a file are left to who reads it."""
    if not np.any(origin):
        return scene

    def moved(points: Any) -> Any:
        return type(points)(tuple(map(_counted, point, origin.tolist())) for point in points)

    windows = [w.model_copy(update={"polygon": moved(w.polygon)}) for w in scene.window]
    walls = [wall.model_copy(update={"ends": moved(wall.ends)}) for wall in scene.discs.wall]
    changed = {"window": windows, "discs": scene.discs.model_copy(update={"wall": walls})}
    if scene.stones is not None:
        changed["stones"] = scene.stones.model_copy(update={"origin": moved([scene.stones.origin])[0]})
    return scene.model_copy(update=changed)


def _counted(value: float, start: float) -> float:
    """A coordinate counted from `start`, with the decimals that it had: 5512345.03 from 5512345.0 is 0.03."""
    return round(value - start, int(-np.log10(2.0 * np.spacing(abs(value)))))
