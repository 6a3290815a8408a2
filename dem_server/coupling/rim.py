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
from coupler_protocol.compiled.system_calls import hypot
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
            contacts, where = ring_contacts(model, state), (self._three, self._translation)
            self._sums = mass_rule(contacts, state.x[: self.discs], self.nodes, *where, *self.where[:3])
        return self._sums

    def contacts_changed(self):
        """Marks the sums as out of date, after bonds were added or the step has changed."""
        self._builds = -1

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
        second = self.ring.node == (self.ring.seg0 + 1) % len(
            self.nodes
        )  # the first node of an open rim has no segment before it
        return np.where(second[:, None], [0.0, 1.0, 0.0], between)


@jit
def mass_rule(contacts, x, nodes, three, translation, seg0, seg1, w0):
    """Sums (K,) of Eq (1); a disc depends on three nodes: the ends of its segment and, if it is on a node, of the next.

    x (R,2) [m]: control discs; three, translation (R,3): these nodes, and their shares N in the translation.
    """
    K = len(nodes)
    A, L, size, b = np.zeros((K, 3)), np.empty((3, 2)), np.empty(3), np.empty((3, 2))
    for spring in range(3):
        of_spring = np.zeros((K, 3))
        for m in range(len(contacts.disc)):
            c, nx, ny = contacts.disc[m], contacts.normal[m, 0], contacts.normal[m, 1]
            spins(nodes, seg0[c], seg1[c], w0[c], L)
            at_x = at_y = 0.0
            for j in range(3):
                at_x += translation[c, j] * nodes[three[c, j], 0]
                at_y += translation[c, j] * nodes[three[c, j], 1]
            ex, ey = x[c, 0] - at_x, x[c, 1] - at_y
            if spring == 0:
                k, along_x, along_y, arm = contacts.kn[m], nx, ny, ny * ex - nx * ey
            elif spring == 1:
                k, along_x, along_y, arm = contacts.ks[m], -ny, nx, nx * ex + ny * ey + contacts.lever[m]
            else:
                k, along_x, along_y, arm = contacts.kr[m], 0.0, 0.0, 1.0
            for j in range(3):
                b[j, 0] = translation[c, j] * along_x + L[j, 0] * arm
                b[j, 1] = translation[c, j] * along_y + L[j, 1] * arm
                size[j] = hypot(b[j, 0], b[j, 1])
            w = k * (size[0] + size[1] + size[2])
            for j in range(3):
                if size[j] > 0.0:
                    node, weight = three[c, j], w / size[j]
                    of_spring[node, 0] += weight * (b[j, 0] * b[j, 0])
                    of_spring[node, 1] += weight * (b[j, 1] * b[j, 1])
                    of_spring[node, 2] += weight * (b[j, 0] * b[j, 1])
        A += of_spring
    sums = np.empty(K)
    for node in range(K):
        xx, yy, xy = A[node, 0], A[node, 1], A[node, 2]
        sums[node] = 0.5 * (xx + yy) + hypot(0.5 * (xx - yy), xy)
    return sums


@jit
def spins(nodes, seg0, seg1, w0, L):
    """Sets L (3, 2) [1/m]: spin of a disc for unit velocities of the three nodes on which it depends."""
    x0, y0 = turn(nodes, seg0)
    x1, y1 = turn(nodes, seg1)
    x0, y0, x1, y1 = w0 * x0, w0 * y0, (1.0 - w0) * x1, (1.0 - w0) * y1
    L[0, 0], L[0, 1] = -x0, -y0
    L[1, 0], L[1, 1] = x0 - x1, y0 - y1
    L[2, 0], L[2, 1] = x1, y1


@jit(forceinline=True)
def turn(nodes, a):
    """Normal of segment a over its length, n / l [1/m]."""
    b = a + 1 if a + 1 < len(nodes) else 0
    vx, vy = nodes[b, 0] - nodes[a, 0], nodes[b, 1] - nodes[a, 1]
    square = vx * vx + vy * vy
    return -vy / square, vx / square


def _gathered(values, index, K):
    """Sums (K,) of values (R,2) over the nodes index (R,2)."""
    return np.bincount(index.ravel(), weights=values.ravel(), minlength=K)
