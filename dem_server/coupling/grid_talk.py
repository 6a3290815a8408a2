"""Messages between a coupled window and the continuum: FORCE is sent, VELOCITY or STOP is received."""

import numpy as np

from coupler_protocol.exits import PeerLost
from coupler_protocol.wire import messages
from coupler_protocol.wire.frames import WireError, content_of
from coupler_protocol.wire.payloads import ForceFrame, VelocityFrame


class GridTalk:
    """Step messages of a window with K nodes on its rim; bins: number of bins in a FORCE with strain, 0 if there is none."""

    def __init__(self, conversation, nodes, bins=0):
        self.conversation = conversation
        self._force, self._velocity = ForceFrame(conversation, nodes), VelocityFrame(conversation, nodes)
        self._force_and_strain = ForceFrame(conversation, nodes, bins)
        self.velocity = np.zeros((nodes, 2))  # of the last VELOCITY

    def send_forces(self, force, sums, answer, strain=None):
        """Sends FORCE: nodal forces (K,2) [N], sums (K,) [N/m] of the mass rule, an Answer, strain (B,3) if it was requested."""
        frame = self._force if strain is None else self._force_and_strain
        frame.force[:], frame.sums[:], frame.scalars[:] = force, sums, answer
        if strain is not None:
            frame.strain[:] = strain
        self.conversation.send_step(frame)

    def receive_order(self):
        """Waits for VELOCITY and copies it to `velocity`, or for STOP; returns (Order or None, reason to stop or "")."""
        kind, frame = self.conversation.receive((messages.VELOCITY, messages.STOP))
        if kind == messages.STOP:
            return None, content_of(frame)["reason"]
        try:
            self._velocity.accept(frame)
        except WireError as error:
            raise PeerLost(f"the continuum sent what cannot be used: {error}") from None
        self.velocity[:] = self._velocity.velocity
        return self._velocity.order, ""


def steps_between(order, gravity, last):
    """Yields Orders of the steps of a VELOCITY before its last one; gravity, last [m/s2]: in the first step and in the last.

    Their flags are 0; between the first and the last step gravity changes linearly.
    """
    steps = int(order.interval)
    for n in range(1, steps):
        now = gravity + (last - gravity) * (n / (steps - 1))
        yield order._replace(step=order.step - steps + n, gravity=now, flags=0.0)
