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

from coupler_protocol.compiled.jit import jit
from coupler_protocol.files.kept import Kept, value_of
from fdm_server.step.safety import Unstable

REVERSED, LEAST, FAST = 0.9, 3, 1.3  # cosine; steps in a row if a step increases |v| by the factor FAST, else twice as many
GROWN, TOO_MUCH, FADE = 2.0, 4.0, 0.98  # growth of |v| since (1) began, since the warning; decay of past |v| in a step
CALM, GROWING, NOTICED = range(3)
LAST, PEAK, STEPS, BEGIN, WARNED, RATIO, FOUND = range(7)
STILL = 1e-12  # path in a step, over the rim's size, below which motion is round-off
MISMATCH, WRONG = 1e-9, 3  # of sum |P||v|; mismatches in a row that end the run
DELAY = 2  # steps from a step to the FORCE with the discs' power in that step
IN_A_ROW, NEW, THEN, OURS, THEIRS = range(5)  # of the verdict of `watch_power`


@jit
def watch_growth(velocity, before, size, floor, dt):
    """Watches a step of dt [s] for Eq (1): CALM, GROWING or NOTICED. velocity, before (K,2) [m/s]: of this step and of the last.

    size (7,): |v-|, largest |v| of steps past, steps of (1) in a row, peak before them, |v| at the warning (0: none), |v+|/|v-|,
    and what was found. Changes `before` and `size`.
    """
    product = square = 0.0
    for i in range(velocity.shape[0]):
        for axis in range(2):
            v = velocity[i, axis]
            product += v * before[i, axis]
            square += v * v
            before[i, axis] = v
    now, last, peak = sqrt(square), size[LAST], size[PEAK]
    size[LAST], size[PEAK] = now, max(now, FADE * peak)
    if not product < -REVERSED * now * last or now <= last or now * dt <= floor:
        size[STEPS] = size[WARNED] = 0.0
        size[FOUND] = CALM
        return CALM
    if size[STEPS] == 0.0:
        size[BEGIN] = peak
    size[STEPS] += 1.0
    size[RATIO] = now / last
    enough = LEAST if now > FAST * last else 2 * LEAST
    found = NOTICED if size[STEPS] >= enough and now > GROWN * size[BEGIN] else GROWING
    size[FOUND] = found
    return found


class GrowthWatch(Kept):
    """Watch of Eq (1) for the rim `rim` (fdm_server.coupling.rim.Rim); calls warn(name, text)."""

    KEPT = ("before", "size")

    def __init__(self, rim, warn):
        self.rim, self.warn = rim, warn
        self.floor = STILL * float(np.ptp(rim.xy, axis=0).max()) * len(rim.nodes) ** 0.5
        self.before, self.size = np.zeros((len(rim.nodes), 2)), np.zeros(7)

    def check(self, velocity, dt):
        """Checks the velocities (K,2) or (2K,) [m/s] of a step of dt [s]. Raises Unstable."""
        watch_growth(velocity.reshape(-1, 2), self.before, self.size, self.floor, dt)
        self.judge()

    def judge(self):
        """Warns of growth in the last step, or ends the run. Raises Unstable."""
        if self.size[FOUND] != NOTICED:
            return
        size, steps, begin, ratio = (float(self.size[i]) for i in (LAST, STEPS, BEGIN, RATIO))
        text = (
            f"the rim of window {self.rim.window.name!r} reverses in every step and has grown {size / begin:.3g}-fold "
            f"in {steps:.0f} steps: its contacts are too stiff for its masses, or the step is too long"
        )
        if self.size[WARNED] == 0.0:
            self.size[WARNED] = size
            self.warn("growth", text)
        if size * ratio > TOO_MUCH * self.size[WARNED]:
            raise Unstable(f"growth: {text}")


@jit
def watch_power(force, velocity, theirs, step, every, awaited, verdict):
    """Compares the power of a step with that of the discs; returns whether they differ.

    force (K,2) [N], velocity (K,2) [m/s]: of the rim in the `step`-th step of the run, a multiple of `every` (0: no watch);
    theirs [W]: of the last FORCE. awaited (3,3): steps (0: none), powers and scales for which the discs' power has not arrived.
    verdict (5,): mismatches in a row, whether the last comparison was one, its step, and both powers.
    """
    if every == 0:
        return False
    verdict[NEW] = 0.0
    for row in range(awaited.shape[0]):
        then, power, scale = awaited[row, 0], awaited[row, 1], awaited[row, 2]
        if then > 0.0 and then + DELAY <= step:
            awaited[row, 0] = 0.0
            if abs(power - theirs) <= MISMATCH * scale:
                verdict[IN_A_ROW] = 0.0
            else:
                verdict[IN_A_ROW] += 1.0
                verdict[NEW], verdict[THEN], verdict[OURS], verdict[THEIRS] = 1.0, then, power, theirs
    if step % every == 0:
        power = scale = 0.0
        for i in range(velocity.shape[0]):
            for axis in range(2):
                part = force[i, axis] * velocity[i, axis]
                power += part
                scale += abs(part)
        row = step // every % awaited.shape[0]
        awaited[row, 0], awaited[row, 1], awaited[row, 2] = step, power, scale
    return verdict[NEW] != 0.0


class PowerWatch(Kept):
    """Watch of the power of both sides at the rim `rim`, in every step that is a multiple of `every`; calls warn(name, text)."""

    KEPT = ("awaited", "verdict")

    def __init__(self, rim, every, warn):
        self.rim, self.every, self.warn = rim, every, warn
        self.awaited, self.verdict = np.zeros((DELAY + 1, 3)), np.zeros(5)

    def check(self, velocity, step):
        """Checks the power with the velocities (2K,) [m/s] of the `step`-th step of the run. Raises Unstable."""
        theirs = float(self.rim.answer.power)
        watch_power(self.rim.force, velocity.reshape(-1, 2), theirs, step, self.every, self.awaited, self.verdict)
        self.judge()

    def judge(self):
        """Warns of a mismatch that was just found, or ends the run. Raises Unstable."""
        if not self.verdict[NEW]:
            return
        in_a_row, _, step, power, theirs = self.verdict.tolist()
        self.verdict[NEW] = 0.0
        text = (
            f"the rim of window {self.rim.window.name!r} took {power:.6g} W in step {step:.0f}, its discs gave {theirs:.6g} W: "
            f"forces and velocities do not match"
        )
        self.warn("mismatch", text)
        if in_a_row >= WRONG:
            raise Unstable(f"mismatch: {text}")


class RimWatch:
    """Both watches for one rim in a coupled stage. kept: power is conserved, but not by the paper's mapping or held forces."""

    def __init__(self, rim, every, kept, warn):
        self.rim = rim
        self.growth = GrowthWatch(rim, warn)
        self.power = PowerWatch(rim, every if kept else 0, warn)

    def saved(self):
        """What changes, for a checkpoint inside of the stage."""
        return {"growth": self.growth.saved(), "power": self.power.saved()}

    def restore(self, saved):
        """Sets what `saved` gave."""
        self.growth.restore(value_of(saved, "growth"))
        self.power.restore(value_of(saved, "power"))

    def check(self, dt, step):
        """Checks the velocities of the `step`-th step, of dt [s], after they were sent. Raises Unstable."""
        self.growth.check(self.rim.before, dt)
        self.power.check(self.rim.before, step)

    def judge(self):
        """Judges what the kernels of both watches found in the last step. Raises Unstable."""
        self.growth.judge()
        self.power.judge()
