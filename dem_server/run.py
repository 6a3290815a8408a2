"""The discrete side of the coupled run. `lockstep` is the loop; the twin of fdm_server/run.py."""

from math import isfinite

import numpy as np

from coupler_protocol.exits import PhysicsFailed
from coupler_protocol.wire import messages
from dem_server.coupling.grid_talk import steps_between
from dem_server.step.contact_pass import contact_forces
from dem_server.step.motion import SPEED_CAP, move_free

TOO_FAST = (
    "move by more than a tenth of the smallest radius a step after step {}: give the stage a smaller step_factor, or less "
    "violent loads"
)


def lockstep(side):
    """Exchange forces and velocities with the continuum, step by step, until it says stop; returns its reason.

    The forces go out as soon as the contacts are known. Looks, records and the motion of the free discs come after that, while
    the continuum computes the rim's velocities. After the last step of a stage looks and records come first, for the forces say
    how long a step of the next stage may be; in its first step the free discs wait to hear how long it is. A VELOCITY may be for
    several steps: the rim's mean velocities in them.
    """
    order = None
    while True:
        last = order is not None and bool(int(order.flags) & messages.END_OF_STAGE)
        if last:
            finish_step(side, order)
        say_forces(side, order)
        if order is not None and not last:
            finish_step(side, order)
        side.answer = side.looked
        gravity, agreed = side.gravity, side.step is not None
        if agreed:
            move_discs(side, gravity)
        side.watch.to("computing")
        order, stopped = side.talk.hear_answer()
        side.watch.to("waiting")
        if order is None:
            return stopped
        side.gravity = order.gravity
        side.take_step(order)
        if not agreed:
            move_discs(side, gravity)
        for between in steps_between(order, gravity, side.gravity_in(order)):
            complete_step(side, gravity, between)
            finish_step(side, between)
            side.answer = side.looked
            gravity = between.gravity
            move_discs(side, gravity)
        complete_step(side, gravity, order)


def complete_step(side, gravity, order):
    """The second half of a step, and its other sub-steps."""
    move_rim(side, gravity, order)
    for _ in range(side.substeps - 1):
        move_discs(side, gravity)
        move_rim(side, gravity)


def move_rim(side, gravity, order=None):
    """Control discs move with the rim, contacts follow. order: of the step that begins with this motion."""
    state, ledger = side.state, side.ledger
    side.rim.move(state, side.talk.velocity)
    refuse_fast_rim(side)
    if order is not None:
        side.see_power(order)
    if ledger:
        side.book(gravity, begins=order is not None)
    contact_forces(side.model, state)
    if ledger:
        ledger.book_contacts(side.model, state)
    side.check_step()


def finish_step(side, order):
    """Look at the step that is done and write what the continuum ordered."""
    side.look(order)
    side.watch.to("computing")
    side.record(order)
    side.watch.to("recording")


def move_discs(side, gravity):
    """Move the free discs; in real time nothing is slowed down, so a disc that is too fast ends the run."""
    if side.ledger:
        side.ledger.keep(side.state, gravity)
    fast = move_free(side.model, side.state, gravity)
    if fast and side.model.in_real_time:
        raise PhysicsFailed(f"{fast} discs or stones {TOO_FAST.format(side.steps)}")


def refuse_fast_rim(side):
    """Raise PhysicsFailed where the grid moves control discs so fast that others could pass through them."""
    model, state = side.model, side.state
    if model.in_real_time and np.abs(state.v[: model.ring]).max() * state.dt > SPEED_CAP * model.smallest_radius:
        raise PhysicsFailed(f"control discs {TOO_FAST.format(side.steps)}")


def say_forces(side, order):
    """Nodal forces and additional masses of the rim, how the discs fared at the last look; strain if it is asked for."""
    asked = order is not None and side.strain is not None and int(order.flags) & messages.STRAIN
    force = side.rim.nodal_forces(side.state)
    if not isfinite(force.sum()):
        raise PhysicsFailed(
            f"the discs' forces on the rim are NaN or infinite after step {side.steps}: the window has blown up; "
            "try a smaller step_factor"
        )
    strain = side.strain.measure(side.state) if asked else None
    side.talk.say_forces(force, side.rim.stiffness_sums(side.model, side.state), side.answer, strain)
