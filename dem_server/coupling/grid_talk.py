"""What a window says to the continuum and hears from it once they are coupled: FORCE, and VELOCITY or STOP."""

import numpy as np

from coupler_protocol.exits import PeerLost
from coupler_protocol.wire import messages
from coupler_protocol.wire.frames import WireError, content_of
from coupler_protocol.wire.payloads import ForceFrame, VelocityFrame


class GridTalk:
    """Step messages of a window with K nodes on its rim; bins: how many a FORCE with strain has, 0 where none is asked for."""

    def __init__(self, conversation, nodes, bins=0):
        self.conversation = conversation
        self._force, self._velocity = ForceFrame(conversation, nodes), VelocityFrame(conversation, nodes)
        self._force_and_strain = ForceFrame(conversation, nodes, bins)
        self.velocity = np.zeros((nodes, 2))  # as the last VELOCITY said

    def send_forces(self, force, sums, answer, strain=None):
        """FORCE: nodal forces (K,2) [N], sums (K,) [N/m] of the mass rule, an Answer, strain (B,3) where it was asked for."""
        frame = self._force if strain is None else self._force_and_strain
        frame.force[:], frame.sums[:], frame.scalars[:] = force, sums, answer
        if strain is not None:
            frame.strain[:] = strain
        self.conversation.send_step(frame)

    def receive_order(self):
        """Wait for VELOCITY, whose velocities are in `velocity` then, or STOP; returns (Order or None, reason to stop or "")."""
        kind, frame = self.conversation.receive((messages.VELOCITY, messages.STOP), in_step=True)
        if kind == messages.STOP:
            return None, content_of(frame)["reason"]
        try:
            self._velocity.accept(frame)
        except WireError as error:
            raise PeerLost(f"the continuum sent what cannot be used: {error}") from None
        self.velocity[:] = self._velocity.velocity
        return self._velocity.order, ""


def steps_between(order, gravity, last):
    """Orders of the steps before the last one that a VELOCITY is for; gravity, last [m/s2]: in the first step and in the last.

    Nothing is ordered after them; between the first and the last step gravity changes linearly.
    """
    steps = int(order.interval)
    for n in range(1, steps):
        now = gravity + (last - gravity) * (n / (steps - 1))
        yield order._replace(step=order.step - steps + n, gravity=now, flags=0.0)
