"""Up to 50 steps between exchanges, with contacts too stiff for them.

A sector of a ring of elastic ground under its weight, and a window of bonded discs with oblique sides, coupled as in
`colluvium run`, in static mode; contacts are up to 300 times as stiff as zones (k/K: kn over K + 4G/3). Forces held constant
over several steps then add more energy than damping can remove ([theory](theory.md), *Pauses between exchanges*). The
unmodified code must detect the stiffness and make no pause. Then that limit is disabled and only the monitor remains: it must
detect the growing motion and return to an exchange in every step before the largest speed of all gridpoints and discs is ten
times that of the same stage without pauses. Without the monitor, the run ends by itself with a message (damping may be
sufficient for pauses of 2 or 3 steps). If contacts are softer than zones, pauses continue to the end. In comparisons with no
pauses, the largest speed must be at least half as large."""

import tempfile
from contextlib import contextmanager

import numpy as np

import colluvium
from coupler_protocol.exits import PhysicsFailed
from fdm_server.coupling import exchange_pauses
from verification.hard import coupled_system
from verification.verdict_rows import row

NAME = "pauses"
SOURCE = "as asked for"
INTERVALS = {True: (5, 50), False: (2, 3, 5, 10, 20, 50)}  # by `fast`
STIFF = {True: (30.0,), False: (3.0, 30.0, 300.0)}
SOFT, STEPS = 0.02, 600


def tables(stiffness, every):
    """Tables of the scene with a longest pause of `every` steps."""
    found = coupled_system.scene(stiffness, 0.1, 0.8, oblique=True).model_dump(mode="json", exclude_none=True)
    found["discs"]["damping"] = {"local": 0.7}
    found["coupling"] = {"exchange_every": every}
    found["record"] = {"every": 100_000, "history": 10}
    found["stage"] = [
        {"name": "equilibrium", "gravity": 9.81, "until": {"steps": 400}},
        {"name": "fill"},
        {"name": "couple", "handover": 100, "until": {"steps": STEPS}},
    ]
    return found


def coupled(stiffness, every):
    """Largest speed [m/step] of gridpoints and discs in the coupled stage, and the stage's row of run.json."""
    fastest = [0.0, 0.0]

    def look(moment):
        if moment.stage == "couple":
            velocity = moment.state.v if moment.rank else moment.state.velocity
            fastest[moment.rank] = np.fmax(fastest[moment.rank], np.abs(velocity).max())

    scene = colluvium.Scene(**tables(stiffness, every))
    with tempfile.TemporaryDirectory() as folder, colluvium.run(scene, folder, on_step=(1, look)) as run:
        return max(fastest), run.info["stages"][-1]


@contextmanager
def without(*names):
    """Put limits of fdm_server.coupling.exchange_pauses out of force."""
    kept = {name: getattr(exchange_pauses, name) for name in names}
    try:
        for name in names:
            setattr(exchange_pauses, name, np.inf)
        yield
    finally:
        for name, value in kept.items():
            setattr(exchange_pauses, name, value)


def ends_by_itself(stiffness, every):
    """Whether a run ends with a message about its motion or its discs."""
    try:
        coupled(stiffness, every)
    except PhysicsFailed:
        return True
    return False


def rows(fast):
    """Full: pauses of 2 to 50 steps at k/K 3 to 300; fast: 5 and 50 at 30."""
    intervals = INTERVALS[fast]
    long = [every for every in intervals if every >= 5]
    for stiffness in STIFF[fast]:
        name, usual = f"k/K {stiffness:g}, every {intervals[0]} to {intervals[-1]} steps", coupled(stiffness, 1)[0]
        found = [coupled(stiffness, every) for every in intervals]
        exchanges = min(stage["exchanges"] for _, stage in found)
        yield row(f"{name}: least number of exchanges in {STEPS} steps", exchanges, STEPS, 0.0, SOURCE)
        with without("STIFFEST"):
            found = {every: coupled(stiffness, every) for every in intervals}
        fastest = max(speed for speed, _ in found.values()) / usual
        yield row(f"{name}, monitor alone: largest speed over that without pauses", fastest, 1.0, [-0.5, 9.0], SOURCE)
        name = f"k/K {stiffness:g}, every {long[0]} to {long[-1]} steps"
        back = sum("grew by itself" in found[every][1]["fell_back"] for every in long)
        yield row(f"{name}, monitor alone: runs that went back", back, len(long), 0.0, SOURCE)
        with without("STIFFEST", "GROWTH"):
            ended = sum(ends_by_itself(stiffness, every) for every in long)
        yield row(f"{name}, no monitor: runs that ended by themselves", ended, len(long), 0.0, SOURCE)
    usual, found = coupled(SOFT, 1)[0], [coupled(SOFT, every) for every in intervals]
    name = f"k/K {SOFT:g}, every {intervals[0]} to {intervals[-1]} steps"
    fastest = max(speed for speed, _ in found) / usual
    yield row(f"{name}: largest speed over that without pauses", fastest, 1.0, [-0.5, 9.0], SOURCE)
    yield row(f"{name}: runs that went back", sum(bool(stage["fell_back"]) for _, stage in found), 0.0, 0.0, SOURCE)
    exchanges, name = found[-1][1]["exchanges"], f"k/K {SOFT:g}, every {intervals[-1]} steps"
    fewest = [10.0 / intervals[-1] - 1.0, 0.0]  # no pause is longer than was asked for
    yield row(f"{name}: exchanges in {STEPS} steps, over a tenth of them", 10.0 * exchanges / STEPS, 1.0, fewest, SOURCE)
