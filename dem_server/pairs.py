"""Contacts as flat arrays, for recording and for everything except the force pass."""

from typing import NamedTuple

import numpy as np

from dem_server.effects.bond import BONDED


class Contacts(NamedTuple):
    """Listed pairs that exist as contacts. Branch and normal point from disc a to disc b.

    disc_a, disc_b (m,); normal_force (compression positive), shear_force (m,) of springs and parallel bonds [N];
    bond_state (m,) of contact bonds; gap (m,): g - gr [m]; branch (m, 2): x_b - x_a [m]; span (m, 2): the same
    between the centroids of their bodies; kind (m,); slot (m,): position in the list of pairs.
    """

    disc_a: np.ndarray
    disc_b: np.ndarray
    normal_force: np.ndarray
    shear_force: np.ndarray
    bond_state: np.ndarray
    gap: np.ndarray
    branch: np.ndarray
    span: np.ndarray
    kind: np.ndarray
    slot: np.ndarray

    @property
    def normal(self):
        """Unit normals (m, 2)."""
        return self.branch / np.hypot(*self.branch.T)[:, None]

    @property
    def tangent(self):
        """Unit tangents (m, 2): normals turned by +90 degrees."""
        nx, ny = self.normal.T
        return np.column_stack([-ny, nx])

    @property
    def force(self):
        """Forces on disc b (m, 2) [N]."""
        return self.normal_force[:, None] * self.normal + self.shear_force[:, None] * self.tangent


def contacts(state):
    """Contacts of the state: pairs with g - gr < 0 or bonded."""
    pairs = listed_pairs(state)
    there = exist(state, pairs)
    return Contacts(*(array[there] for array in pairs))


def exist(state, pairs):
    """(m,) whether each of the listed pairs is a contact."""
    there = (pairs.gap < 0.0) | (pairs.bond_state == BONDED)
    if state.parallel is not None:
        there |= state.parallel.state[pairs.slot] == BONDED
    return there


def listed_pairs(state, slots=None):
    """Listed pairs, also those that do not touch: all, or those at the positions `slots` (m,) of the list."""
    slots = np.arange(len(state.first)) if slots is None else slots
    a, b = state.first[slots].astype(np.int64), state.second[slots].astype(np.int64)

    def taken(array, dtype=float):
        return np.zeros(len(a), dtype) if array is None else array[slots]

    branch = state.x[b] - state.x[a]
    gap = np.hypot(*branch.T) - state.radius[a] - state.radius[b] - taken(state.reference_gap)
    bond = taken(state.bond_state, np.int8)
    span = branch
    if state.clumps is not None:
        centre = body_centres(state)
        span = centre[b] - centre[a]
    normal, shear = taken(state.normal), taken(state.shear)
    if state.parallel is not None:
        normal, shear = normal + taken(state.parallel.normal), shear + taken(state.parallel.shear)
    return Contacts(a, b, normal, shear, bond, gap, branch, span, taken(state.kind), slots)


def levers(state, pairs):
    """Levers li, lj (m,) [m] of listed pairs; of pairs without contact as if they touched."""
    gap = np.hypot(*pairs.branch.T) - state.radius[pairs.disc_a] - state.radius[pairs.disc_b]
    gap = np.where(exist(state, pairs), gap, np.minimum(gap, 0.0))
    return state.radius[pairs.disc_a] + 0.5 * gap, state.radius[pairs.disc_b] + 0.5 * gap


def moments_along(force, line):
    """-sym(F (x) l) of forces (m, 2) [N] that act along lines (m, 2) [m]: xx, yy, xy (m, 3) [N m]."""
    (fx, fy), (lx, ly) = force.T, line.T
    return -np.column_stack([fx * lx, fy * ly, 0.5 * (fx * ly + fy * lx)])


def body_centres(state):
    """Centroid (n, 2) of the body each disc belongs to: its clump, or the disc itself."""
    if state.clumps is None:
        return state.x
    body = state.clumps.body
    return np.where(body[:, None] >= 0, state.clumps.motion[body, :2], state.x)
