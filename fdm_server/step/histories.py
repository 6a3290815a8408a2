"""What laws remember at the start, and what they forget: where zones are removed, and where a stage begins."""

from fdm_server.effects.histories import DECLARED
from fdm_server.step.blocks import new_history

ZONE, GRIDPOINT, NEITHER = "zone", "gridpoint", "neither"


def forget(model, state, where=(ZONE,)):
    """Set what the model's laws remember at these places to zero, and what laws that do not act remembered to None."""
    _begin(model, state, [history for history in DECLARED.values() if history.place in where])
    if ZONE in where:
        acting = model.law.histories.items()
        state.memory = {name: _zeros(model, history) for name, history in acting if name not in DECLARED}


def begin_stage(model, state):
    """The same for what laws remember of one stage only."""
    _begin(model, state, [history for history in DECLARED.values() if history.of_stage])


def _begin(model, state, histories):
    for history in histories:
        setattr(state, history.name, _zeros(model, history) if history.name in model.law.histories else None)


def _zeros(model, history):
    return new_history(history, len(model.grid.xy), len(model.geometry.corner))
