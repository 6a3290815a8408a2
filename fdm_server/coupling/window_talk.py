"""What the continuum says to the discs of one window and hears from them (coupler_protocol.wire.messages has the order)."""

import logging
from math import isfinite

from coupler_protocol.criteria.strain_bins import from_rows, shape_over
from coupler_protocol.exits import PeerLost, PhysicsFailed
from coupler_protocol.wire import messages
from coupler_protocol.wire.frames import WireError, content_of
from coupler_protocol.wire.payloads import ForceFrame, VelocityFrame, field_content, inner_mass_of

log = logging.getLogger(__name__)


class WindowTalk:
    """The conversation with the process inside a window. name: the window's; outline (K,2) [m]: its rim as drawn."""

    def __init__(self, conversation, name, outline):
        self.conversation, self.name, self.outline = conversation, name, outline
        self.strain_asked = False  # whether the next FORCE carries the window's strain
        self.force_frame = self.strain_frame = self.velocity_frame = None

    @property
    def rank(self):
        """Rank of the process inside the window."""
        return self.conversation.rank

    # -- the window's beginning --------------------------------------------------------------------------------------

    def receive_packed(self):
        """Wait for PACKED."""
        self._receive_control(messages.PACKED)

    def send_field(self, rows, gravity, insitu):
        """FIELD: stress and density (n,7) of the zones that become the hole; then wait for READY."""
        self.conversation.send_control(messages.FIELD, field_content(rows, gravity, insitu))

    def receive_ready(self):
        """Wait for READY; returns the mass (K,) [kg] of the ring's inner shares and what the discs report."""
        content = self._receive_control(messages.READY)
        return inner_mass_of(content, len(self.outline)), content["report"]

    def send_go(self, gravity, step, time, stage, bin_length=None):
        """GO: the discs' first step comes next. time [s]; bin_length [m]: of bins in which a stage will want their strain."""
        self._prepare(bin_length)
        wanted = {} if bin_length is None else {"bin": bin_length}
        self.conversation.send_control(messages.GO, {"gravity": gravity, "step": step, "time": time, "stage": stage} | wanted)

    def _prepare(self, bin_length):
        """Buffers of the step messages; the session that stands in them is known once the handshake is done."""
        talk, K = self.conversation, len(self.outline)
        self.force_frame, self.velocity_frame = ForceFrame(talk, K), VelocityFrame(talk, K)
        if bin_length is not None:
            columns, rows = shape_over(self.outline, bin_length)
            self.strain_frame = ForceFrame(talk, K, columns * rows)

    # -- every step --------------------------------------------------------------------------------------------------

    def receive_forces(self):
        """FORCE, as the frame that holds it until the next one."""
        _, frame = self.conversation.receive((messages.FORCE,), in_step=True)
        expected = self.strain_frame if self.strain_asked else self.force_frame
        try:
            expected.accept(frame)
        except WireError as error:
            raise PeerLost(f"the discs of {self.name!r} sent what cannot be used: {error}") from None
        return expected

    def strain(self):
        """Middles (b,2) [m] and shear strains (b,) of the window's bins, as the last FORCE that was asked for them said."""
        return from_rows(self.strain_frame.strain)

    def send_velocities(self, velocity, order):
        """VELOCITY: mean velocities (K,2) of the steps since the last exchange, and what to do after the last of them."""
        self.strain_asked = bool(int(order.flags) & messages.STRAIN)
        frame = self.velocity_frame
        frame.scalars[:] = order
        frame.velocity[:] = velocity
        if not isfinite(frame.values.sum()):
            raise PhysicsFailed(f"velocities on the rim of {self.name!r} are NaN or infinite in step {order.step:.0f}")
        self.conversation.send_step(frame)

    # -- the end -----------------------------------------------------------------------------------------------------

    def send_stop(self, reason):
        """Wait for the forces that are on their way, say STOP, and return the discs' FAREWELL."""
        self.conversation.receive((messages.FORCE,), in_step=True)
        self.conversation.send_control(messages.STOP, {"reason": reason})
        try:
            return self._receive_control(messages.FAREWELL)
        except PeerLost as error:  # everything is computed and recorded: only the discs' timings are missing
            log.warning("no farewell of rank %d: %s", self.rank, error)
            return {}

    def _receive_control(self, kind):
        return content_of(self.conversation.receive((kind,))[1])
