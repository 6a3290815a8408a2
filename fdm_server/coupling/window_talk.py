"""Messages between the continuum and the discs of one window (coupler_protocol.wire.messages has their order)."""

import logging
from math import isfinite

import numpy as np

from coupler_protocol.criteria.strain_bins import from_rows, shape_over
from coupler_protocol.exits import PeerLost, PhysicsFailed
from coupler_protocol.geometry import NOWHERE, spot
from coupler_protocol.wire import messages
from coupler_protocol.wire.frames import WireError, content_of
from coupler_protocol.wire.payloads import ForceFrame, VelocityFrame, field_content, inner_mass_of

log = logging.getLogger(__name__)


class WindowTalk:
    """Conversation with the process of a window. name: of the window; outline (K,2) [m]: its rim as drawn.

    origin (2,) [m]: point of the scene from which the outline counts, for messages.
    """

    def __init__(self, conversation, name, outline, origin=NOWHERE):
        self.conversation, self.name, self.outline, self.origin = conversation, name, outline, origin
        self.strain_asked = False  # whether the next FORCE contains the window's strain
        self.force_frame = self.strain_frame = self.velocity_frame = None

    @property
    def rank(self):
        """Rank of the process of the window."""
        return self.conversation.rank

    # -- the window's beginning --------------------------------------------------------------------------------------

    def receive_packed(self, meanwhile=None):
        """Waits for PACKED; meanwhile: work for the time without a message, as for Conversation.receive."""
        self._receive_control(messages.PACKED, meanwhile)

    def send_field(self, rows, gravity, insitu):
        """Sends FIELD: stress and density (n,7) of the zones that become the hole."""
        self.conversation.send_control(messages.FIELD, field_content(rows, gravity, insitu))

    def receive_ready(self, meanwhile=None):
        """Waits for READY; returns the mass (K,) [kg] of the ring's inner shares and the report of the discs."""
        content = self._receive_control(messages.READY, meanwhile)
        return inner_mass_of(content, len(self.outline)), content["report"]

    def send_go(self, gravity, step, time, stage, bin_length=None):
        """Sends GO before the discs' first step. time [s]; bin_length [m]: of the bins for strain, None without `until.band`."""
        self._prepare(bin_length)
        wanted = {} if bin_length is None else {"bin": bin_length}
        self.conversation.send_control(messages.GO, {"gravity": gravity, "step": step, "time": time, "stage": stage} | wanted)

    def _prepare(self, bin_length):
        """Makes the buffers of the step messages, which contain the session that the handshake sets."""
        talk, K = self.conversation, len(self.outline)
        self.force_frame, self.velocity_frame = ForceFrame(talk, K), VelocityFrame(talk, K)
        if bin_length is not None:
            columns, rows = shape_over(self.outline, bin_length)
            self.strain_frame = ForceFrame(talk, K, columns * rows)

    # -- every step --------------------------------------------------------------------------------------------------

    def receive_forces(self):
        """Waits for FORCE; returns its ForceFrame, which is valid until the next one. Raises PeerLost."""
        _, frame = self.conversation.receive((messages.FORCE,))
        expected = self.strain_frame if self.strain_asked else self.force_frame
        try:
            expected.accept(frame)
        except WireError as error:
            raise PeerLost(f"the discs of {self.name!r} sent what cannot be used: {error}") from None
        return expected

    def strain(self):
        """Centres (b,2) [m] and shear strains (b,) of the window's bins, from the last FORCE with strain."""
        return from_rows(self.strain_frame.strain)

    def send_velocities(self, velocity, order):
        """Sends VELOCITY: mean velocities (K,2) of the steps since the last exchange, and the Order for the last of them.

        Raises PhysicsFailed for velocities that are NaN or infinite.
        """
        self.strain_asked = bool(int(order.flags) & messages.STRAIN)
        frame = self.velocity_frame
        frame.scalars[:] = order
        frame.velocity[:] = velocity
        self.refuse_infinite(frame.velocity, int(order.step))
        self.conversation.send_step(frame)

    def refuse_infinite(self, velocity, step):
        """Raises PhysicsFailed for velocities (K,2) that are NaN or infinite."""
        if not isfinite(velocity.sum()):
            wrong = self.outline[np.flatnonzero(~np.isfinite(velocity).all(axis=1))]
            where = f", the first at {spot(wrong[0], self.origin, 6)}" if len(wrong) else ""
            raise PhysicsFailed(f"{len(wrong)} velocities on the rim of {self.name!r} are NaN or infinite in step {step}{where}")

    # -- the end -----------------------------------------------------------------------------------------------------

    def send_stop(self, reason):
        """Waits for the forces that are under way and sends STOP; returns the discs' FAREWELL, {} if none arrives."""
        self.conversation.receive((messages.FORCE,))
        self.conversation.end_steps(reason)
        try:
            return self._receive_control(messages.FAREWELL)
        except PeerLost as error:  # everything is computed and recorded: only the discs' timings are missing
            log.warning("no farewell of rank %d: %s", self.rank, error)
            return {}

    def _receive_control(self, kind, meanwhile=None):
        return content_of(self.conversation.receive((kind,), meanwhile=meanwhile)[1])
