"""What the discrete side saves at the end of a stage, and how it goes on from there.

The model is saved too: it came from a packing and, with stones, changed while the window was filled. Then there is what the rim
keeps, and the outcome of looks: of the one that the forces of this step carry, and of the one that those of the next will.
"""

import json
from typing import NamedTuple

from coupler_protocol.files import checkpoint, restart
from coupler_protocol.interface.ring import build_ring
from coupler_protocol.wire.messages import Answer
from dem_server.coupling.rim import Rim, RimState
from dem_server.model import Model, State


class WindowState(NamedTuple):
    """All that one window is made of."""

    model: Model
    discs: State
    rim: RimState
    answer: Answer
    looked: Answer


def name(rank):
    """Name of a process, with which its files begin."""
    return f"dem.rank{rank}"


def save(side, stage, phase, factor):
    """Write the checkpoint of a stage of a dem_server.procedure.window_side.DiscreteSide; returns its path."""
    path = side.out / f"{name(side.rank)}.{stage}.h5"
    state = WindowState(side.model, side.state, side.rim.saved(), side.answer, side.looked)
    session = side.conversation.session
    about = restart.attributes(side.scene, stage, phase, side.steps, session, factor, report=side.report)
    checkpoint.save(path, state, about)
    return path


def restore(side, saved, nodes):
    """Bring a side to a saved stage end (coupler_protocol.files.restart.Saved); nodes (K,2): the rim as drawn [m]."""
    found = checkpoint.rebuild(WindowState, saved.fields)
    side.model, side.state = found.model, found.discs
    side.rim = Rim(build_ring(nodes, side.scene.discs.radius), side.scene.coupling.mapping, found.rim)
    side.answer, side.looked = found.answer, found.looked
    side.report = json.loads(saved.about["report"])
