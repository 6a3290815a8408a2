"""Messages. The discrete side sends first, the continuum answers; docs/protocol.md has the conversation and the bytes.

    discrete                          continuum
    HELLO     scene, versions, rank   WELCOME   interface, clocks       or REJECT with a reason
    PACKED    report of the packing   FIELD     stress of the zones that become a hole
    READY     half masses at nodes    GO        gravity of the first step
    FORCE     forces at rim nodes     VELOCITY  velocities of rim nodes      once a step
    FORCE                             STOP      reason for the end
    FAREWELL  timings

If the discrete side has checkpoints, HELLO has the key `checkpoints`, their moments. If both sides have one of the same moment,
WELCOME has the newest such moment as `resume`, and both continue from there. If the discs existed then, PACKED and FIELD are left
out; if both sides were coupled, GO follows READY immediately.

The first FORCE of a stage in real time contains the longest step of the discs, and the VELOCITY that answers it the step of the
stage.

If the discrete side can use a lane (lanes.py), HELLO has the key `lane`, the port to which it is connected; if the continuum can,
too, and that is its own port, WELCOME has the port and the token by which the lane is opened.

A side that computes for long outside of steps says PROGRESS now and then, without turn and answer: it lives.

If a stage may end by the state of the band, GO contains the length of bins (key `bin`), and the FORCE after a VELOCITY with the
flag STRAIN also contains the window's strain in such bins (coupler_protocol.criteria.strain_bins.as_rows).
"""

from typing import Any, NamedTuple

PROTOCOL_VERSION = 4

HELLO, WELCOME, REJECT, PACKED, FIELD, READY, GO, FORCE, VELOCITY, STOP, FAREWELL, FAILURE, PROGRESS = range(1, 14)

NAMES = (
    "?", "HELLO", "WELCOME", "REJECT", "PACKED", "FIELD", "READY", "GO", "FORCE", "VELOCITY", "STOP", "FAREWELL",
    "FAILURE", "PROGRESS",
)  # fmt: skip
ONE_WAY = (FAILURE, REJECT)  # without an answer; they end the run
SESSIONLESS = (HELLO, REJECT, FAILURE)  # possible before a session is agreed

# Required content of control messages: key -> type, [rows of a list]. A float may be written as an integer.
CONTENT = {
    HELLO: {"package": str, "float": str, "scene": dict},
    WELCOME: {"session": int, "run": int, "rim": bytes, "dt": float, "exchange_every": int},
    REJECT: {"reason": str},
    PACKED: {},
    FIELD: {"field": bytes, "gravity": float, "insitu": bool},
    READY: {"inner_mass": bytes, "report": dict},
    GO: {"gravity": float, "step": int, "time": float, "stage": int},
    STOP: {"reason": str},
    FAREWELL: {"report": dict, "stages": [{"name": str, "computing": float, "waiting": float, "recording": float}]},
    FAILURE: {"reason": str},
    PROGRESS: {"doing": str},
}

MOMENT = {"session": int, "stage": int, "step": int}  # of coupler_protocol.scene.moments

# Optional content, with its types.
OPTIONAL: dict[int, dict[str, Any]] = {
    HELLO: {"lane": int, "checkpoints": [MOMENT]},
    WELCOME: {"lane": {"port": int, "token": bytes}, "resume": MOMENT, "surface": bytes},
    GO: {"bin": float},
}

RECORD, END_OF_STAGE, CHECKPOINT, STRAIN = 1, 2, 4, 8


class Order(NamedTuple):
    """Scalars of VELOCITY: the step, and actions after it."""

    stage: float  # index of the stage
    step: float  # steps since the run began, this one included
    gravity: float  # [m/s2] for the NEXT step (the discrete side moves its free discs before the next VELOCITY)
    gravity_factor: float  # of this step
    dt: float  # [s], 1 in static mode; the same for all steps of a stage
    interval: float  # steps since the last exchange, this one included: the velocities are their means
    flags: float  # RECORD | END_OF_STAGE | CHECKPOINT | STRAIN


class Answer(NamedTuple):
    """Scalars of FORCE: condition of the discs."""

    ratio: float  # unbalanced force ratio of the free discs, at the last step with histories
    dt_limit: float  # [s] longest step of the discs at the beginning of the stage; 1 in static mode
    kinetic: float  # [J] (in scaled masses in static mode)
    stored: float  # [J] in contact springs
    power: float  # [W] sum of P.v over the rim on the side of the discs: P at the beginning of the step, v in it
    broken: float  # bonds broken since the window was filled
    warnings: float  # count of capped velocities and the like
    height: float  # [kg m] sum over the free discs of weight (as mass) times y
    stop: float = 0.0  # 1: the discs are asked to stop, and wait for an order to write a checkpoint; else 0
