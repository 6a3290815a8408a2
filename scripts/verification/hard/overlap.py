"""Strong overlap at the start.

A scene reads 100 discs at random places of a square of side 10 R: their area is more than twice its own. *Static*: speeds are
capped at a tenth of the smallest radius a step, and the crowd comes apart calmly, to rest. *Real time* from the start: refused,
with what would be right.
"""

import numpy as np

from coupler_protocol.exits import PhysicsFailed
from coupler_protocol.plugin import from_functions
from verification.discrete import scenes
from verification.hard.watched import Watch, look
from verification.rows import row

NAME = "overlap"
R = 0.03


def crowd():
    """Rows x, y, radius at random."""
    rng = np.random.default_rng(6)
    return np.column_stack([rng.uniform(0.0, 10.0 * R, (100, 2)), rng.uniform(0.7 * R, R, 100)])


def rows(fast):
    """Both."""
    watch = Watch([], [], [], [])
    plugin = from_functions(None, (1, lambda moment: look(watch, moment)))
    apart = {"name": "apart", "kind": "discs", "damping": {"local": 0.7}, "until": {"ratio": 1e-6, "steps": 3000}}
    fly = {"name": "fly", "kind": "discs", "time": "real", "until": {"steps": 500}}
    discs = crowd()
    with scenes.of_file(discs, "x,y,radius", [apart, fly], {"soil": scenes.SOIL}, plugin=plugin, every=10**9) as run:
        _, stored, speed = watch.of("apart")
        way = speed.max() / (0.1 * discs[:, 2].min())
        yield row("static: largest way in a step over a tenth of the smallest radius", way, 1.0, [-1.0, 1e-12], "as asked for")
        yield row("static: stored energy at the end over that at the start", stored[-1] / stored[0], 0.0, 1e-6, "they come apart")
        yield row("all numbers finite", watch.finite, 1.0, 0.0, "as asked for")
        capped = run.history("velocity_caps", 1)[1][-1]
        yield row("speeds capped, as the history says", min(capped, 1.0), 1.0, 0.0, "as asked for")
    refused = 0
    try:
        with scenes.of_file(discs, "x,y,radius", [fly], {"soil": scenes.SOIL}, every=10**9):
            pass
    except PhysicsFailed as error:
        refused = "static stage" in str(error)
    yield row("real time: ends with the advice to begin with a static stage", refused, 1.0, 0.0, "as asked for")
