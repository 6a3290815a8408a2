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
from math import sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from coupler_protocol.compiled.jit import jit
from coupler_protocol.files.kept import Kept

log = logging.getLogger(__name__)
STIFFEST = 1.0  # of Eq (2)
GROWTH, STRIKES, MOST = 1.3, 3, 2.0
ALIKE = 0.8  # cosine between two motions of a node whose direction has not changed
RECENT = 10  # number of exchanges of "lately"
REST = 1e-6  # of the largest speed in the stage: a slower node is at rest
CALM = 4  # exchanges without a strike before n doubles
(
    BEGINS, FRESH, TAKEN, EXCHANGES, WATCHING, INTERVAL, STRIKE_COUNT, CALM_COUNT, GAIN, PAUSE, LEVEL, STRUCK, PEAK, ORIGIN,
    LARGEST, AT_ONCE, STIFFNESS, GROWN, UNJUDGED, NUMBERS,
) = range(20)  # of Pauses.now, and their number  # fmt: skip


class Pauses(NamedTuple):
    """State of a Pace, for compiled code.

    every: k; limits (2,): STIFFEST and GROWTH; peaks (RECENT,): largest speeds [m/step] between the last exchanges. now (19,):
    whether the next step is the first one under new forces, and whether the present one is; steps since the last exchange;
    number of exchanges; whether growth is watched; n; strikes; exchanges without one; max 4 S / (m + S); steps before the last
    exchange; speeds [m/step] lately, at the last strike, since the last exchange, before the first strike, and the largest of
    the stage; whether the next exchange follows at once; why the stage returned to n = 1: the ratio of Eq (2), or growth (0: it
    did not); whether ratios were not yet compared with the limits of the stage since a point of histories.
    """

    every: int
    limits: NDArray[np.float64]
    peaks: NDArray[np.float64]
    now: NDArray[np.float64]


def stiffness_ratio(mass, sums):
    """Ratio of Eq (2) [-] for rim nodes; mass (K,) [kg]: static masses of the zones, sums (K,) [N/m] of the mass rule."""
    return stiffness_kernel(np.arange(len(sums)), mass, sums)


@jit
def stiffness_kernel(nodes, mass, sums):
    """`stiffness_ratio` for the gridpoints `nodes` (K,); mass (N,)."""
    largest = 0.0
    for k in range(len(nodes)):
        largest = max(largest, 2.0 * sums[k] / mass[nodes[k]])
    return largest


@jit
def fastest_node(nodes, velocity):
    """Position in `nodes` (K,) of the fastest gridpoint, and the square of its speed [m/step]; NaN if a speed is."""
    fastest, most = 0, -1.0
    for k in range(len(nodes)):
        x, y = velocity[nodes[k], 0], velocity[nodes[k], 1]
        square = x * x + y * y
        if square > most or square != square:
            fastest, most = k, square
    return fastest, most


@jit
def note_forces(nodes, sums, mass, pauses):
    """Checks Eq (2) after new forces were received; mass (N,) [kg]: static masses of the gridpoints."""
    now = pauses.now
    if now[WATCHING] != 0.0:
        ratio = stiffness_kernel(nodes, mass, sums)
        now[GAIN] = 4.0 * ratio / (2.0 + ratio)
        if ratio > pauses.limits[0]:
            now[STIFFNESS] = ratio
            fall_back(now)


@jit
def note_velocities(nodes, before, velocity, pauses):
    """Checks the growth of the rims' motion with the velocities (N,2) [m/step] of a step; before (K,2): sent last."""
    now = pauses.now
    now[TAKEN] += 1.0
    now[FRESH] = now[BEGINS]
    if now[WATCHING] == 0.0:
        return
    fastest, square = fastest_node(nodes, velocity)
    speed = sqrt(square)
    now[PEAK], now[LARGEST] = max(now[PEAK], speed), max(now[LARGEST], speed)
    if speed <= pauses.limits[1] * now[LEVEL]:
        return
    x, y = before[fastest, 0], before[fastest, 1]
    along = x * velocity[nodes[fastest], 0] + y * velocity[nodes[fastest], 1]
    if now[PAUSE] > 1.0 and along < ALIKE * speed * sqrt(x * x + y * y):
        strike(speed, now)
    now[LEVEL], now[AT_ONCE] = speed, 1.0


@jit
def strike(speed, now):
    """Begins with n = 1 again; if held forces alone can explain the speed [m/step], this is a strike."""
    now[INTERVAL], now[CALM_COUNT] = 1.0, 0.0
    if speed > (1.0 + now[GAIN] * now[PAUSE]) * now[LEVEL]:
        return
    if now[STRIKE_COUNT] == 0.0:
        now[ORIGIN] = now[LEVEL]
    now[STRIKE_COUNT] += 1.0
    now[STRUCK] = speed
    if now[STRIKE_COUNT] == STRIKES or speed > MOST * now[ORIGIN]:
        now[GROWN] = 1.0
        fall_back(now)


@jit
def fall_back(now):
    """Returns to an exchange in every step."""
    now[WATCHING], now[INTERVAL], now[AT_ONCE] = 0.0, 1.0, 1.0


@jit
def due(number, must, pauses):
    """Steps since the last exchange if an exchange follows the present step, else 0; number: steps since the run began."""
    now = pauses.now
    begins = must or now[AT_ONCE] != 0.0 or number % now[INTERVAL] == 0.0
    now[BEGINS] = 1.0 if begins else 0.0
    if not begins:
        return 0
    steps = int(now[TAKEN])
    now[TAKEN], now[AT_ONCE], now[PAUSE] = 0.0, 0.0, steps
    if now[WATCHING] != 0.0:
        judge(pauses)
    now[EXCHANGES] += 1.0
    return steps


@jit
def judge(pauses):
    """Updates the speed of lately and the interval at an exchange."""
    now, peaks = pauses.now, pauses.peaks
    for i in range(1, RECENT):
        peaks[i - 1] = peaks[i]
    peaks[RECENT - 1] = now[PEAK]
    lately = 0.0
    for i in range(RECENT):
        lately = max(lately, peaks[i])
    now[PEAK] = 0.0
    if peaks[0] >= 0.0:
        now[LEVEL] = max(min(now[LEVEL], lately), REST * now[LARGEST])
    if lately < 0.5 * now[STRUCK]:
        now[STRIKE_COUNT] = 0.0
    now[CALM_COUNT] += 1.0
    if now[CALM_COUNT] > CALM:
        now[INTERVAL], now[CALM_COUNT] = min(2.0 * now[INTERVAL], pauses.every), 0.0


@jit
def judges_now(looks, pauses):
    """Whether ratios are compared with the limits of the stage: in the first step under new forces since a point of histories.

    Under held forces the grid alone comes to rest. looks: whether histories have a point before the present step.
    """
    now = pauses.now
    if looks:
        now[UNJUDGED] = 1.0
    judged = now[UNJUDGED] != 0.0 and now[FRESH] != 0.0
    if judged:
        now[UNJUDGED] = 0.0
    return judged


@jit
def add_path(nodes, velocity, path, pauses):
    """Adds the velocities of a step to the path (K,2) of the rims since the last exchange."""
    first = pauses.now[TAKEN] == 0.0
    for k in range(len(nodes)):
        for axis in range(2):
            v = velocity[nodes[k], axis]
            path[k, axis] = v if first else path[k, axis] + v


class Pace(Kept):
    """Intervals between exchanges in one stage. every: k; fell_back: why an earlier stage returned to 1, or ""."""

    KEPT = ("fell_back", "pauses")

    def __init__(self, every, fell_back=""):
        self.every, self.fell_back = every, fell_back
        now = np.zeros(NUMBERS)
        now[BEGINS] = now[FRESH] = now[INTERVAL] = now[PAUSE] = 1.0
        now[WATCHING] = every > 1 and not fell_back
        self.pauses = Pauses(every, np.array([STIFFEST, GROWTH]), np.full(RECENT, -1.0), now)

    @property
    def begins(self):
        """Whether the next step is the first one under new forces."""
        return self.pauses.now[BEGINS] != 0.0

    @property
    def fresh(self):
        """Whether the present step is the first one under new forces."""
        return self.pauses.now[FRESH] != 0.0

    @property
    def taken(self):
        """Steps since the last exchange."""
        return int(self.pauses.now[TAKEN])

    @property
    def watching(self):
        """Whether stiffness and growth are checked."""
        return self.pauses.now[WATCHING] != 0.0

    def note_forces(self, rims, mass):
        """Checks Eq (2) after new forces were received; mass (N,) [kg]: static masses of the gridpoints."""
        if self.watching:
            nodes, sums = (np.concatenate([getattr(rim, name) for rim in rims]) for name in ("nodes", "sums"))
            note_forces(nodes, sums, mass, self.pauses)
            self.note_fall_back()

    def note_velocities(self, rims, velocity):
        """Checks the growth of the rims' motion with the velocities (N,2) [m/step] of a step."""
        if self.watching:
            nodes, before = (np.concatenate([getattr(rim, name) for rim in rims]) for name in ("nodes", "before"))
            note_velocities(nodes, before, velocity, self.pauses)
            self.note_fall_back()
        else:
            now = self.pauses.now
            now[TAKEN], now[FRESH] = now[TAKEN] + 1.0, now[BEGINS]

    def due(self, number, must=False):
        """Steps since the last exchange if an exchange follows the present step, else 0; number: steps since the run began."""
        if self.every > 1:
            return due(number, must, self.pauses)
        steps = self.taken
        self.pauses.now[TAKEN] = 0.0
        self.pauses.now[EXCHANGES] += 1.0
        return steps

    def judges_now(self, looks):
        """Whether ratios are compared with the limits of the stage in the present step; looks: after a point of histories."""
        return bool((looks or self.pauses.now[UNJUDGED]) and judges_now(looks, self.pauses))

    def add_exchanges(self, count):
        """Counts exchanges that were not asked for by `due`."""
        self.pauses.now[EXCHANGES] += count

    def note_fall_back(self):
        """Notes why the stage returned to an exchange in every step, if it just did, with a warning in the log."""
        now = self.pauses.now
        if self.fell_back or not (now[STIFFNESS] or now[GROWN]):
            return
        self.fell_back = "the motion of the rim grew by itself"
        if now[STIFFNESS]:
            self.fell_back = f"contacts on the rim are {now[STIFFNESS]:.3g} times as stiff as the zones there, 1 is the limit"
        log.warning("both sides exchange in every step from now on (exchange_every = %d): %s", self.every, self.fell_back)

    def report(self):
        """Content of run.json if k is not 1: exchanges of the stage, and why it returned to 1, or ""."""
        exchanges = int(self.pauses.now[EXCHANGES])
        return {} if self.every == 1 else {"exchanges": exchanges, "fell_back": self.fell_back}
