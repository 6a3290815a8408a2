"""Meshes that no scene describes: single zones, shaken meshes, and meshes without mixed discretisation."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np

from fdm_server.blocks import TRIANGLES
from fdm_server.effects.damping import Damping
from fdm_server.grid import Grid
from fdm_server.model import build_model, new_state


def model_of_zones(xy, zones, material, fixed=None, damping=0.8):
    """Model and State of `zones` (Z,4) with gridpoints `xy` (N,2) of one material; fixed (N,2): components held at 0."""
    none = np.zeros(len(zones), dtype=np.int64)
    grid = Grid(np.asarray(xy, dtype=np.float64), np.asarray(zones, dtype=np.int64), none, none, none)
    model = build_model(SimpleNamespace(material=[material], boundary=[], damping=Damping(local=damping)), grid)
    if fixed is not None:
        model = replace(model, fixed=np.ascontiguousarray(fixed, dtype=np.bool_))
    return model, new_state(model)


def overlaid_triangles(zones):
    """Zones (4Z,4): every quadrilateral as its two overlaid pairs of triangles, each a zone of its own.

    A zone of one triangle has a dilation of its own, so this mesh is the same overlay without mixed discretisation. It is twice
    as thick: each of the two pairs covers the whole area. Forces and masses are twice as large.
    """
    triangles = zones[:, TRIANGLES].reshape(-1, 3)
    return np.column_stack([triangles, triangles[:, 2]])
