"""Kinds of stages of the continuum. side: the fdm_server.procedure.grid_side.ContinuumSide, stage: its StageRun.

If the run continues inside of a stage (side.inside), what the stage does before its first step is done already.
"""

import logging
from functools import partial

from fdm_server.coupling.rim import open_windows
from fdm_server.ground.load_ramps import remove_zones, surcharge_ramp
from fdm_server.ground.load_steps import ramp_of
from fdm_server.ground.removed_loads import removed_loads
from fdm_server.observe import fields
from fdm_server.procedure.compile_ahead import coupled_kernels

log = logging.getLogger(__name__)


def equilibrium(side, stage):
    """Brings the grid alone to rest; displacements and velocities are set to zero at its end."""
    side.compute(stage)
    side.state.displacement[:] = 0.0
    side.state.velocity[:] = 0.0
    side.finish(stage, stage.before)


def locate(side, stage):
    """Computes the grid alone under other gravity; with `discard` the State before the stage is restored."""
    side.compute(stage)
    side.finish(stage, stage.before)


def fill(side, stage):
    """Sends the stress of the zones to the discs of every window, which take it over; compiles the coupled stages meanwhile."""
    kernels = coupled_kernels(side)
    for rim in side.rims:
        rim.talk.receive_packed(kernels)
        field = fields.zone_field(side.model, side.state, rim.mask)
        rim.talk.send_field(field, stage.gravity, stage.stage.insitu is not False)
    for rim in side.rims:
        rim.receive_ready(kernels)
        log.info("rank %d: %s", rim.talk.rank, rim.report)
    side.watch.add_to("waiting")
    side.finish(stage)


def couple(side, stage):
    """Cuts holes for the windows, and hands over to the discs gradually."""
    if side.inside is None:
        side.model, side.state = open_windows(side.model, side.state, side.rims)
        for rim in side.rims:
            rim.talk.send_go(stage.gravity, side.steps, side.time, stage.index, side.bin_length)
        side.coupled = True
    stage.rims = side.rims
    side.compute(stage)
    side.finish(stage)


def excavate(side, stage):
    """Removes zones; their forces on the ground are reduced gradually."""
    if side.inside is None:
        table, law = stage.stage.excavate, side.model.law
        ramp = ramp_of(side.scene, stage.index, law, table.over, table.ratio)
        mask, loads_on = side.excavations[stage.index], partial(removed_loads, side.scene, stage.index, side.model)
        side.model, side.state, stage.load = remove_zones(side.model, side.state, mask, stage.gravity, ramp, loads_on)
    side.compute(stage)
    side.finish(stage)


def surcharge(side, stage):
    """Increases the pressure on the ground surface."""
    if side.inside is None:
        table = stage.stage.surcharge
        ramp = ramp_of(side.scene, stage.index, side.model.law, table.over, table.ratio)
        stage.load = surcharge_ramp(side.model, side.state, table, [rim.nodes for rim in side.rims], ramp)
    side.compute(stage)
    side.finish(stage)


def steps_alone(side, stage):
    """Takes steps only: gravity grows (overload), or boundaries hold, move or load sides of the grid (load)."""
    side.compute(stage)
    side.finish(stage)


KINDS = {
    "equilibrium": equilibrium,
    "locate": locate,
    "fill": fill,
    "couple": couple,
    "overload": steps_alone,
    "excavate": excavate,
    "surcharge": surcharge,
    "load": steps_alone,
}
