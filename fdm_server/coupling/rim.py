"""Rims of windows on the side of the grid: forces of the discs, and the hand-over from zones to discs.

During the hand-over of a window, the forces on its rim are

    applied = (1 - s) R + s (P - g m_inner)                    s from 0 to 1 over the steps of the handover

with R the reaction of the removed zones (stress and weight), P the nodal forces of the discs and m_inner the mass of the control
discs' inner shares, whose weight belongs to the nodes. In static mode the nodes get the additional mass of the mass rule
(dem_server/coupling/rim.py), in real time m_inner: without it a wave that should pass is partly reflected.
"""

import numpy as np

from coupler_protocol.compiled.jit import jit
from coupler_protocol.files.kept import Kept
from coupler_protocol.wire import messages
from fdm_server.coupling.window_talk import WindowTalk
from fdm_server.ground.removed_zones import cut_window
from fdm_server.mesh.window_zones import window_rim, window_zones


@jit
def apply_forces(nodes, force, added, share, gravity, inner_mass, reaction, reaction_mass, applied, added_mass):
    """Sets applied forces by the equation above, and added masses, of the K gridpoints of a rim.

    force (K,2): P [N]; added (K,): mass that each gridpoint gets [kg].
    """
    K = nodes.shape[0]
    for i in range(K):
        n = nodes[i]
        mass = share * inner_mass[i] + (1.0 - share) * reaction_mass[i]
        applied[n, 0] = share * force[i, 0] + (1.0 - share) * reaction[i, 0]
        applied[n, 1] = share * force[i, 1] + (1.0 - share) * reaction[i, 1] - gravity * mass
        added_mass[n] = added[i]


class Rim(Kept):
    """Rim of one window: gridpoints `nodes` (K,) counter-clockwise, the action of its discs, and the messages with them."""

    KEPT = ("force", "sums", "answer", "path", "before")  # and R with its mass, which stay for all later stages

    def __init__(self, grid, window, conversation):
        self.window = window
        self.mask = window_zones(grid, window)
        self.nodes, surface = window_rim(grid, self.mask)
        self.xy = grid.xy[self.nodes]  # as drawn [m]
        self.surface = None if surface is None else grid.xy[surface]  # of an open rim, as drawn [m]
        self.talk = WindowTalk(conversation, window.name, self.xy, grid.origin)
        K = len(self.nodes)
        self.force = np.zeros((K, 2))  # P [N], of the discs
        self.reaction = np.zeros((K, 2))  # R without weight [N]
        self.reaction_mass = np.zeros(K)  # [kg]
        self.inner_mass = np.zeros(K)  # [kg]
        self.sums = np.zeros(K)  # [N/m] of the mass rule
        self.answer = messages.Answer(*[0.0] * len(messages.Answer._fields))
        self.path = np.zeros((K, 2))  # [m] sum of the velocities since the last exchange
        self.before = np.zeros((K, 2))  # [m/step] velocities that were sent last
        self.report = {}
        self.heard = False  # whether FORCE of this turn was received already

    def saved(self):
        """What changes in a stage, for a checkpoint inside of it."""
        return super().saved() | {"strain_asked": self.talk.strain_asked}

    def restore(self, saved):
        """Sets what `saved` gave."""
        super().restore(saved)
        self.talk.strain_asked = saved["strain_asked"]

    def receive_ready(self, meanwhile=None):
        """Receives READY: the report of the discs, and the mass of the ring's inner shares; meanwhile: work during the wait."""
        self.inner_mass, self.report = self.talk.receive_ready(meanwhile)

    # -- every step --------------------------------------------------------------------------------------------------

    def receive_forces(self):
        """Receives FORCE: forces and Answer of the discs."""
        if self.heard:
            self.heard = False
            return
        heard = self.talk.receive_forces()
        self.answer, self.sums = heard.answer, heard.sums
        self.force[:] = heard.force

    def apply_forces(self, state, gravity, share):
        """Sets applied forces and added masses of the rim's gridpoints from the last FORCE; `share` is s above."""
        added = self.inner_mass if state.in_real_time else self.sums
        apply_forces(
            self.nodes, self.force, added, share, gravity, self.inner_mass, self.reaction, self.reaction_mass,
            state.applied, state.added_mass,
        )  # fmt: skip

    def note_velocities(self, state, first):
        """Adds the velocities of a step to the path since the last exchange; `first`: the path begins with this step."""
        if first:
            self.path[:] = state.velocity[self.nodes]
        else:
            self.path += state.velocity[self.nodes]

    def speed(self, velocity):
        """Largest speed of the rim's gridpoints [m/step], and the position of that gridpoint in `nodes`."""
        v = velocity[self.nodes]
        squares = np.einsum("ij,ij->i", v, v)
        fastest = int(squares.argmax())
        return float(np.sqrt(squares[fastest])), fastest

    def send_velocities(self, order):
        """Sends VELOCITY: mean velocities of the steps since the last exchange, and the Order for the last of them."""
        np.divide(self.path, order.interval, out=self.before)
        self.talk.send_velocities(self.before, order)


def open_windows(model, state, rims):
    """Cuts the holes of all windows and stores the reactions of their zones in the rims. Returns the new model and state."""
    for rim in rims:
        model, state, reaction = cut_window(model, state, rim.mask)
        rim.reaction = reaction.force[rim.nodes]
        rim.reaction_mass = reaction.mass[rim.nodes]
    return model, state
