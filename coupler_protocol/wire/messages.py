"""What is said. The discrete side speaks first, the continuum answers; docs/protocol.md shows the conversation and the bytes.

    discrete                          continuum
    HELLO     scene, versions, rank   WELCOME   interface, clocks       or REJECT with a reason
    PACKED    what the packing is     FIELD     stress of the zones that become a hole
    READY     half masses at nodes    GO        gravity of the first step
    FORCE     forces at rim nodes     VELOCITY  velocities of rim nodes      once a step
    FORCE                             STOP      why the run ends
    FAREWELL  timings

A run that goes on from the end of a stage says so in HELLO (key `resume`). Where the discs existed then, PACKED and FIELD are
left out; where both sides were coupled, GO follows READY at once.

The first FORCE of a stage in real time says how long a step the discs can take, the VELOCITY that answers it how long the
steps of the stage are.

Where a stage may end by the state of the band, GO says how long bins are (key `bin`), and the FORCE that answers a VELOCITY with
the flag STRAIN carries the window's strain in such bins as well (coupler_protocol.criteria.strain_bins.as_rows).
"""

from typing import NamedTuple

PROTOCOL_VERSION = 3

HELLO, WELCOME, REJECT, PACKED, FIELD, READY, GO, FORCE, VELOCITY, STOP, FAREWELL, FAILURE = range(1, 13)

NAMES = (
    "?", "HELLO", "WELCOME", "REJECT", "PACKED", "FIELD", "READY", "GO", "FORCE", "VELOCITY", "STOP", "FAREWELL",
    "FAILURE",
)  # fmt: skip
ONE_WAY = (FAILURE, REJECT)  # ask for no answer
SESSIONLESS = (HELLO, REJECT, FAILURE)  # may come before a session is agreed

# What a control message must hold, at least: key -> type, [rows of a list]. A float may be written as an integer.
CONTENT = {
    HELLO: {"package": str, "float": str, "scene": dict},
    WELCOME: {"session": int, "rim": bytes, "dt": float, "exchange_every": int},
    REJECT: {"reason": str},
    PACKED: {},
    FIELD: {"field": bytes, "gravity": float, "insitu": bool},
    READY: {"inner_mass": bytes, "report": dict},
    GO: {"gravity": float, "step": int, "time": float, "stage": int},
    STOP: {"reason": str},
    FAREWELL: {"report": dict, "stages": [{"name": str, "computing": float, "waiting": float, "recording": float}]},
    FAILURE: {"reason": str},
}

OPTIONAL = {GO: {"bin": float}}  # what it may hold besides, with the types it has then

RECORD, END_OF_STAGE, CHECKPOINT, STRAIN = 1, 2, 4, 8


class Order(NamedTuple):
    """Scalars of VELOCITY: which step this is and what to do after it."""

    stage: float  # index of the stage
    step: float  # steps since the run began, this one included
    gravity: float  # [m/s2] for the NEXT step (the discrete side moves its free discs before it hears again)
    gravity_factor: float  # of this step
    dt: float  # [s], 1 in static mode; the same for all steps of a stage
    interval: float  # steps since the last exchange, this one included: the velocities are their means
    flags: float  # RECORD | END_OF_STAGE | CHECKPOINT | STRAIN


class Answer(NamedTuple):
    """Scalars of FORCE: how the discs fare."""

    ratio: float  # unbalanced force ratio of the free discs (that of the last look)
    dt_limit: float  # [s] longest step that the discs took into the stage, decided before its first one; 1 in static mode
    kinetic: float  # [J] (in scaled masses in static mode)
    stored: float  # [J] in contact springs
    power: float  # [W] sum of P.v over the rim as the discs see it: P at the beginning of the step, v in it
    broken: float  # bonds broken since the window was filled
    warnings: float  # count of capped velocities and the like
    height: float  # [kg m] sum over the free discs of weight (as mass) times y
