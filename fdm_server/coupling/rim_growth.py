"""Watches of an interface on the side of the grid: unstable growth of the motion, and mismatch of power.

Growth. In leap-frog a mode of frequency omega evolves as v(n+1/2) = z v(n-1/2), z + 1/z = 2 - omega^2 dt^2. For omega dt > 2,
z leaves the unit circle along the negative real axis (Courant, Friedrichs & Lewy 1928, Math. Ann. 100, 32-74; Hughes 1987,
The Finite Element Method, section 9.1). So springs that are too stiff for the masses of a rim cause a motion that reverses in
every step and grows:

    v+ . v- < -0.9 |v+| |v-|,    |v+| > |v-|                                           (1)

over all gridpoints of a rim, several steps in a row. Stable modes reverse in every step only near the limit, and there their
amplitude varies but does not grow; waves, slides and impacts do not reverse in every step. A warning follows when |v| reaches
twice the largest |v| of the steps before (1) began (which decays by FADE a step). The run ends before the next step would make
|v| more than four times that at the warning.

Mismatch. The power P.v over the gridpoints equals that of the discs, to round-off with the work-consistent mapping
(coupler_protocol/interface/mapping.py). The discs' power of a step arrives with the forces two steps later.
"""

from math import sqrt

import numpy as np

from fdm_server.step.safety import Unstable

REVERSED, LEAST, FAST = 0.9, 3, 1.3  # cosine; steps in a row if a step increases |v| by the factor FAST, else twice as many
NOTICED, TOO_MUCH, FADE = 2.0, 4.0, 0.98  # growth of |v| since (1) began, since the warning; decay of past |v| in a step
STILL = 1e-12  # path in a step, over the rim's size, below which motion is round-off
MISMATCH, WRONG = 1e-9, 3  # of sum |P||v|; mismatches in a row that end the run
DELAY = 2  # steps from a step to the FORCE with the discs' power in that step


class GrowthWatch:
    """Watch of Eq (1) for the rim `rim` (fdm_server.coupling.rim.Rim); calls warn(name, text)."""

    def __init__(self, rim, warn):
        self.rim, self.warn = rim, warn
        self.floor = STILL * float(np.ptp(rim.xy, axis=0).max()) * len(rim.nodes) ** 0.5
        self.last = np.zeros(2 * len(rim.nodes))
        self.size = self.peak = 0.0  # |v-|, largest |v| of steps past
        self.steps, self.begin, self.noticed = 0, 0.0, None  # steps of (1) in a row, peak before them, |v| at the warning

    def check(self, velocity, dt):
        """Checks the velocities (2K,) [m/s] of a step of dt [s]. Raises Unstable."""
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
    """Watch of the power of both sides at the rim `rim`, in every step that is a multiple of `every`; calls warn(name, text)."""

    def __init__(self, rim, every, warn):
        self.rim, self.every, self.warn = rim, every, warn
        self.awaited = []  # (step, power, scale) for which the discs' power has not arrived
        self.wrong = 0  # mismatches in a row

    def check(self, velocity, step):
        """Checks the power with the velocities (2K,) [m/s] of the `step`-th step of the run. Raises Unstable."""
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
    """Both watches for one rim in a coupled stage. kept: power is conserved, but not by the paper's mapping or held forces."""

    def __init__(self, rim, every, kept, warn):
        self.rim = rim
        self.growth = GrowthWatch(rim, warn)
        self.power = PowerWatch(rim, every, warn) if kept else None

    def check(self, dt, step):
        """Checks the velocities of the `step`-th step, of dt [s], after they were sent. Raises Unstable."""
        velocity = self.rim.before.ravel()
        self.growth.check(velocity, dt)
        if self.power is not None:
            self.power.check(velocity, step)
