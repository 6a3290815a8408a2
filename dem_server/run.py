"""The discrete side of the coupled run. `lockstep` is the loop; the twin of fdm_server/run.py."""

from coupler_protocol.wire import messages
from dem_server.coupling.grid_talk import steps_between
from dem_server.coupling.plain_steps import COMPLETED, MOVE
from dem_server.step.contact_pass import contact_forces
from dem_server.step.motion import move_free


def lockstep(side):
    """Exchanges forces and velocities with the continuum, step by step, until STOP; returns the reason in STOP.

    Forces are sent as soon as the contacts are computed. Observation, recording and the motion of the free discs follow while
    the continuum computes the rim's velocities. After the last step of a stage observation and recording come first, because
    FORCE contains the longest step of the next stage; in its first step the free discs wait for the agreed step. A VELOCITY may
    be for several steps: it contains the rim's mean velocities in them. The sums of the mass rule always belong to the step after
    which the list of pairs was new, whether or not an exchange follows it. Steps that nobody has to see are taken in one compiled
    call (dem_server/coupling/plain_steps.py), which ends inside of a step.
    """
    order = None
    while True:
        last = order is not None and bool(int(order.flags) & messages.END_OF_STAGE)
        if last:
            finish_step(side, order)
        send_forces(side, order)
        if order is not None and not last:
            finish_step(side, order)
        side.answer = side.looked
        how, order = side.plain.take()
        gravity, agreed = side.gravity, side.step is not None
        if how == COMPLETED:
            continue
        if how == MOVE and agreed:
            move_discs(side, gravity)
        side.watch.add_to("computing")
        if order is None:
            order, stopped = side.talk.receive_order()
        side.watch.add_to("waiting")
        if order is None:
            return stopped
        side.gravity = order.gravity
        side.accept_order(order)
        if not agreed:
            move_discs(side, gravity)
        for between in steps_between(order, gravity, side.gravity_in(order)):
            complete_step(side, gravity, between)
            finish_step(side, between)
            side.answer = side.looked
            side.rim.stiffness_sums(side.model, side.state)
            gravity = between.gravity
            move_discs(side, gravity)
        complete_step(side, gravity, order)


def complete_step(side, gravity, order):
    """Completes a step: its second half, and its other sub-steps."""
    move_rim(side, gravity, order)
    for _ in range(side.substeps - 1):
        move_discs(side, gravity)
        move_rim(side, gravity)


def move_rim(side, gravity, order=None):
    """Moves control discs with the rim, then computes contacts. order: of the step that begins with this motion."""
    side.rim.move(side.state, side.talk.velocity)
    side.refuse_fast_rim()
    if side.ledger:
        side.book_energy(gravity, begins=order is not None)
    complete_contacts(side, order)


def complete_contacts(side, order):
    """Computes contacts after the ring has moved; order: as in `move_rim`."""
    if order is not None:
        side.measure_power(order)
    contact_forces(side.model, side.state)
    if side.ledger:
        side.ledger.book_contacts(side.model, side.state)
    side.check_step()
    side.refuse_passing()


def finish_step(side, order):
    """Observes the completed step and records what the continuum ordered."""
    side.observe(order)
    side.watch.add_to("computing")
    side.record(order)
    side.watch.add_to("recording")


def move_discs(side, gravity):
    """Moves the free discs; raises PhysicsFailed for a disc that is too fast in real time, where no speed is capped."""
    if side.ledger:
        side.ledger.copy_before_step(side.state, gravity)
    side.refuse_fast(move_free(side.model, side.state, gravity))


def send_forces(side, order):
    """Sends nodal forces and additional masses of the rim, the last Answer, and strain if it was requested.

    A side that continues inside of a stage first sends its last FORCE again, without an order.
    """
    asked = side.sent_strain if order is None else bool(int(order.flags) & messages.STRAIN)
    asked = side.sent_strain = asked and side.strain is not None
    force = side.rim.nodal_forces(side.state)
    side.refuse_infinite(force)
    strain = side.strain.measure(side.state) if asked else None
    side.talk.send_forces(force, side.rim.stiffness_sums(side.model, side.state), side.answer_now, strain)
