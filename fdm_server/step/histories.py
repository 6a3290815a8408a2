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


def begin_and_end_histories(model, state):
    """Sets histories of laws that begin to zero, and of laws that end to None; others keep their values.

    Histories of one stage are left to `begin_stage`.
    """
    _begin(model, state, [h for h in DECLARED.values() if not h.of_stage and _begins_or_ends(model, state, h.name)])
    acting = model.law.histories.items()
    state.memory = {n: state.memory.get(n, _zeros(model, h)) for n, h in acting if n not in DECLARED}


def _begins_or_ends(model, state, name):
    return (getattr(state, name) is None) == (name in model.law.histories)


def _begin(model, state, histories):
    for history in histories:
        setattr(state, history.name, _zeros(model, history) if history.name in model.law.histories else None)


def _zeros(model, history):
    return new_history(history, len(model.grid.xy), len(model.geometry.corner))
