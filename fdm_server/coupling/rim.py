"""Windows seen from the grid: rims, what their discs say, and the gradual change from zones to discs.

While a window is handed over, the rim carries

    applied = (1 - s) R + s (P - g m_inner)                    s from 0 to 1 over the steps of the handover

with R the reaction of the removed zones (stress and weight), P the nodal forces of the discs and m_inner the mass of the control
discs' inner shares, whose weight belongs to the nodes. In static mode the nodes get the additional mass of the mass rule
(dem_server/coupling/rim.py), in real time m_inner: without it a wave that should pass is reflected in part.
"""

import logging
from math import isfinite

import numpy as np

from coupler_protocol.compiled.jit import jit
from coupler_protocol.criteria.strain_bins import from_rows, shape_over
from coupler_protocol.exits import PeerLost, PhysicsFailed
from coupler_protocol.wire import messages
from coupler_protocol.wire.frames import StepFrame, WireError, content_of, pack_array, unpack_array
from fdm_server.ground.removed_zones import cut_window
from fdm_server.mesh.window_zones import rim_of, window_zones

log = logging.getLogger(__name__)


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
    """Rim of one window: gridpoints `nodes` (K,) counter-clockwise, and the conversation with the process inside it."""

    def __init__(self, grid, window, conversation):
        self.window, self.conversation = window, conversation
        self.mask = window_zones(grid, window)
        self.nodes = rim_of(grid, self.mask)
        self.xy = grid.xy[self.nodes]  # as drawn [m]
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
        self.strain_asked = False  # whether the next FORCE carries the window's strain

    def prepare(self, bin_length=None):
        """Buffers of the step messages; their sizes are known once the handshake is done. bin_length [m]: if strain is wanted."""
        talk, K = self.conversation, len(self.nodes)
        self.force_frame = StepFrame(messages.FORCE, talk.session, talk.rank, len(messages.Answer._fields), 3 * K)
        if bin_length is not None:
            columns, rows = shape_over(self.xy, bin_length)
            size = 3 * (K + columns * rows)
            self.strain_frame = StepFrame(messages.FORCE, talk.session, talk.rank, len(messages.Answer._fields), size)
        self.velocity_frame = StepFrame(messages.VELOCITY, talk.session, talk.rank, len(messages.Order._fields), 2 * K)

    # -- the window's beginning --------------------------------------------------------------------------------------

    def hear_packed(self):
        """Wait for PACKED."""
        self._hear_control(messages.PACKED)

    def say_field(self, field, gravity, insitu):
        """FIELD: stress and density (n,7) of the zones that become the hole; then wait for READY."""
        self._answer(messages.FIELD, {"field": pack_array(field), "gravity": gravity, "insitu": insitu})

    def hear_ready(self):
        """Wait for READY: what the discs became, and the mass of the ring's inner shares."""
        content = self._hear_control(messages.READY)
        self.inner_mass = unpack_array(content["inner_mass"], rows=len(self.nodes))
        self.report = content["report"]

    def say_go(self, gravity, step, time, stage, bin_length=None):
        """GO: the discs' first step comes next. time [s]; bin_length [m]: of bins in which a stage will want their strain."""
        self.prepare(bin_length)
        wanted = {} if bin_length is None else {"bin": bin_length}
        self._answer(messages.GO, {"gravity": gravity, "step": step, "time": time, "stage": stage} | wanted)

    def _hear_control(self, kind):
        return content_of(self.conversation.hear((kind,))[1])

    def _answer(self, kind, content):
        self.conversation.say_control(kind, content)
        self.conversation.sequence += 1

    # -- every step --------------------------------------------------------------------------------------------------

    def hear_forces(self):
        """FORCE: forces of the discs, and how they fare."""
        _, frame = self.conversation.hear((messages.FORCE,), in_step=True)
        expected = self.strain_frame if self.strain_asked else self.force_frame
        try:
            expected.accept(frame)
        except WireError as error:
            raise PeerLost(f"the discs of {self.window.name!r} sent what cannot be used: {error}") from None
        self.answer = messages.Answer(*expected.scalars.tolist())
        K = len(self.nodes)
        self.force[:] = expected.values[: 2 * K].reshape(-1, 2)
        self.sums = expected.values[2 * K : 3 * K]

    def carry(self, state, gravity, share):
        """Applied forces and added masses of the rim's gridpoints from the last FORCE; `share` is s above."""
        added = self.inner_mass if state.in_real_time else self.sums
        _carry(
            self.nodes, self.force, added, share, gravity, self.inner_mass, self.reaction, self.reaction_mass,
            state.applied, state.added_mass,
        )  # fmt: skip

    def strain(self):
        """Middles (b,2) [m] and shear strains (b,) of the window's bins, as the last FORCE that was asked for them said."""
        return from_rows(self.strain_frame.values[3 * len(self.nodes) :].reshape(-1, 3))

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
        """VELOCITY: the rim's velocities, means of the steps since the last exchange, and what to do after the last of them."""
        self.strain_asked = bool(int(order.flags) & messages.STRAIN)
        self.velocity_frame.scalars[:] = order
        np.divide(self.path, order.interval, out=self.before)
        self.velocity_frame.values[:] = self.before.ravel()
        if not isfinite(self.velocity_frame.values.sum()):
            raise PhysicsFailed(f"the rim of {self.window.name!r} has velocities that are no numbers in step {order.step:.0f}")
        self.conversation.say(self.velocity_frame.seal(self.conversation.sequence))
        self.conversation.sequence += 1

    # -- the end -----------------------------------------------------------------------------------------------------

    def say_stop(self, reason):
        """Wait for the forces that are on their way, say STOP, and return the discs' FAREWELL."""
        self.conversation.hear((messages.FORCE,), in_step=True)
        self._answer(messages.STOP, {"reason": reason})
        try:
            return self._hear_control(messages.FAREWELL)
        except PeerLost as error:  # everything is computed and recorded: only the discs' timings are missing
            log.warning("no farewell of rank %d: %s", self.conversation.rank, error)
            return {}


def open_windows(model, state, rims):
    """Cut the holes of all windows; each rim keeps the reactions of its zones. Returns the new model and state."""
    for rim in rims:
        model, state, reaction = cut_window(model, state, rim.mask)
        rim.reaction = reaction.force[rim.nodes]
        rim.reaction_mass = reaction.mass[rim.nodes]
    return model, state
