"""Meshes that no scene describes: single zones, shaken meshes, and meshes without mixed discretisation."""

from dataclasses import replace

import numpy as np

from colluvium import Scene
from fdm_server.mesh.grid import Grid
from fdm_server.model import build_model, model_of, new_state
from fdm_server.step.blocks import TRIANGLES
from fdm_server.step.stress import SD, SM, XY, ZZ
from verification import as_a_run


def model_of_zones(xy, zones, material, fixed=None):
    """Model and State of `zones` (Z,4) with gridpoints `xy` (N,2) of one material (table); fixed (N,2): components held at 0."""
    none = np.zeros(len(zones), dtype=np.int64)
    grid = Grid(np.asarray(xy, dtype=np.float64), np.asarray(zones, dtype=np.int64), none, none, none)
    box = {"kind": "box", "length": 1.0, "height": 1.0, "zone_size": 1.0}
    model = build_model(Scene(**as_a_run.tables(box, material, as_a_run.IDLE)), grid)
    if fixed is not None:
        model = replace(model, fixed=np.ascontiguousarray(fixed, dtype=np.bool_))
    return model, new_state(model)


def set_stress(state, xx, yy, zz, xy):
    """The same stress [Pa] in all zones; forces follow in the next step."""
    for row, lanes, value in ((SM, 16, 0.5 * (xx + yy)), (ZZ, 16, zz), (SD, 64, 0.5 * (xx - yy)), (XY, 64, xy)):
        state.stress[:, row : row + lanes] = value


def without_mixing(model):
    """The model with every quadrilateral as its two overlaid pairs of triangles, each a zone of its own; four zones for one.

    A zone of one triangle has a dilation of its own, so this is the same overlay without mixed discretisation. It is twice as
    thick: each of the two pairs covers the whole area, forces and masses are twice as large.
    """
    grid = model.grid
    corners = grid.zones[:, TRIANGLES].reshape(-1, 3)
    column, row, material = (np.repeat(values, len(TRIANGLES)) for values in (grid.column, grid.row, grid.material))
    triangles = grid._replace(zones=np.column_stack([corners, corners[:, 2]]), column=column, row=row, material=material)
    return model_of(triangles, np.arange(len(triangles.zones)), model.density, model.material_law, model.fixed)
