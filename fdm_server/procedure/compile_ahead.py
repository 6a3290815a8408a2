"""Compilation of the kernels of coupled stages while the grid waits for the discs.

Every coupled stage is prepared on copies and takes one step against discs without forces, so the kernels and the types of their
arguments are those of the stage. Nothing of it reaches the side, its files or its messages.
"""

import copy
import logging

import numpy as np

from coupler_protocol.compiled.ahead import ENABLED, compile_for
from coupler_protocol.exits import Interrupted, RunEnded
from coupler_protocol.process.trace import stopwatch
from coupler_protocol.scene.ending import least_steps
from coupler_protocol.scene.schedule import leg_of
from coupler_protocol.scene.stage_kinds import of
from coupler_protocol.wire import lanes
from fdm_server.coupling.plain_help import help_grid
from fdm_server.coupling.plain_loop import plain_loop
from fdm_server.coupling.rim import open_windows
from fdm_server.observe import record
from fdm_server.observe.stable_limit import safe_limits
from fdm_server.procedure.stage_run import StageRun
from fdm_server.step.gridpoint_pass import farthest, unbalanced_ratio, update_velocities
from fdm_server.step.safety import check_motion
from fdm_server.step.zone_pass import advance

log = logging.getLogger(__name__)


def coupled_kernels(side):
    """Yields after every kernel of the coupled stages that follow; side: a fdm_server.procedure.grid_side.ContinuumSide."""
    stages = side.scene.stage
    first = next((index for index, stage in enumerate(stages) if of(stage).couples), len(stages))
    try:
        copied = _copy(side) if ENABLED and first < len(stages) else None
        for index in range(first, len(stages)) if copied else ():
            yield from _one_step(copied, index)
    except Interrupted:
        raise
    except (RunEnded, ArithmeticError, ValueError) as error:  # the stage itself will meet it, or not: its discs have forces
        log.info("kernels of coupled stages are compiled when they are needed: %s", error)


def _copy(side):
    """The side with open windows; what steps change is copied."""
    found = copy.copy(side)
    found.state, found.watch, found.progress = copy.deepcopy(side.state), stopwatch(None), _silent
    found.warnings, found.results, found.plugin, found.coupled = [], list(side.results), None, True
    found.rims = [_rim(rim) for rim in side.rims]
    with np.errstate(all="ignore"):
        found.model, found.state = open_windows(found.model, found.state, found.rims)
    return found


def _rim(rim):
    found = copy.copy(rim)
    for name in ("force", "sums", "path", "before"):
        setattr(found, name, getattr(rim, name).copy())
    return found


def _silent(*_, **__):
    pass


def _one_step(side, index):
    """Yields after every kernel of a step of the stage with this number; changes the side, which is a copy."""
    scene = side.scene.stage[index]
    stage = StageRun(side, index, scene, leg_of(scene, *side.gravity))
    stage.begin_changes()
    side.prepare(stage)
    yield
    for work in (_gridpoints, _rims, _zones, _observed, _limits, _loop):
        with np.errstate(all="ignore"):
            work(side, stage)
        yield
    stage.end_motions()
    side.gravity = stage.leg.gravity, stage.leg.end


def _gridpoints(side, stage):
    model, state, ledger = side.model, side.state, stage.ledger
    for rim in stage.rims:
        rim.apply_forces(state, stage.gravity, stage.share)
    if ledger:
        ledger.copy_before_step(state)
    update_velocities(model, state, stage.gravity)
    if ledger:
        for kick in (state.dt, None) if state.in_real_time else (None,):  # the first step of a stage, and those after it
            ledger.book_motion(model, state, stage.gravity, kick, stage.rims)


def _rims(side, stage):
    stage.set_velocities(side.state)
    stage.watch_rims(side.state)


def _zones(side, stage):
    advance(side.model, side.state)
    if stage.ledger:
        stage.ledger.book_strain(side.model, side.state)


def _observed(side, stage):
    model, state, holders = side.model, side.state, stage.sides.holders
    check_motion(model, state)
    stage.stretch.check(state.displacement)
    farthest(state.displacement)
    record.history(model, state, unbalanced_ratio(model, state, stage.gravity), stage.factor)
    record.reactions(model, state, stage.gravity, holders)
    record.movements(model, state, holders)


def _limits(side, stage):
    nodes = np.concatenate([rim.nodes for rim in stage.rims])
    safe_limits(side.model, side.state, nodes, np.concatenate([rim.sums for rim in stage.rims]))


def _loop(side, stage):
    plain = stage.plain
    if not plain.why_not and least_steps(stage.stage) >= lanes.EARLIEST:
        arguments = plain._arguments(plain._course(1), False)
        compile_for(plain_loop, arguments)
        if plain.crew is not None:
            compile_for(help_grid, (plain.crew, *arguments[3:7]))
