"""Checkpoints of the discrete side at the end of a stage and inside of one, and how it continues from them.

A checkpoint includes the model, which depends on the packing and, with stones, changed while the window was filled. It also
includes the state of the rim and two Answers: that of the FORCE of this step, and that of the next FORCE. Inside of a stage FORCE
of this step is sent already, and the continued side sends it again.
"""

from typing import Any, NamedTuple

from coupler_protocol.files import checkpoint, proof, restart, saved_moments
from coupler_protocol.interface.ring import build_ring
from coupler_protocol.wire.messages import Answer
from dem_server.coupling.rim import Rim, RimState
from dem_server.model import Model, State
from dem_server.procedure.proof import prove


class WindowState(NamedTuple):
    """Everything that one window consists of."""

    model: Model
    discs: State
    rim: RimState
    answer: Answer
    looked: Answer
    stage: dict[str, Any]  # inside of a stage: what DiscreteSide.saved_stage gives


def name(rank):
    """Name of a process, with which the names of its files begin."""
    return f"dem.rank{rank}"


def save(side, stage, phase, factor):
    """Writes the checkpoint of a stage of a dem_server.procedure.window_side.DiscreteSide; returns its path."""
    inside = side.saved_stage() if phase == restart.INSIDE else {}
    path = saved_moments.path_of(side.out, name(side.rank), stage, side.steps if inside else 0)
    state = WindowState(side.model, side.state, side.rim.saved(), side.answer, side.looked, inside)
    session = side.conversation.session
    more = {"report": side.report, "limits": side.limits, "openings": side.openings, "changes": side.changes}
    about = restart.attributes(
        side.scene, name(side.rank), stage, phase, side.steps, session, factor, side.run_number, **more
    )  # fmt: skip
    checkpoint.save(path, state, about)
    return path


def restore(side, saved, nodes, surface=None):
    """Restores a side from a checkpoint (coupler_protocol.files.restart.Saved); nodes (K,2), surface (S,2): the rim as drawn [m].

    Raises EnvironmentFailed if no step can be taken with what was saved.
    """
    ring = build_ring(nodes, side.scene.discs.radius, surface)
    with proof.of_file(saved.path):
        found = checkpoint.rebuild(WindowState, saved.fields)
        prove(found.model, found.discs)
        proof.require(
            found.model.ring == len(ring.radius), f"the ring has {found.model.ring} discs instead of {len(ring.radius)}"
        )
        proof.shaped("rim.nodes", found.rim.nodes, nodes.shape)
        proof.shaped("rim.sums", found.rim.sums, nodes.shape[:1])
        side.report = saved.said("report", dict)
        side.limits, side.openings, side.changes = (saved.said(key, list) for key in ("limits", "openings", "changes"))
    side.model, side.state = found.model, found.discs
    side.rim = Rim(ring, side.scene.coupling.mapping, found.rim)
    side.answer, side.looked = found.answer, found.looked
    side.inside = found.stage or None
