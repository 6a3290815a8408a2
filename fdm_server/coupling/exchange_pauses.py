"""Number of steps between two exchanges in static mode: `coupling.exchange_every` = k, as long as this is stable.

The grid takes n steps under the last nodal forces P of the discs; then the discs take n steps with the mean velocity of every
rim node, so that positions agree at every exchange. For a mass m attached to the discs by a spring k_c, one interval between
exchanges has, without damping,

    det = 1 + a n (n - 1) / 2,   a = k_c / m                                     (1)

above 1 for n > 1: forces held constant for n steps add energy. Damping removes it as long as zones are stiffer than the
contacts attached to them: in many steps a rim node comes to rest under P, and from one exchange to the next its motion is
multiplied by about - k_c / K.
With static masses m_I of zones (fdm_server/step/masses.py) and sums S_I of contacts (dem_server/coupling/rim.py), the stiffness
of zones at a rim node is at most 2 m_I, that of contacts at most 2 S_I; with a reserve of 2 for the contacts,

    contact/zone stiffness = max 2 S_I / m_I,                                    (2)

which is k_c / 2 K for a spring k_c on the end of a bar of square zones, K the stiffness of the last one. Above STIFFEST there is
an exchange in every step for the rest of the run. The
same applies if the motion of the rim grows although the ratio is lower (a block that only discs support has no K). To detect
growth while it is slow, n begins with 1 in every stage and doubles after CALM exchanges. If a rim node becomes GROWTH times as
fast as all nodes were lately, the next exchange follows immediately. If its direction has also changed since the last exchange
(cosine below ALIKE), n begins with 1 again; if held forces alone can explain its speed, this is a strike. Forces change by at
most 4 S_I times the path, with the same reserve, hence

    v <= (1 + 4 S_I n / (m_I + S_I)) v_before.                                   (3)

After STRIKES strikes without rest in between, or at MOST times the speed before the first strike, n stays 1. Growing loads move
the rim in one direction; sudden loads, such as breaking bonds, make it faster than (3), or only once.
"""

import logging
from collections import deque

import numpy as np

from coupler_protocol.files.kept import Kept

log = logging.getLogger(__name__)
STIFFEST = 1.0  # of Eq (2)
GROWTH, STRIKES, MOST = 1.3, 3, 2.0
ALIKE = 0.8  # cosine between two motions of a node whose direction has not changed
RECENT = 10  # number of exchanges of "lately"
REST = 1e-6  # of the largest speed in the stage: a slower node is at rest
CALM = 4  # exchanges without a strike before n doubles


def stiffness_ratio(mass, sums):
    """Ratio of Eq (2) [-] for rim nodes; mass (K,) [kg]: static masses of the zones, sums (K,) [N/m] of the mass rule."""
    return float((2.0 * sums / mass).max(initial=0.0))


class Pace(Kept):
    """Intervals between exchanges in one stage. every: k; fell_back: why an earlier stage returned to 1, or "".

    `begins`: the next step is the first one under new forces; `fresh`: the present step is. `exchanges`: number of exchanges.
    """

    KEPT = (
        "fell_back", "begins", "fresh", "taken", "exchanges", "watching", "interval", "strikes", "_calm", "_gain", "_pause",
        "_level", "_struck", "_peak", "_origin", "_largest", "_peaks", "_now",
    )  # fmt: skip

    def __init__(self, every, fell_back=""):
        self.every, self.fell_back = every, fell_back
        self.begins, self.fresh, self.taken, self.exchanges = True, True, 0, 0
        self.watching = every > 1 and not fell_back
        self.interval = 1  # n
        self.strikes = self._calm = 0
        self._gain, self._pause = 0.0, 1  # max 4 S / (m + S); steps before the last exchange
        self._level = self._struck = self._peak = 0.0  # speeds [m/step]: lately, at the last strike, since the last exchange
        self._origin = self._largest = 0.0  # speeds before the first strike, in the stage
        self._peaks = deque(maxlen=RECENT)
        self._now = False

    def note_forces(self, rims, mass):
        """Checks Eq (2) after new forces were received; mass (N,) [kg]: static masses of the gridpoints."""
        if self.watching:
            ratio = max(stiffness_ratio(mass[rim.nodes], rim.sums) for rim in rims)
            self._gain = 4.0 * ratio / (2.0 + ratio)
            if ratio > STIFFEST:
                self._fall_back(f"contacts on the rim are {ratio:.3g} times as stiff as the zones there, 1 is the limit")

    def note_velocities(self, rims, velocity):
        """Checks the growth of the rims' motion with the velocities (N,2) [m/step] of a step."""
        self.taken, self.fresh = self.taken + 1, self.begins
        if not self.watching:
            return
        rim = max(rims, key=lambda rim: rim.speed(velocity)[0])
        speed, fastest = rim.speed(velocity)
        self._peak, self._largest = max(self._peak, speed), max(self._largest, speed)
        if speed <= GROWTH * self._level:
            return
        before, now = rim.before[fastest], velocity[rim.nodes[fastest]]
        if self._pause > 1 and before @ now < ALIKE * speed * np.hypot(*before):
            self._strike(speed)
        self._level, self._now = speed, True

    def _strike(self, speed):
        self.interval, self._calm = 1, 0
        if speed > (1.0 + self._gain * self._pause) * self._level:
            return
        self._origin = self._origin if self.strikes else self._level
        self.strikes, self._struck = self.strikes + 1, speed
        if self.strikes == STRIKES or speed > MOST * self._origin:
            self._fall_back("the motion of the rim grew by itself")

    def due(self, number, must=False):
        """Steps since the last exchange if an exchange follows the present step, else 0; number: steps since the run began."""
        self.begins = must or self._now or number % self.interval == 0
        if not self.begins:
            return 0
        steps, self.taken, self._now = self.taken, 0, False
        self._pause = steps
        self.exchanges += 1
        if self.watching:
            self._judge()
        return steps

    def _judge(self):
        self._peaks.append(self._peak)
        self._peak, lately = 0.0, max(self._peaks)
        if len(self._peaks) == RECENT:
            self._level = max(min(self._level, lately), REST * self._largest)
        if lately < 0.5 * self._struck:
            self.strikes = 0
        self._calm += 1
        if self._calm > CALM:
            self.interval, self._calm = min(2 * self.interval, self.every), 0

    def _fall_back(self, why):
        self.fell_back, self.watching, self.interval, self._now = why, False, 1, True
        log.warning("both sides exchange in every step from now on (exchange_every = %d): %s", self.every, why)

    def report(self):
        """Content of run.json if k is not 1: exchanges of the stage, and why it returned to 1, or ""."""
        return {} if self.every == 1 else {"exchanges": self.exchanges, "fell_back": self.fell_back}
