"""Compilation of the kernels of coupled stages while the discs wait for the stress of their zones.

Stones form, bonds are made and every coupled stage takes one step with a rim at rest, on copies, so the kernels and the types of
their arguments are those of the run. Nothing of it reaches the side, its files or its messages.
"""

import copy
import logging

import numpy as np

from coupler_protocol.compiled.ahead import ENABLED, compile_for
from coupler_protocol.exits import Interrupted, RunEnded
from coupler_protocol.process.trace import stopwatch
from coupler_protocol.scene.ending import least_steps
from coupler_protocol.scene.schedule import plan
from coupler_protocol.scene.stage_kinds import number_of
from coupler_protocol.wire import lanes
from dem_server.coupling.plain_help import help_discs
from dem_server.coupling.plain_loop import plain_loop
from dem_server.coupling.ring_guard import RingGuard
from dem_server.insitu.takeover import bond
from dem_server.insitu.virtual_strain import relax
from dem_server.observe.stable_limit import motion_of_ring
from dem_server.observe.unbalanced_ratio import unbalanced_ratio
from dem_server.step import breaks
from dem_server.step.contact_pass import contact_forces
from dem_server.step.motion import move_free
from dem_server.stones import bodies

log = logging.getLogger(__name__)


def coupled_kernels(side):
    """Yields after every kernel that the packed window needs from now on; side: a procedure.window_side.DiscreteSide."""
    stages = side.scene.stage
    first = number_of(stages, couples=True)
    try:
        if ENABLED and first is not None:
            copied = _copy(side)
            yield from _formed(copied)
            for index in range(first, len(stages)):
                yield from _one_step(copied, index)
    except Interrupted:
        raise
    except (RunEnded, ArithmeticError, ValueError) as error:  # the run itself will meet it, or not: its discs bear a stress
        log.info("kernels of coupled stages are compiled when they are needed: %s", error)


def _copy(side):
    """The side before its first coupled stage; what steps change is copied."""
    found = copy.copy(side)
    found.state, found.watch, found.plugin = copy.deepcopy(side.state), stopwatch(None), None
    found.changes, found.limits, found.openings = [], [], []
    found.rim = copy.copy(side.rim)
    for name in ("nodes", "force", "carried"):
        setattr(found.rim, name, getattr(side.rim, name).copy())
    found.gravity = plan(side.scene)[number_of(side.scene.stage, couples=True)].at(0)
    return found


def _formed(side):
    """Yields after every kernel of a takeover without stress."""
    unbalanced_ratio(side.model, side.state, side.gravity)
    yield
    relax(side.model, side.state, side.gravity, 1)
    yield
    if side.stones is not None:
        side.model = bodies.form_stones(side.model, side.state, side.stones.outlines, side.scene.stones.body)
        yield
        relax(side.model, side.state, side.gravity, 1)
        yield
    bond(side.model, side.state)
    yield
    side.answer = side.looked = side._new_answer(side.gravity)
    yield
    side.guard = RingGuard(side.model, side.state, side.scene.origin)
    side._prepare_talk(None)


def _one_step(side, index):
    """Yields after every kernel of a step of the stage with this number; changes the side, which is a copy."""
    side._begin_stage(index)
    yield
    for work in (_forces, _motion, _ring, _observed, _loop):
        work(side)
        yield


def _forces(side):
    side.rim.nodal_forces(side.state)
    side.rim.power(side.state)
    side.rim.stiffness_sums(side.model, side.state)


def _motion(side):
    if side.ledger:
        side.ledger.copy_before_step(side.state, side.gravity)
    move_free(side.model, side.state, side.gravity)


def _ring(side):
    side.rim.move(side.state, np.zeros_like(side.talk.velocity))
    if side.ledger:
        side.ledger.book_motion(side.model, side.state, side.gravity)
        side.ledger.note(side.steps, side.model, side.state)
        side.ledger.copy_contacts(side.model, side.state)
    contact_forces(side.model, side.state)
    if side.ledger:
        side.ledger.book_contacts(side.model, side.state)
    side.refuse_passing()


def _observed(side):
    side.guard.check(side.model, side.state)
    side._new_answer(side.gravity)
    motion_of_ring(side.model, side.state, side.rim)
    if breaks.has_bonds(side.state):
        compile_for(breaks.note_breaks, breaks.arguments(side.state, np.empty((0, breaks.COLUMNS))))


def _loop(side):
    if not side.plain.why_not and least_steps(side.scene.stage[side.stage]) >= lanes.EARLIEST:
        arguments = side.plain._arguments(True)
        compile_for(plain_loop, arguments)
        if side.plain.crew is not None:
            compile_for(help_discs, side.plain.help_arguments(side.plain.crew, arguments))
