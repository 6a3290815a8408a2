"""Windows seen from the grid: rims, what their discs say, and the gradual change from zones to discs.

While a window is handed over, the rim carries

    applied = (1 - s) R + s (P - g m_inner)                    s from 0 to 1 over the steps of the handover

with R the reaction of the removed zones (stress and weight), P the nodal forces of the discs and m_inner the mass of the control
discs' inner shares, whose weight belongs to the nodes. In static mode the nodes get the additional mass of the mass rule
(dem_server/coupling/rim.py), in real time m_inner: without it a wave that should pass is reflected in part.
"""

import numpy as np

from coupler_protocol.compiled.jit import jit
from coupler_protocol.wire import messages
from fdm_server.coupling.window_talk import WindowTalk
from fdm_server.ground.removed_zones import cut_window
from fdm_server.mesh.window_zones import rim_of, window_zones
from fdm_server.step.present_shape import present


@jit
def _carry(nodes, force, added, share, gravity, inner_mass, reaction, reaction_mass, applied, added_mass):
    """The equation above for the K gridpoints of a rim; force (K,2): P [N]; added (K,): mass each is to get [kg]."""
    K = nodes.shape[0]
    for i in range(K):
        n = nodes[i]
        mass = share * inner_mass[i] + (1.0 - share) * reaction_mass[i]
        applied[n, 0] = share * force[i, 0] + (1.0 - share) * reaction[i, 0]
        applied[n, 1] = share * force[i, 1] + (1.0 - share) * reaction[i, 1] - gravity * mass
        added_mass[n] = added[i]


class Rim:
    """Rim of one window: gridpoints `nodes` (K,) counter-clockwise, what its discs do to it, and the talk with them."""

    def __init__(self, grid, window, conversation):
        self.window = window
        self.mask = window_zones(grid, window)
        self.nodes = rim_of(grid, self.mask)
        self.xy = grid.xy[self.nodes]  # as drawn [m]
        self.talk = WindowTalk(conversation, window.name, self.xy)
        K = len(self.nodes)
        self.force = np.zeros((K, 2))  # P [N], of the discs
        self.reaction = np.zeros((K, 2))  # R without weight [N]
        self.reaction_mass = np.zeros(K)  # [kg]
        self.inner_mass = np.zeros(K)  # [kg]
        self.sums = np.zeros(K)  # [N/m] of the mass rule
        self.answer = messages.Answer(*[0.0] * len(messages.Answer._fields))
        self.path = np.zeros((K, 2))  # [m] sum of the velocities since the last exchange
        self.before = np.zeros((K, 2))  # [m/step] velocities that were said last
        self.report = {}

    def hear_ready(self):
        """What the discs became, and the mass of the ring's inner shares."""
        self.inner_mass, self.report = self.talk.hear_ready()

    # -- every step --------------------------------------------------------------------------------------------------

    def hear_forces(self):
        """Forces of the discs, and how they fare."""
        heard = self.talk.hear_forces()
        self.answer, self.sums = heard.answer, heard.sums
        self.force[:] = heard.force

    def carry(self, state, gravity, share):
        """Applied forces and added masses of the rim's gridpoints from the last FORCE; `share` is s above."""
        added = self.sums if state.dt is None else self.inner_mass
        _carry(
            self.nodes, self.force, added, share, gravity, self.inner_mass, self.reaction, self.reaction_mass,
            state.applied, state.added_mass,
        )  # fmt: skip

    def note_velocities(self, state, first):
        """Add the step's velocities to the path since the last exchange; `first`: it begins here."""
        if first:
            self.path[:] = state.velocity[self.nodes]
        else:
            self.path += state.velocity[self.nodes]

    def speed(self, velocity):
        """Largest of the speeds of its gridpoints [m/step], and the place of that gridpoint in the rim."""
        v = velocity[self.nodes]
        squares = np.einsum("ij,ij->i", v, v)
        fastest = int(squares.argmax())
        return float(np.sqrt(squares[fastest])), fastest

    def say_velocities(self, order):
        """Means of the velocities in the steps since the last exchange, and what to do after the last of them."""
        np.divide(self.path, order.interval, out=self.before)
        self.talk.say_velocities(self.before, order)


def open_windows(model, state, rims):
    """Cut the holes of all windows; each rim keeps the reactions of its zones. Returns the new model and state."""
    for rim in rims:
        model, state, reaction = cut_window(model, state, rim.mask)
        rim.reaction = reaction.force[rim.nodes]
        rim.reaction_mass = reaction.mass[rim.nodes]
    return model, state


def traction_difference(model, state, rim, stress):
    """How well the discs' forces fit the stress of the zones next to the rim.

    At every rim gridpoint the traction P / l (l: half of both segments) stands beside sigma n of the adjoining zones
    (`stress` (A,4), area mean of the zones that share an edge with the rim there). Returns rms(difference) / rms(sigma n).
    """
    xy, K = present(model, state)[rim.nodes], len(rim.nodes)
    vector = np.roll(xy, -1, axis=0) - xy
    half = 0.5 * (np.linalg.norm(vector, axis=1) + np.linalg.norm(np.roll(vector, 1, axis=0), axis=1))
    normal = np.column_stack([-vector[:, 1], vector[:, 0]])  # times length, into the window: out of the grid
    zone = zones_behind(model, rim)
    s = stress[zone]
    push = np.column_stack([s[:, 0] * normal[:, 0] + s[:, 3] * normal[:, 1], s[:, 3] * normal[:, 0] + s[:, 1] * normal[:, 1]])
    expected = 0.5 * (push + np.roll(push, 1, axis=0)) / half[:, None]
    found = rim.force / half[:, None]
    size = np.sqrt(np.mean(np.sum(expected**2, axis=1)))
    return float(np.sqrt(np.mean(np.sum((found - expected) ** 2, axis=1))) / size) if K and size > 0 else 0.0


def zones_behind(model, rim):
    """Active zone on the outer side of every segment (K,)."""
    edges = {}
    for place, zone in enumerate(model.zones):
        corners = list(dict.fromkeys(zone.tolist()))
        for a, b in zip(corners, corners[1:] + corners[:1], strict=True):
            edges[(a, b)] = place
    following = np.roll(rim.nodes, -1)
    return np.array([edges[(b, a)] for a, b in zip(rim.nodes.tolist(), following.tolist(), strict=True)])
