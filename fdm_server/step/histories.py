"""Histories of laws at the start of a run, after a reset of the zones, and at the start of a stage."""

from fdm_server.effects.histories import DECLARED
from fdm_server.step.blocks import new_history

ZONE, GRIDPOINT, NEITHER = "zone", "gridpoint", "neither"


def reset_histories(model, state, where=(ZONE,)):
    """Sets histories of acting laws at these places to zero, and histories of other laws to None."""
    _begin(model, state, [history for history in DECLARED.values() if history.place in where])
    if ZONE in where:
        acting = model.law.histories.items()
        state.memory = {name: _zeros(model, history) for name, history in acting if name not in DECLARED}


def begin_stage(model, state):
    """Does the same for the histories that belong to one stage."""
    _begin(model, state, [history for history in DECLARED.values() if history.of_stage])


def _begin(model, state, histories):
    for history in histories:
        setattr(state, history.name, _zeros(model, history) if history.name in model.law.histories else None)


def _zeros(model, history):
    return new_history(history, len(model.grid.xy), len(model.geometry.corner))
