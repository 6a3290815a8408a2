"""A quarter of a graded ring of zones around a circular hole, with or without mixed discretisation; for Kirsch and Salencon.

The ring of the scene goes from the wall r = a = 1 m to r = 8a (or as far as a case says), its zones are nearly square.
Gridpoints on the axes slide along them. The loads of an infinite plate on the outer side and other ways than straight ramps
are none that a scene can say: `hole` and `settle` take the steps here. What a scene can say goes through the product, `seen`
looks at the outcome."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from colluvium import Scene
from fdm_server.ground.boundaries_in_time import begin_stage
from fdm_server.mesh.grid import areas, build_grid, centroids
from fdm_server.model import Model, State, build_model, new_state
from fdm_server.observe import fields
from fdm_server.step.blocks import triangle_double_areas
from fdm_server.step.gridpoint_pass import unbalanced_ratio, update_velocities
from fdm_server.step.zone_pass import advance
from verification import as_a_run
from verification.continuum.meshes import set_stress, without_mixing

OUTER = 8.0  # [m]


class Hole(NamedTuple):
    """The quarter ring: N gridpoints, Q quadrilaterals of n to the right angle."""

    model: Model
    state: State
    xy: NDArray[np.float64]  # (N,2) [m]
    quads: NDArray[np.int64]  # (Q,4)
    wall: NDArray[np.int64]  # (n + 1,) gridpoints from the x axis to the y axis
    outer: NDArray[np.int64]  # (n + 1,) the same at the far side
    thickness: float  # of what the zones cover: 1; 2 without mixed discretisation (meshes.py)

    @property
    def radius(self):
        """Distances [m] of the centroids (Q,) from the axis of the hole."""
        return np.hypot(*centroids(self.xy, self.quads).T)


def ring_grid(n, outer=OUTER):
    """Table [grid] of the ring with n zones to the right angle."""
    return {"kind": "ring", "inner": 1.0, "outer": outer, "around": n, "part": "quarter"}


AXES = [{"on": "left", "fix": "x"}, {"on": "bottom", "fix": "y"}]


def seen(model, state, quads=None, thickness=1.0):
    """The Hole of a model whose grid is such a ring; quads: its quadrilaterals, where the model has others."""
    xy = model.grid.xy
    wall = np.arange(int(model.grid.column.max()) + 2)
    return Hole(model, state, xy, model.grid.zones if quads is None else quads, wall, len(xy) - len(wall) + wall, thickness)


def hole(n, bulk, shear, mixed=True, pressure=0.0, across=0.0, **laws):
    """The ring to take steps with; initial pressures [Pa] in the plane and across it; laws: tables."""
    scene = Scene(**as_a_run.tables(ring_grid(n), as_a_run.material(bulk, shear, **laws), as_a_run.IDLE, AXES))
    model = build_model(scene, build_grid(scene))
    model, _ = begin_stage(scene, 0, model, new_state(model))
    quads = model.grid.zones
    if not mixed:
        model = without_mixing(model)
    state = new_state(model)
    set_stress(state, -pressure, -pressure, -across, 0.0)
    advance(model, state)  # at rest: forces of the initial stress
    return seen(model, state, quads, 1.0 if mixed else 2.0)


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
