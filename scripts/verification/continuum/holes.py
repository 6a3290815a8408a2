"""A quarter of a graded ring of zones around a circular hole, with or without mixed discretisation; for Kirsch and Salencon.

The ring runs from the wall r = a to r = a 2^d. Radii grow by a constant factor and r = 2a lies on gridpoints, so zones are nearly
square everywhere. Gridpoints on the axes slide along them.
"""

from types import SimpleNamespace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fdm_server import fields
from fdm_server.advance import advance
from fdm_server.blocks import triangle_double_areas
from fdm_server.effects.elastic import Elastic
from fdm_server.grid import areas, centroids
from fdm_server.model import Model, State
from fdm_server.motion import unbalanced_ratio, update_velocities
from fdm_server.stress import SD, SM, XY, ZZ
from verification.continuum.meshes import model_of_zones, overlaid_triangles


class Hole(NamedTuple):
    """The quarter ring: N gridpoints, Q quadrilaterals of n to the right angle."""

    model: Model
    state: State
    xy: NDArray[np.float64]  # (N,2) [m]
    quads: NDArray[np.int64]  # (Q,4)
    wall: NDArray[np.int64]  # (n + 1,) gridpoints from the x axis to the y axis
    outer: NDArray[np.int64]  # (n + 1,) the same at the far side
    thickness: float  # of what the zones cover: 1, or 2 without mixed discretisation (meshes.py)

    @property
    def radius(self):
        """Distances [m] of the centroids (Q,) from the axis of the hole."""
        return np.hypot(*centroids(self.xy, self.quads).T)


def quarter_ring(n, doublings, radius=1.0):
    """Gridpoints (N,2), quadrilaterals (Q,4), and rings: n zones to the right angle, from `radius` to radius 2^doublings."""
    rings = doublings * max(1, round(np.log(2.0) * n / (0.5 * np.pi)))
    r = radius * 2.0 ** (doublings * np.arange(rings + 1) / rings)
    angle = 0.5 * np.pi * np.arange(n + 1) / n
    x, y = np.cos(angle), np.sin(angle)
    x[-1] = y[0] = 0.0
    xy = np.column_stack([np.outer(r, x).ravel(), np.outer(r, y).ravel()])
    i, j = (k.ravel() for k in np.meshgrid(np.arange(rings), np.arange(n), indexing="ij"))
    first = i * (n + 1) + j
    return xy, np.column_stack([first, first + n + 1, first + n + 2, first + 1]), rings


def hole(n, doublings, bulk, shear, mohr_coulomb=None, mixed=True, stress=(0.0, 0.0, 0.0)):
    """The ring of one material under the initial stress xx = yy, zz, xy [Pa]; mixed: with mixed discretisation."""
    xy, quads, rings = quarter_ring(n, doublings)
    zones = quads if mixed else overlaid_triangles(quads)
    elastic = Elastic(bulk=bulk, shear=shear)
    rock = SimpleNamespace(name="rock", density=1.0, region=None, elastic=elastic, mohr_coulomb=mohr_coulomb, tension=None)
    model, state = model_of_zones(xy, zones, rock, xy == 0.0)
    for row, lanes, value in ((SM, 16, stress[0]), (ZZ, 16, stress[1]), (SD, 64, 0.0), (XY, 64, stress[2])):
        state.stress[:, row : row + lanes] = value
    advance(model, state)  # at rest: forces of the initial stress
    wall = np.arange(n + 1)
    return Hole(model, state, xy, quads, wall, rings * (n + 1) + wall, 1.0 if mixed else 2.0)


def edge_forces(hole, line, traction):
    """Forces (N,2) [N] of tractions (n,2) [Pa] on the n edges of a line of gridpoints."""
    length = np.hypot(*np.diff(hole.xy[line], axis=0).T)
    half = 0.5 * hole.thickness * length[:, None] * traction
    force = np.zeros_like(hole.xy)
    np.add.at(force, line[:-1], half)
    np.add.at(force, line[1:], half)
    return force


def outward(hole, line):
    """Unit normals (n,2) of the edges of a line, away from the axis of the hole."""
    along = np.diff(hole.xy[line], axis=0)
    return np.column_stack([along[:, 1], -along[:, 0]]) / np.hypot(*along.T)[:, None]


def settle(hole, ratio, load=None, ramp=0, most=400_000, look=100):
    """Take steps until the unbalanced ratio is reached after the ramp; load(step) sets applied forces. Returns the steps."""
    model, state = hole.model, hole.state
    for step in range(1, most + 1):
        if load is not None:
            load(step)
        update_velocities(model, state, 0.0)
        advance(model, state)
        if step % look == 0 and step > ramp and unbalanced_ratio(model, state, 0.0) <= ratio:
            return step
    raise ArithmeticError(f"ratio {unbalanced_ratio(model, state, 0.0):.2e} after {most} steps")


def stresses(hole):
    """Stresses xx, yy, zz, xy (Q,4) [Pa] of the quadrilaterals, means over their triangles."""
    stress = fields.stress(hole.model, hole.state)
    if hole.thickness == 1.0:
        return stress
    share = 0.25 * triangle_double_areas(hole.xy, hole.quads) / areas(hole.xy, hole.quads)[:, None]
    return np.einsum("qt,qtc->qc", share, stress.reshape(-1, 4, 4))


def polar(hole):
    """Radial, tangential and shear stress (Q,3) [Pa] at the centroids."""
    x, y = centroids(hole.xy, hole.quads).T
    c, s = x / np.hypot(x, y), y / np.hypot(x, y)
    xx, yy, _, xy = stresses(hole).T
    radial, tangential = c * c * xx + s * s * yy + 2 * c * s * xy, s * s * xx + c * c * yy - 2 * c * s * xy
    return np.column_stack([radial, tangential, (yy - xx) * c * s + xy * (c * c - s * s)])


def norm(hole, values, within=np.inf):
    """Root of the mean square of values (Q,k), by area of the zones whose centroids lie within a radius [m]."""
    weight = areas(hole.xy, hole.quads) * (hole.radius < within)
    return float(np.sqrt(np.sum(weight[:, None] * np.asarray(values) ** 2) / weight.sum()))
