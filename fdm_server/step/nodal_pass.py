"""Passes of nodal mixed discretisation before and after the zones' own (effects/nodal_mixing.py). Other scenes have none of them.

Before: the elastic stress of the difference between the averaged strain and that of the zone is added to the zone's stress, so
that the zones' pass continues as if the zone had the averaged strain. After: changes by other laws than elasticity are
averaged, and forces follow.
"""

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from coupler_protocol.compiled import threads
from coupler_protocol.compiled.jit import jit
from coupler_protocol.geometry import corner_joints, corner_weights
from fdm_server.step import present_shape as shape
from fdm_server.step.blocks import LANES, to_blocks
from fdm_server.step.forces import sum_all, sum_at_gridpoints
from fdm_server.step.large_strain import middle_shape, present_shape
from fdm_server.step.strain import C0, C1, C2, C3, V, gather_increments, gather_velocities
from fdm_server.step.stress import SM, ZZ, pressure_increment
from fdm_server.step.thread_parts import STRIP


class Nodal(NamedTuple):
    """Groups of corners that are averaged together: J joints of Z zones in B blocks."""

    joint: NDArray[np.uint32]  # (B,4 rows) joint of each corner
    weight: NDArray[np.float64]  # (B,4 rows) share of each corner in its zone
    start: NDArray[np.uint32]  # (J+1,) corners of joint j are at start[j]:start[j + 1] of the next two
    zone: NDArray[np.uint32]  # (4Z,) zone of a corner
    share: NDArray[np.float64]  # (4Z,) its share of the zone


class Averages(NamedTuple):
    """Scratch memory of the passes of one step.

    trial (B,32) [Pa]: sm and zz that follow from elasticity alone, or None if no other law acts.
    """

    area: NDArray[np.float64]  # (B,16) [m2] of the zones
    value: NDArray[np.float64]  # (B,16) area times what is averaged
    mean: NDArray[np.float64]  # (J,) at joints
    excess: NDArray[np.float64]  # (B,16) averaged strains minus those of the zones [-]
    change_sm: NDArray[np.float64]  # (B,16) [Pa] averaged changes minus those of the zones
    change_zz: NDArray[np.float64]  # (B,16) [Pa]
    trial: NDArray[np.float64] | None


def build_nodal(zones, material):
    """Nodal for active zones (A,4) in the order of the blocks, and their materials (A,)."""
    joint, weight = corner_joints(zones, material), corner_weights(zones)
    order = np.argsort(joint.ravel(), kind="stable")
    start = np.concatenate([[0], np.cumsum(np.bincount(joint.ravel()))])
    return Nodal(
        joint=to_blocks(joint.astype(np.uint32)),
        weight=to_blocks(weight),
        start=start.astype(np.uint32),
        zone=(order // 4).astype(np.uint32),
        share=weight.ravel()[order],
    )


@jit(forceinline=True)
def dilation(b, x, y, inverse, u, i):
    """Volumetric strain increment e [-] of lane i of block b, as in fdm_server/step/strain.py; inverse = 1/2A [1/m2]."""
    x2, y2 = x[b, C2 + i] - x[b, C0 + i], y[b, C2 + i] - y[b, C0 + i]
    across, up = x[b, C3 + i] - x[b, C1 + i], y[b, C3 + i] - y[b, C1 + i]
    u2, u13 = u[C2 + i] - u[C0 + i], u[C1 + i] - u[C3 + i]
    v2, v13 = u[V + C2 + i] - u[V + C0 + i], u[V + C1 + i] - u[V + C3 + i]
    return inverse * (u2 * up + u13 * y2 - v2 * across - v13 * x2)


@jit
def volume_kernel(first, last, corner, x, y, inverse_double_area, velocity, dt, xy, displacement, grid_share, area, volume):
    """Sets areas (B,16) [m2] of the zones of strips first..last, and their changes of volume (B,16) [m2] in a step.

    dt, xy: as in fdm_server/step/zone_pass.py.
    """
    u = np.empty(8 * LANES)
    if xy is not None:
        end_x, end_y, end_share = np.empty((1, 4 * LANES)), np.empty((1, 4 * LANES)), np.empty((1, 4 * LANES))
        mid_x, mid_y, mid_inverse = np.empty((1, 4 * LANES)), np.empty((1, 4 * LANES)), np.empty((1, 5 * LANES))
    for b in range(first * STRIP, min(last * STRIP, corner.shape[0])):
        if dt is None:
            gather_velocities(b, corner, velocity, u)
        else:
            gather_increments(b, corner, velocity, dt, u)
        if xy is None:
            for i in range(LANES):
                inverse = inverse_double_area[b, 4 * LANES + i]
                area[b, i] = 0.5 / inverse if inverse > 0.0 else 0.0
                volume[b, i] = area[b, i] * dilation(b, x, y, inverse, u, i)
        else:
            present_shape(b, corner, grid_share, xy, displacement, end_x, end_y, end_share)
            middle_shape(end_x, end_y, u, mid_x, mid_y, mid_inverse)
            for i in range(LANES):
                inverse = mid_inverse[0, 4 * LANES + i]
                area[b, i] = 0.5 / inverse if inverse_double_area[b, 4 * LANES + i] > 0.0 else 0.0
                volume[b, i] = area[b, i] * dilation(0, mid_x, mid_y, inverse, u, i)


@jit
def joint_kernel(first, last, start, zone, share, area, value, mean):
    """Sets means (J,) of joints first..last, Eq (1): the corners' shares of `value` (B,16) over those of `area` (B,16)."""
    areas, values = area.reshape(area.size), value.reshape(value.size)
    for j in range(first, last):
        above = below = 0.0
        for k in range(start[j], start[j + 1]):
            above += share[k] * values[zone[k]]
            below += share[k] * areas[zone[k]]
        mean[j] = above / below


@jit
def excess_kernel(first, last, joint, weight, mean, area, value, excess):
    """Sets excess (B,16): Eq (2) minus the zone's own value over its area, in the blocks of strips first..last."""
    for b in range(first * STRIP, min(last * STRIP, joint.shape[0])):
        for i in range(LANES):
            averaged = 0.0
            for o in (C0, C1, C2, C3):
                averaged += weight[b, o + i] * mean[joint[b, o + i]]
            excess[b, i] = averaged - value[b, i] / area[b, i] if area[b, i] > 0.0 else 0.0


@jit
def load_kernel(first, last, pattern, elastic, area, volume, excess, stress, trial):
    """Adds the elastic stress of the strains `excess` (B,16).

    trial (B,32) [Pa]: sm and zz that follow from elasticity alone, or None if no other law acts.
    """
    for b in range(first * STRIP, min(last * STRIP, stress.shape[0])):
        m = pattern[b]
        for i in range(LANES):
            sm, zz = pressure_increment(excess[b, i], elastic[m, i], elastic[m, 2 * LANES + i])
            stress[b, SM + i] += sm
            stress[b, ZZ + i] += zz
            if trial is not None:
                own = volume[b, i] / area[b, i] if area[b, i] > 0.0 else 0.0
                sm, zz = pressure_increment(own, elastic[m, i], elastic[m, 2 * LANES + i])
                trial[b, SM + i] = stress[b, SM + i] + sm
                trial[b, ZZ + i] = stress[b, ZZ + i] + zz


@jit
def change_kernel(first, last, row, area, trial, stress, value):
    """Sets value (B,16): area times the change of a row of stress, SM or ZZ, by the laws after elasticity."""
    for b in range(first * STRIP, min(last * STRIP, stress.shape[0])):
        for i in range(LANES):
            value[b, i] = area[b, i] * (stress[b, row + i] - trial[b, row + i])


@jit
def correct_kernel(first, last, corner, x, y, xy, displacement, change_sm, change_zz, stress, corner_force):
    """Adds changes (B,16) [Pa] to sm and zz, and their forces on the corners: fdm_server/step/forces.py."""
    for b in range(first * STRIP, min(last * STRIP, stress.shape[0])):
        for i in range(LANES):
            stress[b, SM + i] += change_sm[b, i]
            stress[b, ZZ + i] += change_zz[b, i]
            half = 0.5 * change_sm[b, i]
            for o, before, after in ((C0, C3, C1), (C1, C0, C2), (C2, C1, C3), (C3, C2, C0)):
                if xy is None:
                    dx, dy = x[b, after + i] - x[b, before + i], y[b, after + i] - y[b, before + i]
                else:
                    p, q = corner[b, before + i], corner[b, after + i]
                    dx = xy[q, 0] + displacement[q, 0] - xy[p, 0] - displacement[p, 0]
                    dy = xy[q, 1] + displacement[q, 1] - xy[p, 1] - displacement[p, 1]
                corner_force[b, o + i] -= half * dy
                corner_force[b, V + o + i] += half * dx


@jit
def average_strains(strips, nodal, averages, geometry, stiffness, velocity, displacement, dt, xy, stress, trial):
    """`NodalPass.before` in one thread; strips: their number; nodal, averages, geometry, stiffness: plain tuples."""
    joint, weight, start, zone, share = nodal
    area, value, mean, excess, _, _, _ = averages
    corner, x, y, inverse_double_area, grid_share = geometry
    pattern, elastic = stiffness
    first = np.int64(0)  # for a literal number numba would compile the kernels once more
    volume_kernel(first, strips, corner, x, y, inverse_double_area, velocity, dt, xy, displacement, grid_share, area, value)
    joint_kernel(first, len(mean), start, zone, share, area, value, mean)
    excess_kernel(first, strips, joint, weight, mean, area, value, excess)
    load_kernel(first, strips, pattern, elastic, area, value, excess, stress, trial)


@jit
def average_changes(strips, nodal, averages, geometry, gather, displacement, xy, stress, trial, corner_force, force):
    """`NodalPass.after` in one thread; arguments as for `average_strains`."""
    if trial is not None:
        joint, weight, start, zone, share = nodal
        area, value, mean, _, change_sm, change_zz, _ = averages
        corner, x, y, _, _ = geometry
        order, _, begin, place = gather
        first = np.int64(0)
        for row, change in ((first + SM, change_sm), (first + ZZ, change_zz)):
            change_kernel(first, strips, row, area, trial, stress, value)
            joint_kernel(first, len(mean), start, zone, share, area, value, mean)
            excess_kernel(first, strips, joint, weight, mean, area, value, change)
        correct_kernel(first, strips, corner, x, y, xy, displacement, change_sm, change_zz, stress, corner_force)
        sum_at_gridpoints(order, first, len(order), begin, place, corner_force, force)


def averages_of(model):
    """Averages for the zones of the model."""
    zones = (len(model.geometry.corner), LANES)
    area, value, excess, change_sm, change_zz = (np.empty(zones) for _ in range(5))
    trial = np.empty((zones[0], 2 * LANES)) if model.law.path_dependent else None
    return Averages(area, value, np.empty(len(model.nodal.start) - 1), excess, change_sm, change_zz, trial)


class NodalPass:
    """The passes of one step around that of the zones: `before` it, and `after` it if other laws than elasticity act.

    Displacements are those at the end of the step.
    """

    def __init__(self, model, state):
        self.model, self.state, self.nodal = model, state, model.nodal
        zones = (len(model.geometry.corner), LANES)
        self.area, self.value, self.excess = np.empty(zones), np.empty(zones), np.empty(zones)
        self.mean = np.empty(len(model.nodal.start) - 1)
        self.trial = np.empty((zones[0], 2 * LANES)) if model.law.path_dependent else None
        parts = len(model.partition.strips)
        self.joints = list(pairwise([len(self.mean) * k // parts for k in range(parts + 1)]))

    def before(self):
        """Averages the strains."""
        model, state = self.model, self.state
        self.strains()
        self._each(
            lambda first, last: load_kernel(
                first, last, model.pattern, model.law.elastic, self.area, self.value, self.excess, state.stress, self.trial
            )
        )

    def strains(self):
        """Sets `excess` (B,16) [-]: averaged strains minus those of the zones."""
        state, g, xy = self.state, self.model.geometry, shape.moving(self.model, self.state)
        self._each(
            lambda first, last: volume_kernel(
                first, last, g.corner, g.x, g.y, g.inverse_double_area, state.velocity, state.dt, xy, state.displacement,
                g.share, self.area, self.value,
            )
        )  # fmt: skip
        self._average(self.excess)

    def after(self):
        """Averages changes of sm and zz by other laws than elasticity, and corrects the forces."""
        if self.trial is None:
            return
        model, state, g, xy = self.model, self.state, self.model.geometry, shape.moving(self.model, self.state)
        changes = []
        for row in (SM, ZZ):
            self._each(
                lambda first, last, row=row: change_kernel(first, last, row, self.area, self.trial, state.stress, self.value)
            )
            changes.append(np.empty_like(self.excess))
            self._average(changes[-1])
        self._each(
            lambda first, last: correct_kernel(
                first, last, g.corner, g.x, g.y, xy, state.displacement, *changes, state.stress, state.corner_force
            )
        )
        sum_all(model, state.corner_force, state.force)

    def _each(self, work):
        threads.each(work, self.model.partition.strips)

    def _average(self, excess):
        n = self.nodal

        def joints(first, last):
            joint_kernel(first, last, n.start, n.zone, n.share, self.area, self.value, self.mean)

        threads.each(joints, self.joints)
        self._each(lambda first, last: excess_kernel(first, last, n.joint, n.weight, self.mean, self.area, self.value, excess))
