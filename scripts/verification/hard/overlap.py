"""Strong overlap at the start.

A scene reads 100 discs at random places of a square of side 10 R: their area is more than twice that of the square. *Static*:
they are pushed apart from rest before the first step, so that almost none of the overlap energy, sum kn d^2 / 2, becomes
motion. *Real time* from the start: refused as a mistake of the scene, with a remedy."""

import numpy as np
from scipy.spatial.distance import pdist, squareform

from coupler_protocol.problems import SceneError
from coupler_protocol.process.plugin import from_functions
from verification.discrete import scenes
from verification.discrete.discs import KN
from verification.hard.watched import Watch, look
from verification.verdict_rows import row

NAME = "overlap"
R = 0.03


def crowd():
    """Rows x, y, radius at random."""
    rng = np.random.default_rng(6)
    return np.column_stack([rng.uniform(0.0, 10.0 * R, (100, 2)), rng.uniform(0.7 * R, R, 100)])


def energy_of(discs):
    """Energy of the overlaps [J] of discs (n, 3): x, y, radius."""
    x, radius = discs[:, :2], discs[:, 2]
    depth = np.maximum(radius[:, None] + radius - squareform(pdist(x)), 0.0)[np.triu_indices(len(x), 1)]
    return 0.5 * KN * float(depth @ depth)


def rows(fast):
    """Both."""
    watch = Watch([], [], [], [])
    plugin = from_functions(None, (1, lambda moment: look(watch, moment)))
    apart = {"name": "apart", "kind": "discs", "damping": {"local": 0.7}, "until": {"ratio": 1e-6, "steps": 3000}}
    fly = {"name": "fly", "kind": "discs", "time": "real", "until": {"steps": 500}}
    discs = crowd()
    with scenes.of_file(discs, "x,y,radius", [apart, fly], {"soil": scenes.SOIL}, plugin=plugin, every=10**9) as run:
        kinetic, stored, speed = watch.of("apart")
        way = speed.max() / (0.1 * discs[:, 2].min())
        before = energy_of(discs)
        yield row("static: largest way in a step over a tenth of the smallest radius", way, 1.0, [-0.9999, 1e-12], "as asked for")
        yield row("static: largest energy, kinetic and stored, over that of the overlaps", (kinetic + stored).max() / before, 0.0,
                  1e-4, "they are drawn apart")  # fmt: skip
        yield row("all numbers finite", watch.finite, 1.0, 0.0, "as asked for")
        drawn = run.info["windows"][0]["drawn_apart_steps"]
        yield row("the run says that they were drawn apart", min(drawn, 1), 1.0, 0.0, "as asked for")
    refused = 0
    try:
        with scenes.of_file(discs, "x,y,radius", [fly], {"soil": scenes.SOIL}, every=10**9):
            pass
    except SceneError as error:
        refused = "static stage" in str(error)
    yield row("real time: ends with the advice to begin with a static stage", refused, 1.0, 0.0, "as asked for")
