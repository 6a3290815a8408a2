"""Motion of the ring, and its forces and masses on the nodes of the rim.

Mass rule of the interface. The mass of a rim node does not include the contact springs attached to it, so each node gets
additional mass (dt = 1)

    M_I += largest eigenvalue of sum_c k_c w_c b_cI b_cI^T / |b_cI|,    w_c = sum_J |b_cJ|           (1)

over the springs of the ring's contacts: b_cI . u_I is the displacement of the control disc's end of spring c by u_I of node I,

    normal spring     b = N n + L (n . k x e)          N: share of node I in the disc's translation,
    shear spring      b = N t + L (t . k x e + l)      L . u_I: its part of the spin, e, l: offset from the segment, lever
    turning spring    b = L                            of the contact on the disc

(rolling resistance, bending of parallel bonds). A node takes half of each spring, the disc on the other end the other half,
as between two discs. Then omega^2 <= 2 for these springs and masses, which leaves the factor 1 + alpha < 2 that damping needs
(coupler_protocol/criteria/stable_step.py, Eq (2); `tests/physics/test_interface_limit.py`). In real time no mass is added: the
same sums times dt^2 limit the step (fdm_server/coupling/common_step.py), and the nodes have the mass of the control discs' inner
shares.
"""

from functools import cached_property
from typing import NamedTuple

import numpy as np

from coupler_protocol.compiled.jit import jit
from coupler_protocol.geometry import segment_vectors
from coupler_protocol.interface.mapping import forces_to_nodes, velocities_to_discs
from coupler_protocol.interface.ring import node_shares
from dem_server.coupling.ring_springs import ring_contacts
from dem_server.model import MOMENT
from dem_server.observe.energy import ring_power


@jit
def move_ring(nodes, velocity, seg0, seg1, w0, node, x, v, spin, paper, dt):
    """Moves the nodes and their control discs by one step."""
    velocities_to_discs(nodes, velocity, seg0, seg1, w0, node, x, v, spin, paper)
    for p in range(x.shape[0]):
        x[p, 0] += v[p, 0] * dt
        x[p, 1] += v[p, 1] * dt
    for i in range(nodes.shape[0]):
        nodes[i, 0] += velocity[i, 0] * dt
        nodes[i, 1] += velocity[i, 1] * dt


class RimState(NamedTuple):
    """State of a rim of K nodes."""

    nodes: np.ndarray  # (K,2) [m] present positions
    sums: np.ndarray  # (K,) [N/m] of the mass rule: additional masses [kg] at dt = 1
    builds: int  # number of contact lists built when the sums were computed


class Rim:
    """Ring of one window. nodes (K,2): present positions of its nodes [m]; the ring's discs are the first R of the state."""

    def __init__(self, ring, mapping, state=None):
        self.ring = ring
        self.nodes, self._sums, self._builds = state or (ring.nodes.copy(), np.zeros(len(ring.nodes)), -1)
        self.force = np.zeros_like(self.nodes)
        self.carried = np.zeros((len(ring.radius), 3))  # forces [N] and moments [N m] on control discs, as last mapped
        self.paper = mapping == "paper"
        self.where = (ring.seg0, ring.seg1, ring.w0, ring.node)

    def saved(self):
        """RimState for a checkpoint."""
        return RimState(self.nodes, self._sums, self._builds)

    @property
    def discs(self):
        """Number of control discs R."""
        return len(self.ring.radius)

    def move(self, state, velocity):
        """Moves the control discs with the nodes' velocities (K,2) [m/step or m/s] over the step State.dt."""
        R = self.discs
        move_ring(self.nodes, velocity, *self.where, state.x[:R], state.v[:R], state.spin[:R], self.paper, state.dt)

    def nodal_forces(self, state):
        """Forces (K,2) [N] on the nodes, mapped from the contact forces on the ring; the array is reused."""
        R = self.discs
        where = self.where
        forces_to_nodes(self.nodes, *where, state.x[:R], state.force[:R], state.moment[:R], self.force, self.paper)
        self.carried[:] = state.load[:R, : MOMENT + 1]
        return self.force

    def power(self, state):
        """Power [W] of the contact forces of the last `nodal_forces` in the present velocities of the control discs."""
        return ring_power(self.carried, state.disc)

    def inner_mass(self, state):
        """Mass (K,) [kg/m] at the nodes of the control discs' inner shares: weight of the grid, in real time also its inertia."""
        share, index = node_shares(self.ring)
        return _gathered(share * state.weight[: self.discs, None], index, len(self.nodes))

    def stiffness_sums(self, model, state):
        """Sums (K,) [N/m] of the mass rule above; recomputed when the contact list has changed."""
        if state.builds != self._builds:
            self._builds = state.builds
            self._sums = self._mass_rule(state, ring_contacts(model, state))
        return self._sums

    def contacts_changed(self):
        """Marks the sums as out of date, after bonds were added or the step has changed."""
        self._builds = -1

    def _mass_rule(self, state, contacts):
        """Sums (K,) of Eq (1); a disc depends on three nodes: the ends of its segment and, if it is on a node, of the next."""
        K, c = len(self.nodes), contacts.disc
        node, N, L = self._three, self._translation, self._spin()
        offset = state.x[: self.discs] - np.einsum("pj,pjx->px", N, self.nodes[node])
        n = contacts.normal
        t = np.column_stack([-n[:, 1], n[:, 0]])
        along_n, along_t = (np.einsum("mx,mx->m", -t if axis is n else n, offset[c]) for axis in (n, t))
        N, L = N[c], L[c]
        springs = [
            (contacts.kn, N[:, :, None] * n[:, None] + L * along_n[:, None, None]),
            (contacts.ks, N[:, :, None] * t[:, None] + L * (along_t + contacts.lever)[:, None, None]),
            (contacts.kr, L),
        ]
        A = np.zeros((K, 3))
        for k, b in springs:
            size = np.hypot(b[..., 0], b[..., 1])
            weight = np.divide((k * size.sum(axis=1))[:, None], size, out=np.zeros_like(size), where=size > 0.0)
            for column, product in enumerate((b[..., 0] ** 2, b[..., 1] ** 2, b[..., 0] * b[..., 1])):
                A[:, column] += np.bincount(node[c].ravel(), (weight * product).ravel(), minlength=K)
        xx, yy, xy = A.T
        return 0.5 * (xx + yy) + np.hypot(0.5 * (xx - yy), xy)

    @cached_property
    def _three(self):
        """The three nodes (R, 3) on which each disc depends."""
        ring, K = self.ring, len(self.nodes)
        return np.stack([ring.seg0, (ring.seg0 + 1) % K, (ring.seg1 + 1) % K], axis=1)

    @cached_property
    def _translation(self):
        """Shares N (R, 3) of these nodes in the translation of the discs."""
        share, _ = node_shares(self.ring)
        between = np.column_stack([share, np.zeros(self.discs)])
        return np.where(self.ring.node[:, None] >= 0, [0.0, 1.0, 0.0], between)

    def _spin(self):
        """L (R, 3, 2) [1/m]: spin of the discs for unit velocities of the same nodes."""
        ring, vector = self.ring, segment_vectors(self.nodes)
        over = np.column_stack([-vector[:, 1], vector[:, 0]]) / np.einsum("kx,kx->k", vector, vector)[:, None]  # n / l
        before, after = ring.w0[:, None] * over[ring.seg0], (1.0 - ring.w0)[:, None] * over[ring.seg1]
        return np.stack([-before, before - after, after], axis=1)


def _gathered(values, index, K):
    """Sums (K,) of values (R,2) over the nodes index (R,2)."""
    return np.bincount(index.ravel(), weights=values.ravel(), minlength=K)
