"""One message of every kind with fixed content, as version 4 of the protocol writes them."""

import numpy as np

from coupler_protocol.wire import frames as wire
from coupler_protocol.wire import messages

SESSION, RANK = 0x1122334455667788, 2
RIM = np.array([[1.0, 2.0], [1.5, 2.0], [1.5, 2.5], [1.0, 2.5]])
FIELD = np.array([[1.25, 2.25, 0.25, -1.5e5, -3.0e5, 2.0e3, 2700.0]])
FORCES = np.array([0.1, -0.0, 5e-324, 1.7976931348623157e308, -1e-300, 3.0, 1 / 3, -2.5e4, 1e7, 2e7, 3e7, 4e7])
VELOCITIES = np.array([1e-9, -1e-9, 2.2250738585072014e-308, 0.0, -0.0, 1 / 7, 9.0, -1e-17])
WITH_STRAIN = np.concatenate((FORCES, [1.25, 2.25, 0.0125, 1.25, 2.75, -1.0]))  # of two bins, the second without discs
ANSWER = messages.Answer(1e-5, 1.0, 0.25, 12.5, -3.0, 17.0, 0.0, 640.0, 1.0)
ORDER = messages.Order(3.0, 4711.0, 9.81, 1.5, 1.0, 1.0, 5.0)
HELLO_CONTENT = {"package": "0.1.0", "float": "<f8"}
WELCOME_CONTENT = {"session": SESSION, "run": 0x3F2A9C1E77B0, "rim": wire.pack_array(RIM)}
SCENE = {"seed": 1, "grid": {"profile": None}, "stage": [{"to": 9.0}]}
MOMENT = {"session": 2**40, "stage": 2, "step": 900}
GO_CONTENT = {"gravity": 9.81, "step": 400, "time": 400.0, "stage": 2}
GO_WITH_BIN = GO_CONTENT | {"bin": 0.5}
TIMES = {"name": "couple", "steps": 9, "computing": 1.5, "waiting": 0.5, "recording": 0.0}

# (kind, session, sequence, content): those with a content of their own are control messages.
CONTROL = (
    (messages.HELLO, 0, 0, HELLO_CONTENT | {"scene": SCENE, "checkpoints": [MOMENT]}),
    (messages.WELCOME, SESSION, 0, WELCOME_CONTENT | {"dt": 1.0, "exchange_every": 1, "resume": MOMENT}),
    (messages.REJECT, 0, 0, {"reason": "the scenes differ: seed"}),
    (messages.PACKED, SESSION, 1, {"discs": 749, "control_discs": 120, "packing_seconds": 0.5}),
    (messages.FIELD, SESSION, 1, {"field": wire.pack_array(FIELD), "gravity": 9.81, "insitu": True}),
    (messages.READY, SESSION, 2, {"inner_mass": wire.pack_array(np.full(4, 0.125)), "report": {"porosity": 0.16, "sweeps": 3}}),
    (messages.GO, SESSION, 2, GO_CONTENT),
    (messages.STOP, SESSION, 2**40, {"reason": "all stages done"}),
    (messages.FAREWELL, SESSION, 2**40 + 1, {"report": {}, "stages": [TIMES], "velocities_capped": 0}),
    (messages.FAILURE, SESSION, 7, {"reason": "a zone turned inside out — µ"}),
    (messages.PROGRESS, SESSION, 1, {"doing": "discs come to rest 35 %"}),
)  # fmt: skip
STEPS = ((messages.FORCE, ANSWER, FORCES), (messages.VELOCITY, ORDER, VELOCITIES))


def step_frame(kind, scalars, values):
    """An empty frame of the right size."""
    return wire.StepFrame(kind, SESSION, RANK, len(scalars), len(values))


def written():
    """{name: bytes} of the whole exchange, as today's code writes it."""
    frames = {messages.NAMES[k]: bytes(wire.control_frame(k, session, RANK, n, content)) for k, session, n, content in CONTROL}
    for kind, scalars, values in STEPS:
        frame = step_frame(kind, scalars, values)
        frame.scalars[:], frame.values[:] = scalars, values
        frames[messages.NAMES[kind]] = bytes(frame.seal(4711))
    frames["FORCE again"] = bytes(wire.sent_again(frames["FORCE"]))
    asked = step_frame(messages.FORCE, ANSWER, WITH_STRAIN)
    asked.scalars[:], asked.values[:] = ANSWER, WITH_STRAIN
    frames["FORCE with strain"] = bytes(asked.seal(4712))
    frames["GO with bin"] = bytes(wire.control_frame(messages.GO, SESSION, RANK, 2, GO_WITH_BIN))
    return frames
