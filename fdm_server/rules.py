"""What a scene must fulfil so that the grid can be built; found by the scene reader through `colluvium.rules`."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fdm_server.boundary import fixed_components
from fdm_server.excavation import excavations
from fdm_server.grid import build_grid
from fdm_server.windows import rim_of, window_zones


class _Hole(NamedTuple):
    """Zones and rim of a window, as excavations see it."""

    mask: NDArray[np.bool_]
    nodes: NDArray[np.int64]


def grid_can_be_built(scene):
    """Profile, zone size, regions and boundaries fit together; windows are whole zones, and digs leave no islands."""
    if scene.grid is None:
        return
    try:
        grid = build_grid(scene)
        fixed = fixed_components(grid, scene.boundary)
    except ValueError as error:
        yield ("grid",), str(error), ""
        return
    holes = []
    for i, window in enumerate(scene.window):
        try:
            mask = window_zones(grid, window)
            holes.append(_Hole(mask, rim_of(grid, mask)))
        except ValueError as error:
            yield ("window", i), str(error), ""
    try:
        excavations(scene, grid, fixed, holes)
    except ValueError as error:
        yield ("stage",), str(error), ""
