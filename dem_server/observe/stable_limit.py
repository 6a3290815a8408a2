"""Springs of a window by the contact law, and the disc, stone or rim node with the shortest stable step.

For a contact with normal n and tangent t at the levers l_i, l_j of its point (contact_law.py):

    normal spring     n . (u_j - u_i),                        kn (spring + parallel bond)
    shear spring      t . (u_j - u_i) - l_i w_i - l_j w_j,    ks
    turning spring    w_j - w_i,                              kr (rolling resistance + bending of the bond)

Control discs move with the rim's nodes by the mapping, discs of a clump with their clump. Contacts are linearised: none opens,
closes, slips or turns. A dashpot acts with the velocity half a step earlier: twice its constant over dt counts as stiffness.
"""

from typing import NamedTuple

import numpy as np
import scipy

from coupler_protocol.criteria.stable_step import Springs, limit, spring_sums
from coupler_protocol.geometry import NOWHERE
from coupler_protocol.interface.mapping import velocities_to_discs
from coupler_protocol.scene.local_origin import in_the_scene
from dem_server.model import INERTIA, MASS, Y
from dem_server.pairs import contacts, levers, listed_pairs
from dem_server.step.stiffness import pair_stiffnesses


class Bodies(NamedTuple):
    """Free discs in order, then clumps (b of them); `disc` (b,): number of the disc, -1 for a clump."""

    disc: np.ndarray
    xy: np.ndarray  # (b, 2) [m]
    mass: np.ndarray  # (b,) [kg]
    inertia: np.ndarray  # (b,) [kg m2]

    def name(self, body):
        """Name of a body for messages."""
        free = np.count_nonzero(self.disc >= 0)
        return f"disc {self.disc[body]}" if body < free else f"stone {body - free}"


def bodies_of(model, state):
    """Bodies of a window: free discs and clumps."""
    disc = np.arange(model.ring, model.count)
    if state.clumps is None:
        return Bodies(disc, state.x[disc], state.mass[disc], state.inertia[disc])
    disc = disc[state.clumps.body[disc] < 0]
    motion, count = state.clumps.motion, len(state.clumps.motion)
    return Bodies(
        np.concatenate([disc, np.full(count, -1)]),
        np.concatenate([state.x[disc], motion[:, : Y + 1]]),
        np.concatenate([state.mass[disc], motion[:, MASS]]),
        np.concatenate([state.inertia[disc], motion[:, INERTIA]]),
    )


def springs_of(model, state, rim=None, listed=False):
    """Springs (coupler_protocol.criteria.stable_step) between the rim's nodes and the bodies.

    listed: springs of all near pairs, also of those that do not touch.
    """
    pairs = listed_pairs(state) if listed else contacts(state)
    kn, ks, kr = pair_stiffnesses(model, state, pairs)
    a, b, (nx, ny), one = pairs.disc_a, pairs.disc_b, pairs.normal.T, np.ones(len(kn))
    la, lb = levers(state, pairs)
    kinds = [  # stiffness, lengthening by (x, y, rotation) of disc a, of disc b
        (kn, (-nx, -ny, 0.0 * one), (nx, ny, 0.0 * one)),
        (ks, (ny, -nx, -la), (-ny, nx, -lb)),
        (kr, (0.0 * one, 0.0 * one, -one), (0.0 * one, 0.0 * one, one)),
    ]
    kinds = [kind for kind in kinds if kind[0].any()] or kinds[:1]
    moves = motion_of_discs(model, state, rim)
    sides = [
        scipy.sparse.csr_array(scipy.sparse.vstack([_rows(disc, 3 * model.count, kind[side]) for kind in kinds]) @ moves)
        for side, disc in ((1, a), (2, b))
    ]
    return Springs(*sides, np.concatenate([kind[0] for kind in kinds]), 0 if rim is None else len(rim.nodes))


def _rows(disc, count, columns):
    """Coefficients of (x, y, rotation) of the discs (m,), sparse (m, count)."""
    at, row = np.concatenate([3 * disc, 3 * disc + 1, 3 * disc + 2]), np.tile(np.arange(len(disc)), 3)
    return scipy.sparse.csr_array((np.concatenate(columns), (row, at)), shape=(len(disc), count))


def motion_of_discs(model, state, rim):
    """Matrix (3 n, 2 K + 3 b), sparse: small motions of all discs for unit motions of the rim's nodes and the bodies."""
    ring = np.zeros((3 * model.ring, 0)) if rim is None else motion_of_ring(model, state, rim)
    clumps, disc = state.clumps, np.arange(model.ring, model.count)
    body, arm = np.arange(len(disc)), np.zeros((len(disc), 2))
    if clumps is not None:
        inside = clumps.body[disc] >= 0
        free = np.count_nonzero(~inside)
        body = np.where(inside, free + clumps.body[disc], np.cumsum(~inside) - 1)
        arm[inside] = state.x[disc[inside]] - clumps.motion[clumps.body[disc[inside]], : Y + 1]
    count, row, one = len(bodies_of(model, state).disc), 3 * np.arange(len(disc)), np.ones(len(disc))
    entries = [  # (row, column, value): x, y and rotation of the body; its rotation moves a disc of a clump sideways
        (row, 3 * body, one), (row + 1, 3 * body + 1, one), (row + 2, 3 * body + 2, one),
        (row, 3 * body + 2, -arm[:, 1]), (row + 1, 3 * body + 2, arm[:, 0]),
    ]  # fmt: skip
    rows, columns, values = (np.concatenate(part) for part in zip(*entries, strict=True))
    free = scipy.sparse.csr_array((values, (rows, columns)), shape=(3 * len(disc), 3 * count))
    return scipy.sparse.block_diag([scipy.sparse.csr_array(ring), free], format="csr")


def motion_of_ring(model, state, rim):
    """Matrix (3 R, 2 K): motions of the control discs for unit motions of the nodes, by the mapping."""
    ring, K, R = rim.ring, len(rim.nodes), model.ring
    motion, of_unit = np.empty((3 * R, 2 * K)), np.empty((R, 3))
    v, spin = of_unit[:, :2], of_unit[:, 2]
    for k, unit in enumerate(np.eye(2 * K).reshape(2 * K, K, 2)):
        velocities_to_discs(
            rim.nodes, unit, ring.seg0, ring.seg1, ring.w0, ring.node, state.x[:R], v, spin, rim.paper
        )  # fmt: skip
        motion[:, k] = of_unit.ravel()
    return motion


def safe_limit(model, state, rim, origin=NOWHERE):
    """Limit of the step (coupler_protocol.criteria.stable_step.limit) by discs and stones, with all listed pairs closed.

    None if no disc is near another one: no spring limits the step. origin (2,) [m]: point of the scene from which positions
    count.
    """
    if not len(state.first):
        return None
    bodies = bodies_of(model, state)
    sums = spring_sums(springs_of(model, state, rim, listed=True))
    own = np.maximum(sums.bodies / bodies.mass, sums.rotations / bodies.inertia)
    worst, damping = int(np.argmax(own)), model.law.damping
    alpha, dt = 0.0 if damping is None else damping.local, None if not model.in_real_time else state.next_dt
    return limit(own[worst], alpha, dt, bodies.name(worst), in_the_scene(bodies.xy[worst], origin))
