"""The ring's motion and what goes back to the grid: the only place where discs and the rim's nodes meet.

Mass rule of the interface. A rim node knows nothing of the contact springs hung on it, so each is given
additional mass (dt = 1)

    M_I += 1/4 sum_c k_c a_I (2 + sum_J a_J),    a_I = sqrt(N_I^2 + (L_I r)^2),

over the contacts c of the ring (k_c: the larger of both stiffnesses), where N_I is the share of a control
disc's translation that node I gives, L_I that of its spin, r its radius, and 2 stands for translation and
rotation of the disc on the other end. In real time no mass is added: the same sums times dt^2 bound the step
(fdm_server/agreement.py), and the nodes carry the mass of the control discs' inner shares.
"""

from typing import NamedTuple

import numpy as np

from coupler_protocol.interface import node_shares, segment_vectors
from coupler_protocol.jit import jit
from coupler_protocol.mapping import forces_to_nodes, velocities_to_discs
from dem_server.boundary import ring_contacts


@jit
def _move_ring(nodes, velocity, seg0, seg1, w0, node, x, v, spin, paper, dt):
    """One step of the control discs and of the nodes that carry them."""
    velocities_to_discs(nodes, velocity, seg0, seg1, w0, node, x, v, spin, paper)
    for p in range(x.shape[0]):
        x[p, 0] += v[p, 0] * dt
        x[p, 1] += v[p, 1] * dt
    for i in range(nodes.shape[0]):
        nodes[i, 0] += velocity[i, 0] * dt
        nodes[i, 1] += velocity[i, 1] * dt


class RimState(NamedTuple):
    """What changes on a rim of K nodes."""

    nodes: np.ndarray  # (K,2) [m] present positions
    sums: np.ndarray  # (K,) [N/m] of the mass rule: additional masses [kg] at dt = 1
    builds: int  # lists built when the sums were


class Rim:
    """Ring of one window. nodes (K,2): present positions of its nodes [m]; the ring's discs are the first R of the state."""

    def __init__(self, ring, mapping, state=None):
        self.ring = ring
        self.nodes, self._sums, self._builds = state or (ring.nodes.copy(), np.zeros(len(ring.nodes)), -1)
        self.force = np.zeros_like(self.nodes)
        self.paper = mapping == "paper"
        self._where = (ring.seg0, ring.seg1, ring.w0, ring.node)

    def saved(self):
        """What of it belongs into a checkpoint."""
        return RimState(self.nodes, self._sums, self._builds)

    @property
    def discs(self):
        """Number of control discs R."""
        return len(self.ring.radius)

    def move(self, state, velocity):
        """Move the control discs with the nodes' velocities (K,2) [m/step or m/s] over the step State.dt."""
        R = self.discs
        _move_ring(self.nodes, velocity, *self._where, state.x[:R], state.v[:R], state.spin[:R], self.paper, state.dt)

    def nodal_forces(self, state):
        """Contact forces on the ring, carried to the nodes (K,2) [N]; the array is used again."""
        R = self.discs
        where = self._where
        forces_to_nodes(self.nodes, *where, state.x[:R], state.force[:R], state.moment[:R], self.force, self.paper)
        return self.force

    def power(self, state):
        """Power [W] (dt = 1: work of the last step [J]) of the contact forces on the ring as the discs see it."""
        R = self.discs
        return float(np.sum(state.force[:R] * state.v[:R]) + np.dot(state.moment[:R], state.spin[:R]))

    def inner_mass(self, state):
        """Mass (K,) [kg/m] of the control discs' inner shares, at the nodes: weight, in real time inertia, of the grid."""
        share, index = node_shares(self.ring)
        return _gathered(share * state.weight[: self.discs, None], index, len(self.nodes))

    def stiffness_sums(self, model, state):
        """Sums (K,) [N/m] of the mass rule above; computed anew when the contact list has changed."""
        if state.builds != self._builds:
            self._builds = state.builds
            self._sums = self._mass_rule(*ring_contacts(model, state))
        return self._sums

    def contacts_changed(self):
        """Forget the sums: bonds were added, or the step is another one."""
        self._builds = -1

    def _mass_rule(self, disc, stiffness):
        ring, K = self.ring, len(self.nodes)
        length = np.linalg.norm(segment_vectors(self.nodes), axis=1)
        share, pair = node_shares(ring)
        # Nodes a disc depends on: ends of the segment before (or the only one) and of the segment after.
        index = np.concatenate([pair, np.stack([ring.seg0, ring.seg0 + 1, ring.seg1, ring.seg1 + 1], axis=1) % K], axis=1)
        spin = ring.radius / length[ring.seg0] * ring.w0, ring.radius / length[ring.seg1] * (1.0 - ring.w0)
        lever = np.stack([0 * spin[0], 0 * spin[0], spin[0], spin[0], spin[1], spin[1]], axis=1)
        translation = np.concatenate([share, np.zeros_like(index[:, 2:], dtype=float)], axis=1)
        # One row a disc, one column a node: shares of translation and of spin, summed where a node appears twice.
        R = self.discs
        rows = np.arange(R)[:, None]
        N, L = np.zeros((R, K)), np.zeros((R, K))
        np.add.at(N, (rows, index), translation)
        np.add.at(L, (rows, index), lever)
        a = np.hypot(N, L)
        k = np.bincount(disc, weights=stiffness, minlength=R)
        return 0.25 * (k * (2.0 + a.sum(axis=1))) @ a


def _gathered(values, index, K):
    """Sums (K,) of values (R,2) over the nodes index (R,2)."""
    return np.bincount(index.ravel(), weights=values.ravel(), minlength=K)
