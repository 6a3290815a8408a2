"""The discrete side of the coupled run. `lockstep` is the loop; the twin of fdm_server/run.py."""

from math import isfinite

from coupler_protocol import messages
from coupler_protocol.exits import PeerLost, PhysicsFailed
from coupler_protocol.wire import WireError, content_of
from dem_server.contacts import contact_forces
from dem_server.motion import move_free


def lockstep(side):
    """Exchange forces and velocities with the continuum, step by step, until it says stop; returns its reason.

    The forces go out as soon as the contacts are known. Looks, records and the motion of the free discs come after that, while
    the continuum computes the rim's velocities.
    """
    model, state, rim, talk = side.model, side.state, side.rim, side.conversation
    order = None
    while True:
        say_forces(side, order)
        if order is not None:
            side.look(order)
            side.watch.to("computing")
            side.record(order)
            side.watch.to("recording")
        side.answer = side.looked
        move_free(model, state, side.gravity)
        side.watch.to("computing")
        kind, frame = talk.hear((messages.VELOCITY, messages.STOP), in_step=True)
        side.watch.to("waiting")
        if kind == messages.STOP:
            talk.sequence += 1
            return content_of(frame)["reason"]
        order = take_velocities(side, frame)
        rim.move(state, side.velocity)
        contact_forces(model, state)


def say_forces(side, order):
    """FORCE: nodal forces and additional masses of the rim, how the discs fared at the last look; strain if it is asked for."""
    asked = order is not None and side.strain is not None and int(order.flags) & messages.STRAIN
    frame, K = side.strain.frame if asked else side.force_frame, len(side.rim.nodes)
    frame.values[: 2 * K] = side.rim.nodal_forces(side.state).ravel()
    if not isfinite(frame.values[: 2 * K].sum()):
        raise PhysicsFailed(f"the discs' forces on the rim are no numbers any more after step {side.steps}")
    frame.values[2 * K : 3 * K] = side.rim.stiffness_sums(side.model, side.state)
    if asked:
        frame.values[3 * K :] = side.strain.measure(side.state).ravel()
    frame.scalars[:] = side.answer
    side.conversation.say(frame.seal(side.conversation.sequence))


def take_velocities(side, frame):
    """VELOCITY: the rim's velocities go into `side.velocity`; returns the Order."""
    try:
        side.velocity_frame.accept(frame)
    except WireError as error:
        raise PeerLost(f"the continuum sent what cannot be used: {error}") from None
    side.conversation.sequence += 1
    side.velocity[:] = side.velocity_frame.values.reshape(-1, 2)
    order = messages.Order(*side.velocity_frame.scalars.tolist())
    side.gravity = order.gravity
    return order
