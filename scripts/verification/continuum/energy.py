"""The energy ledger is balanced.

Histories of `record.energy`: kinetic, strain, plastic, damping, external, gravity, and the unexplained remainder. A body of 4
m x 3 m (K = 0.5 GPa, G = 0.15 GPa, rho = 2700 kg/m3) on a smooth base gets its weight at once:

    without damping, in real time:    kinetic + strain = work of the weight, in every step (the discrete energy of the leap-frog)
    with local damping, at rest:      strain = damping = half the work of the weight (a linear body under a sudden load)

A rough strip footing on Tresca soil is pushed 60 mm down (see strip footing): the external work is the reaction times the
displacement, taken here from the history of the reaction; except for the stored part, all of it goes into plastic flow and
damping."""

import numpy as np

from verification import as_a_run
from verification.continuum import footing
from verification.verdict_rows import row

NAME = "energy"
SOURCE = "conservation of energy"
PARTS = ("kinetic", "strain", "plastic", "damping", "external", "gravity", "error")
LOOK = 10  # steps between points of the histories
RECORD = {"every": 10**9, "history": LOOK, "energy": True}


def kept(tables, *more):
    """Histories of all parts, and of `more`."""
    found = as_a_run.compute(tables | {"record": RECORD}, [*(f"energy_{part}" for part in PARTS), *more])
    return {name.removeprefix("energy_"): values for name, values in found.histories.items()}


def weighed(damping, **stage):
    """The body that gets its weight at once; stage: how it is computed."""
    return as_a_run.tables(
        {"kind": "box", "length": 4.0, "height": 3.0, "zone_size": 0.5},
        as_a_run.material(0.5e9, 0.15e9, 2700.0),
        [{"name": "weight", "kind": "load", "gravity": 9.81} | stage],
        [{"on": "bottom", "fix": "y"}, {"on": "left", "fix": "x"}],
        damping=damping,
    )


def rows(fast):
    """1 s of free motion (fast: .2 s), rest, and the footing on a/8 (fast: a/4)."""
    free = kept(weighed({"local": 0.0}, time="real", until={"time": 0.2 if fast else 1.0}))
    scale = np.abs(free["gravity"]).max()
    yield row("undamped: largest error over the work", np.abs(free["error"]).max() / scale, 0.0, 1e-12, SOURCE)
    loss = np.abs(free["kinetic"] + free["strain"] - free["gravity"]).max() / scale
    yield row("undamped: kinetic + strain - weight", loss, 0.0, 1e-12, SOURCE)
    rest = kept(weighed({"local": 0.8}, until={"ratio": 1e-8}))
    work = rest["gravity"][-1]
    yield row("at rest: strain over work", rest["strain"][-1] / work, 0.5, 1e-5, SOURCE)
    yield row("at rest: damping over work", rest["damping"][-1] / work, 0.5, 1e-5, SOURCE)
    parts, velocity = (4, 5e-6) if fast else (8, 5e-6)
    pushed = kept(footing.scene(parts, 0.0, (5.0, 3.0), 0.06, velocity), "reaction_y:footing")
    work = pushed["external"][-1]
    yield row("footing: largest error over the work", np.abs(pushed["error"]).max() / work, 0.0, 1e-2, SOURCE)
    force = -pushed["reaction_y:footing"]
    ways = np.minimum(LOOK * np.arange(1, len(force) + 1) / footing.OVER, 1.0) * velocity * LOOK
    yield row("footing: external work over reaction times way", work / (force * ways).sum(), 1.0, 1e-2, SOURCE)
    spent = sum(pushed[part][-1] for part in ("plastic", "damping", "strain", "kinetic"))
    yield row("footing: plastic, damping, stored over the work", spent / work, 1.0, 1e-2, SOURCE)
