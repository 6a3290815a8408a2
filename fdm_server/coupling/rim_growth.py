"""What goes wrong at an interface, seen from the grid: motion that grows by itself from step to step, and power that gets lost.

Growth. In leap-frog a mode of frequency omega goes on as v(n+1/2) = z v(n-1/2), z + 1/z = 2 - omega^2 dt^2: where omega dt > 2
it leaves the unit circle along the negative real axis (Courant, Friedrichs & Lewy 1928, Math. Ann. 100, 32-74; Hughes 1987,
The Finite Element Method, section 9.1). So springs too stiff for the masses of a rim show as motion that turns round in
every step and grows:

    v+ . v- < -.9 |v+| |v-|,    |v+| > |v-|                                            (1)

over all gridpoints of a rim, several steps in a row. Stable modes turn round like this only near the limit, and there they swell
and fade but do not grow; waves, slides and impacts do not turn round. Twice the largest |v| of the steps before (1) began
(FADE a step) is worth a warning; the run ends before the next step would make it more than four times what it was at the warning.

Mismatch. P.v over the gridpoints is what the discs see on their side, to round-off with the work-consistent mapping
(coupler_protocol/interface/mapping.py). The discs' number of a step comes with the forces two steps later.
"""

from math import sqrt

import numpy as np

from fdm_server.step.safety import Unstable

REVERSED, LEAST, FAST = 0.9, 3, 1.3  # cosine; steps in a row where a step makes |v| so many times larger, twice as many elsewhere
NOTICED, TOO_MUCH, FADE = 2.0, 4.0, 0.98  # growth of |v| since (1) began, since the warning; what a step leaves of a past |v|
STILL = 1e-12  # way in a step, over the rim's size, below which motion is round-off
MISMATCH, WRONG = 1e-9, 3  # of sum |P||v|; looks in a row that end the run
DELAY = 2  # steps from a step to the forces that tell the discs' power in it


class GrowthWatch:
    """Eq (1) for the rim `rim` (fdm_server.coupling.rim.Rim); warn(name, text) hears of it."""

    def __init__(self, rim, warn):
        self.rim, self.warn = rim, warn
        self.floor = STILL * float(np.ptp(rim.xy, axis=0).max()) * len(rim.nodes) ** 0.5
        self.last = np.zeros(2 * len(rim.nodes))
        self.size = self.peak = 0.0  # |v-|, largest |v| of steps past
        self.steps, self.begin, self.noticed = 0, 0.0, None  # steps of (1) in a row, peak before them, |v| at the warning

    def check(self, velocity, dt):
        """Look at the velocities (2K,) [m/s] of a step of dt [s]. Raises Unstable."""
        product, size, before = float(velocity @ self.last), sqrt(float(velocity @ velocity)), self.size
        peak = self.peak
        self.last[:], self.size, self.peak = velocity, size, max(size, FADE * peak)
        if not product < -REVERSED * size * before or size <= before or size * dt <= self.floor:
            self.steps, self.noticed = 0, None
            return
        self.begin = self.begin if self.steps else peak
        self.steps += 1
        if self.steps >= (LEAST if size > FAST * before else 2 * LEAST) and size > NOTICED * self.begin:
            self._noticed(size, size / before)

    def _noticed(self, size, ratio):
        text = (
            f"the rim of window {self.rim.window.name!r} reverses in every step and has grown {size / self.begin:.3g}-fold "
            f"in {self.steps} steps: its contacts are too stiff for its masses, or the step is too long"
        )
        if self.noticed is None:
            self.noticed = size
            self.warn("growth", text)
        if size * ratio > TOO_MUCH * self.noticed:
            raise Unstable(f"growth: {text}")


class PowerWatch:
    """Power at the rim `rim` as both sides see it, of every step that is a multiple of `every`; warn(name, text) hears of it."""

    def __init__(self, rim, every, warn):
        self.rim, self.every, self.warn = rim, every, warn
        self.awaited = []  # (step, power, scale) that the discs have not told theirs of
        self.wrong = 0  # looks in a row

    def check(self, velocity, step):
        """After the velocities (2K,) [m/s] of a step, the `step`-th of the run. Raises Unstable."""
        if self.awaited and self.awaited[0][0] + DELAY == step:
            self._compare(*self.awaited.pop(0))
        if step % self.every == 0:
            force = self.rim.force.ravel()
            self.awaited.append((step, float(force @ velocity), float(np.abs(force) @ np.abs(velocity))))

    def _compare(self, step, power, scale):
        theirs = self.rim.answer.power
        self.wrong = 0 if abs(power - theirs) <= MISMATCH * scale else self.wrong + 1
        if not self.wrong:
            return
        text = (
            f"the rim of window {self.rim.window.name!r} took {power:.6g} W in step {step}, its discs gave {theirs:.6g} W: "
            f"forces and velocities do not match"
        )
        self.warn("mismatch", text)
        if self.wrong >= WRONG:
            raise Unstable(f"mismatch: {text}")


class RimWatch:
    """Both for one rim in a coupled stage. kept: power is; neither the paper's mapping nor forces held over steps keep it."""

    def __init__(self, rim, every, kept, warn):
        self.rim = rim
        self.growth = GrowthWatch(rim, warn)
        self.power = PowerWatch(rim, every, warn) if kept else None

    def check(self, dt, step):
        """After the velocities of the `step`-th step, of dt [s], were said. Raises Unstable."""
        velocity = self.rim.before.ravel()
        self.growth.check(velocity, dt)
        if self.power is not None:
            self.power.check(velocity, step)
