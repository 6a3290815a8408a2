"""What is wrong at an interface, seen from the grid step by step: flutter of the rim, and power lost between both sides.

Flutter. In leap-frog a mode of frequency omega goes on as v(n+1/2) = z v(n-1/2), and leaves the unit circle along the negative
real axis where omega dt > 2 (Courant, Friedrichs & Lewy 1928, Math. Ann. 100, 32-74; Hughes 1987, The Finite Element Method,
section 9.1). So contacts too stiff for the masses of a rim show as motion that turns round in every step and grows:

    v+ . v- < -.9 |v+| |v-|,    |v+| grows from step to step                           (1)

over all gridpoints of a rim. Stable modes turn round so only at the limit itself and do not grow; waves, slides and impacts
do not turn round. Doubled since (1) began it is worth a warning, fourfold it ends the run.

Power. The forces P on gridpoints and velocities half a step later give what the discs see on their side (mapping.py): sum P.v, to
round-off with the work-consistent mapping. Compared at looks.
"""

import logging
from math import sqrt

import numpy as np

from fdm_server.safety import Unstable

log = logging.getLogger(__name__)

REVERSED, LEAST = 0.9, 3  # cosine, steps in a row
NOTICED, TOO_MUCH = 2.0, 4.0  # growth of |v|
NOTHING = 1e-12  # way in a step below which motion is round-off, over the rim's size
MISMATCH = 1e-9  # of sum |P||v|


class FlutterWatch:
    """Eq (1) for one rim; size [m]: of the rim, name: of its window."""

    def __init__(self, name, size):
        self.name, self.floor = name, NOTHING * size
        self.last = None
        self.square = 0.0
        self.steps, self.onset = 0, 0.0

    def see(self, velocity, dt):
        """Look at the velocities (2K,) [m/s] of a step; returns how much they have grown, fluttering, or None. Raises Unstable."""
        last, before = self.last, self.square
        self.last, self.square = velocity, float(velocity @ velocity)
        if last is None or not self._turns_round(float(velocity @ last), before, dt):
            self.steps = 0
            return None
        if self.steps == 0:
            self.onset = before
        self.steps += 1
        growth = sqrt(self.square / self.onset)
        if self.steps < LEAST or growth <= NOTICED:
            return None
        if growth > TOO_MUCH:
            raise Unstable(self.text(growth))
        return growth

    def _turns_round(self, product, before, dt):
        moves = before > 0.0 and sqrt(self.square / len(self.last)) * dt > self.floor
        return moves and self.square > before and product < -REVERSED * sqrt(self.square * before)

    def text(self, growth):
        """The warning."""
        return (
            f"interface flutter: the rim of window {self.name!r} turns round in every step and has grown {growth:.2g} times in "
            f"{self.steps} steps: the contacts on it are too stiff for its masses or for the step"
        )


class InterfaceWatch:
    """The watch of a coupled stage over all its rims. warn(text): where a warning goes, each kind once a stage and window."""

    def __init__(self, rims, every, paper, warn):
        self.rims, self.every, self.paper, self.warn = rims, every, paper, warn
        self.flutter = [FlutterWatch(rim.window.name, float(np.ptp(rim.xy, axis=0).max())) for rim in rims]
        self.awaited = [[] for _ in rims]  # (power, scale) of looked steps whose answers have not come yet
        self.warned = set()

    def see(self, state, dt, done):
        """After a step's kick, before velocities are said; done: steps since the run began. Raises Unstable."""
        for r, rim in enumerate(self.rims):
            velocity = state.velocity[rim.nodes].ravel()
            if self.flutter[r].see(velocity, dt) is not None:
                self._once("flutter", r, self.flutter[r].text(sqrt(self.flutter[r].square / self.flutter[r].onset)))
            if not self.paper:
                self._compare(r, rim, velocity, done)

    def _compare(self, r, rim, velocity, done):
        if (done - 1) % self.every == 0 and self.awaited[r]:
            power, scale = self.awaited[r].pop(0)
            if not abs(power - rim.answer.power) <= MISMATCH * scale:
                self._once("mismatch", r, (
                    f"interface mismatch: the rim of window {rim.window.name!r} takes {power:.6g} W, its discs give "
                    f"{rim.answer.power:.6g} W in step {done - 1}: forces and velocities do not belong to each other"
                ))  # fmt: skip
        if (done + 1) % self.every == 0:
            force = rim.force.ravel()
            self.awaited[r].append((float(force @ velocity), float(np.abs(force) @ np.abs(velocity))))

    def _once(self, kind, r, text):
        if (kind, r) not in self.warned:
            self.warned.add((kind, r))
            self.warn(text)
