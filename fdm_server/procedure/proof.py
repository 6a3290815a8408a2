"""What a State of the grid from a file must be: of the shapes of a State that is made anew, finite, with zones that there are.

Whether the numbers are those that were saved, the seal of the file says (coupler_protocol/files/seal.py).
"""

import numpy as np

from coupler_protocol.files.proof import positive, require, shaped, within
from fdm_server.effects.histories import DECLARED
from fdm_server.effects.plastic_state import NOW, PAST
from fdm_server.model import new_state
from fdm_server.step.blocks import new_history

FLAGS = NOW | NOW << PAST  # largest value of State.plastic


def prove_zones(zone, zones):
    """Raises coupler_protocol.files.proof.UnprovenError unless `zone` (A,) names zones of a grid, each once, in order."""
    shaped("zone", zone, (len(zone),), "i")
    require(len(zone), "zone holds no zone")
    within("zone", zone, 0, zones - 1)
    require((np.diff(zone) > 0).all(), "zone does not hold every zone once, in order")


def prove(model, state):
    """Raises UnprovenError unless steps can be taken with `state` of `model`."""
    like = new_state(model)
    points = like.velocity.shape
    for name in ("velocity", "displacement", "force", "applied", "added_mass", "stress", "corner_force"):
        shaped(name, getattr(state, name), getattr(like, name).shape)
    for name, history in DECLARED.items():
        value, own = getattr(state, name), new_history(history, len(model.grid.xy), len(model.geometry.corner))
        acts = name in model.law.histories or history.of_stage  # a stage makes its own when it begins
        require(acts or value is None, f"{name} is of no law that acts")
        require(value is not None or not acts or history.of_stage, f"{name} is missing")
        if value is not None:
            shaped(name, value, own.shape, own.dtype.kind)
    if state.plastic is not None:
        within("plastic", state.plastic, 0, FLAGS)
    require(sorted(state.memory) == sorted(like.memory), "memory does not hold what the laws remember")
    for name, value in state.memory.items():
        shaped(f"memory.{name}", value, like.memory[name].shape, like.memory[name].dtype.kind)
    if state.mass is not None:
        shaped("mass", state.mass, points[:1])
        positive("mass", state.mass[~model.fixed.all(axis=1)])
    if state.driven is not None:
        shaped("driven", state.driven, points)
    for name, value in state.loads.items():
        shaped(f"loads.{name}", value, points)
    require(state.mass_age >= 0, "mass_age is negative")
    require(not state.in_real_time or (np.isfinite(state.dt) and state.dt > 0.0), "dt is not a time step")


def prove_rims(rims, found):
    """Raises UnprovenError unless `found` {window: RimState} fits the rims."""
    require(sorted(found) == sorted(rim.window.name for rim in rims), f"rims are of the windows {', '.join(sorted(found))}")
    for rim in rims:
        saved, nodes = found[rim.window.name], len(rim.nodes)
        for name, shape in (("reaction", (nodes, 2)), ("reaction_mass", (nodes,)), ("force", (nodes, 2))):
            shaped(f"rims.{rim.window.name}.{name}", getattr(saved, name), shape)
