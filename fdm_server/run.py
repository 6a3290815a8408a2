"""The continuum's time loop; the twin of dem_server/run.py.

Leap-frog on both sides: forces at whole steps, velocities at half steps. While zones strain here, contacts are computed there.
"""

from fdm_server.step.gridpoint_pass import update_velocities
from fdm_server.step.zone_pass import advance


def run_stage(side, stage):
    """Takes steps until the stage ends; stage: a fdm_server.procedure.stage_run.StageRun.

    Between FORCE and VELOCITY only the work that VELOCITY needs is done; everything else follows. If both sides take several
    steps between exchanges (fdm_server/coupling/exchange_pauses.py), the received forces stay constant. Coupled steps that nobody
    has to see are taken before, in one compiled call (fdm_server/coupling/plain_steps.py).
    """
    state, rims, ledger, watch, pace = side.state, stage.rims, stage.ledger, side.watch, stage.pace
    while not stage.ended:
        if stage.plain:
            stage.plain.take()
        for rim in rims if pace.begins else ():
            rim.receive_forces()
        for rim in rims:
            rim.apply_forces(state, stage.gravity, stage.share)
        watch.add_to("waiting")
        model = stage.agree_on_step()
        if ledger:
            ledger.copy_before_step(state)
        update_velocities(model, state, stage.gravity, stage.kick)
        stage.set_velocities(state)
        if ledger:
            ledger.book_motion(model, state, stage.gravity, stage.kick, rims)
        for rim in rims:
            rim.note_velocities(state, pace.taken == 0)
        order = stage.order()
        for rim in rims if order.interval else ():
            rim.send_velocities(order)
        if order.interval:
            stage.watch_rims(state)
        stage.observe(model, state)
        advance(model, state)
        if ledger:
            ledger.book_strain(model, state)
        stage.step_done()
        watch.add_to("computing")
        side.record(stage, order)
        watch.add_to("recording")
