"""Discs of a size ratio of twenty, shot against the rim of a coupled window.

`tests/hard/fast_rim.toml`: 24 discs of r = 0.02 m about one of 0.4 m, in a window of elastic zones, without friction; in the
first step in real time every small disc gets a speed in a direction at random, and nothing damps. A spring k between a disc of
mass m and a control disc keeps their centres apart by the radius of the control disc if the speed is below r sqrt(k/m).
*Below*, at half of that speed: after the impacts all discs are inside the ring, and the discs have the energy of the shot (the
zones take little of it). *Beyond*, at 1.3 times that speed, where no step is too long but springs are too soft, and at ten
times, the run must end with exit code 6, name a disc, and save both sides."""

import re
import tempfile

import numpy as np
import shapely

import colluvium
from coupler_protocol.exits import PHYSICS
from dem_server.observe.energy import kinetic
from dem_server.pairs import contacts
from verification.hard.runs import ended, saved
from verification.hard.watched import scene_of
from verification.verdict_rows import row

NAME = "rim impacts"
SMALL, COUNT = 0.02, 25
SPRING = 2.5e7  # of a contact [N/m]


class Shot:
    """Shoots the small discs in the first step of the stage fly and follows them; a plugin."""

    def __init__(self, share):
        self.share, self.begun, self.given, self.impacts, self.touched = share, False, 0.0, 0, 0
        self.deepest, self.inside, self.finite = 0.0, 0, True

    def __call__(self, moment):
        """One step of the discs."""
        if moment.rank == 0 or moment.stage != "fly":
            return
        model, state, R = moment.model, moment.state, moment.model.ring
        if not self.begun:
            small = R + np.flatnonzero(state.radius[R:] < 2.0 * SMALL)
            turn = np.random.default_rng(1).uniform(0.0, 2.0 * np.pi, len(small))
            speed = self.share * SMALL * (SPRING / state.mass[small].max()) ** 0.5
            state.v[small], self.begun = speed * np.column_stack([np.cos(turn), np.sin(turn)]), True
            self.given = kinetic(model, state)
        pairs = contacts(state)
        self.impacts, self.touched = self.impacts + max(0, len(pairs.gap) - self.touched), len(pairs.gap)
        self.deepest = max(self.deepest, float(-pairs.gap.min(initial=0.0)))
        self.inside = int(shapely.contains_xy(shapely.Polygon(state.x[:R]), *state.x[R:].T).sum())
        self.finite &= bool(np.isfinite(state.disc).all())


def shot(share, seconds, folder):
    """The Shot and how its run Ended."""
    seen = Shot(share)
    return seen, ended(scene_of("fast_rim", fly={"time": seconds}), folder, on_step=(1, seen))


def rows(fast):
    """0.2 s of flight below (fast: 0.02 s)."""
    with tempfile.TemporaryDirectory() as folder:
        seen, found = shot(0.5, 0.02 if fast else 0.2, folder)
        with colluvium.open_run(folder) as run:
            error = run.history("energy_error", 1)[1][-1:-20:-1]
    yield row("below: exit code", found.code, 0.0, 0.0, "as asked for")
    yield row("below: impacts, at least", seen.impacts, 5.0, [0.0, 1e6], "as asked for")
    yield row("below: discs inside the ring at the end", seen.inside, COUNT, 0.0, "none passes")
    yield row("below: deepest overlap over the radius of the small discs", seen.deepest / SMALL, 0.0, 0.9, "none passes")
    yield row("below: energy at the end over that of the shot", error.mean() / seen.given, 1.0, 1e-2, "conservation")
    yield row("below: all numbers finite", seen.finite, 1.0, 0.0, "as asked for")
    for share in (1.3, 10.0):
        with tempfile.TemporaryDirectory() as folder:
            _, found = shot(share, 0.02, folder)
            there = saved(folder, "stopped")
        yield row(f"beyond, {share:g} times: exit code", found.code, PHYSICS, 0.0, "as asked for")
        named = re.search(r"disc \d+ ", found.said) is not None
        yield row(f"beyond, {share:g} times: the message names a disc", named, 1.0, 0.0, "as asked for")
        yield row(f"beyond, {share:g} times: sides that saved", there, 2.0, 0.0, "as asked for")
