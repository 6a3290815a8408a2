"""Gravity becomes twenty times as large from one step to the next, in real time without damping.

`tests/hard/twenty_g.toml`: a slope of 45 degrees with a window of bonded discs, at rest under 1 g, far too weak for 20 g. No
point can become faster than a body that falls freely through the height H of the ground,

    |v| <= sqrt(2 g' H),    g' = 20 g,

neither at the yielding gridpoints nor among the discs whose bonds break. The ledgers of both codes (`record.energy`) must
balance: work of weight and rim against kinetic and stored energy and what friction, plasticity and bonds dissipate, over the work
of the weight. A lower limit of the speed rules out a slope that does not move."""

import tempfile

import numpy as np

import colluvium
from verification.hard.runs import ended
from verification.hard.watched import scene_of
from verification.verdict_rows import row

NAME = "twenty g"
HEIGHT, GRAVITY = 6.0, 20.0 * 9.81


def rows(fast):
    """0.1 s (fast: 0.01 s)."""
    fastest = [0.0, 0.0]

    def look(moment):
        if moment.stage == "step":
            v = moment.state.v if moment.rank else moment.state.velocity
            fastest[moment.rank] = np.fmax(fastest[moment.rank], float(np.hypot(*v.T).max()))

    with tempfile.TemporaryDirectory() as folder:
        found = ended(scene_of("twenty_g", step={"time": 0.01 if fast else 0.1}), folder, on_step=(5, look))
        errors = errors_of(folder)
    bound = (2.0 * GRAVITY * HEIGHT) ** 0.5
    yield row("exit code", found.code, 0.0, 0.0, "as asked for")
    for side, speed in zip(("gridpoint", "disc"), fastest, strict=True):
        yield row(f"largest speed of a {side} over sqrt(2 g' H)", speed / bound, 1.0, [-0.99, 0.0], "free fall")
    for side, error in zip(("grid", "discs"), errors, strict=True):
        yield row(f"energy of the {side} that nothing explains, over the work of its weight", error, 0.0, 1e-4, "conservation")


def errors_of(folder):
    """Largest error of the ledger of each side over the largest work of its weight; each stage begins a new ledger."""
    found = []
    with colluvium.open_run(folder) as run:
        steps, factor = run.history("gravity_factor")
        begin = steps[factor > 1.5].min()
        for rank in (0, 1):
            steps, error = run.history("energy_error", rank)
            last = steps >= begin
            found.append(np.abs(error[last]).max() / np.abs(run.history("energy_gravity", rank)[1][last]).max())
    return found
