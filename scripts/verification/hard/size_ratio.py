"""Discs with a size ratio of twenty.

A scene: a disc of 0.2 m falls into a bed of 240 discs of 0.01 to 0.02 m between three walls; static mode lets the bed settle
under gravity, then the large disc hits it at 3 m/s in real time, with friction and without damping."""

import numpy as np

from coupler_protocol.process.plugin import from_functions
from verification.discrete import scenes
from verification.hard.watched import Watch, look
from verification.verdict_rows import row

NAME = "size ratio"
LARGE, SMALL, COLUMNS, LAYERS = 0.2, 0.01, 24, 10
WIDTH = 2.6 * 0.02 * COLUMNS


def bed():
    """Rows x, y, radius, vx, vy, spin: the bed at random, the large disc above it."""
    rng = np.random.default_rng(2)
    x, y = np.meshgrid((np.arange(COLUMNS) + 0.5) * WIDTH / COLUMNS, 0.025 + 0.045 * np.arange(LAYERS))
    small = np.column_stack([x.ravel(), y.ravel(), rng.uniform(SMALL, 2.0 * SMALL, x.size)])
    return np.vstack([small, [0.5 * WIDTH, 0.9, LARGE]])


def rows(fast):
    """.1 s of the impact (fast: .02 s)."""
    discs = bed()
    ends = [[[-1.0, 0.0], [WIDTH + 1.0, 0.0]], [[0.0, -1.0], [0.0, 3.0]], [[WIDTH, -1.0], [WIDTH, 3.0]]]
    settle = {"name": "settle", "kind": "discs", "gravity": 9.81, "damping": {"local": 0.7}}
    settle["until"] = {"ratio": 1e-3, "steps": 4000}
    hit = {"name": "hit", "kind": "discs", "time": "real", "gravity": 9.81, "until": {"time": 0.02 if fast else 0.1}}
    watch, seen = Watch([], [], [], []), {}

    def stage(moment):
        state = moment.state
        if moment.stage == "settle":
            big = int(np.argmax(state.radius))
            state.x[big] = 0.5 * WIDTH, state.x[:big, 1].max() + LARGE + 0.03

    def step(moment):
        state = moment.state
        if moment.stage == "hit" and not seen:
            big = int(np.argmax(state.radius))
            state.v[big] = 0.0, -3.0
            seen["energy"] = 0.5 * state.weight[big] * 9.0 + 9.81 * state.weight @ (state.x[:, 1] - state.radius)
        look(watch, moment)

    plugin = from_functions(stage, (20, step))
    table = {"soil": scenes.SOIL, "wall": [{"ends": e} for e in ends]}
    with scenes.of_file(discs, "x,y,radius", [settle, hit], table, plugin=plugin, every=10**9) as run:
        x = run.discs(-1).xy
        inside = (x[:, 1] > 0.0) & (x[:, 0] > 0.0) & (x[:, 0] < WIDTH)
        yield row("discs between the walls at the end", inside.sum(), len(discs), 0.0, "none passes")
        kinetic, stored, _ = watch.of("hit")
        most = (kinetic + stored).max() / seen["energy"]
        yield row("largest kinetic and stored energy over all there is", most, 1.0, [-1.0, 0.01], "conservation")
        deepest = overlap_of(run)
        yield row("deepest overlap over the smallest radius", deepest, 0.0, 0.5, "none passes")
        yield row("all numbers finite", watch.finite, 1.0, 0.0, "as asked for")


def overlap_of(run):
    """Deepest overlap of the last frame over the smaller radius."""
    discs, contacts = run.discs(-1), run.contacts(-1)
    a, b = contacts.ends.T
    gap = np.hypot(*(discs.xy[b] - discs.xy[a]).T) - discs.radius[a] - discs.radius[b]
    return float((-gap / np.minimum(discs.radius[a], discs.radius[b])).max(initial=0.0))
