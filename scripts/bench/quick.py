"""The most important ratios of a step in two minutes: cases that take short turns, in boxes that fit into the caches.

A ratio is the median of the ratios turn by turn. Turns are so short and so many that a change of the machine's speed meets all
cases alike, and a clock that counts the thread's own processor time does not see when other work interrupts it.
"""

import time
from functools import partial

from bench import dem, laws
from bench.dense_box import BOND, FRICTION, dense_box
from bench.fdm import SIZES, ScalarBox
from bench.timing_rows import in_turns, over, ratio_row, row, seconds_of_step

CLOCK = time.thread_time  # of the one thread that computes
TURN = 0.1  # [s] of one case
SECONDS = 20.0  # of measuring, for each code
LEAST = 15  # turns
ZONES, DISCS, RADIUS = 1_600, 2_500, 0.03  # of the boxes; of the discs in the paper's window [m]
LEFT_OUT = (
    "left out of --quick: larger boxes, whose arrays do not fit into the caches; two threads; 10,000 zones and discs; "
    "discs of many sizes; most laws one by one, and the memory that they take"
)


def fdm_rows(companion, say, seconds=SECONDS):
    """Rows of the continuum."""
    name = "Mohr-Coulomb, tension, flags"
    sets = {
        f"{name}; at rest": (laws.FULL, False),
        f"{name}; flowing": (laws.FULL, True),
        "elastic; at rest": (("elastic", "local"), False),
    }
    cases = {}
    for law, (effects, flowing) in sets.items():
        say(f"preparing {ZONES:,} zones, {law}")
        cases[law] = laws.Box(*SIZES[ZONES], effects, flowing)
        cases[law].settle()
    rest, flowing, elastic = cases
    takes = {law: case.take for law, case in cases.items()}
    takes |= {f"scalar loop; {law}": ScalarBox(cases[law]).take for law in (rest, flowing)}
    found = _measured(takes, seconds, say)
    for law, each in found.items():
        yield row(law, ZONES, [ZONES / s for s in each], "zone-steps/s", companion, f"{len(each)} turns")
    for law in (rest, flowing):
        yield ratio_row(f"over the scalar loop; {law}", ZONES, over(found[f"scalar loop; {law}"], found[law]), companion)
    yield ratio_row("cost of a step, flowing over at rest", ZONES, over(found[flowing], found[rest]), companion)
    yield ratio_row("cost of a step, Mohr-Coulomb over elastic", ZONES, over(found[rest], found[elastic]), companion)


def dem_rows(companion, say, seconds=SECONDS, radius=RADIUS):
    """Rows of the discs."""
    friction, bonds, window, scalar = (
        "dense box, friction", "dense box, friction, contact bonds", "paper window, bonded, stones as clumps",
        "scalar loop; dense box, friction",
    )  # fmt: skip
    cases = {}
    for law, effects in ((friction, {}), (bonds, {"bond": BOND})):
        say(f"preparing {DISCS:,} discs, {law}")
        cases[law] = dem.Case(*dense_box(*dem.SIZES[DISCS], friction=FRICTION, **effects))
    say(f"preparing the {window}")
    cases[window] = dem.window(radius)
    build = f"list build; {friction}"
    size = {law: case.free for law, case in cases.items()} | {scalar: DISCS, build: DISCS}
    takes = {law: case.take for law, case in cases.items()}
    takes |= {scalar: dem.ScalarCase(cases[friction]).take, build: cases[friction].build}
    found = _measured(takes, seconds, say)
    for law, each in found.items():
        if law == build:
            yield row(law, DISCS, [1e9 * s / DISCS for s in each], "ns/disc", companion, f"{len(each)} turns")
        else:
            yield row(law, size[law], [size[law] / s for s in each], "disc-steps/s", companion, f"no builds, {len(each)} turns")
    yield ratio_row(f"over the scalar loop; {friction}", DISCS, over(found[scalar], found[friction]), companion, "no builds")
    yield ratio_row("cost of a step with contact bonds over without", DISCS, over(found[bonds], found[friction]), companion)
    a_disc = {law: [s / size[law] for s in found[law]] for law in (window, bonds)}
    name = "cost a disc, paper window over box with contact bonds"
    yield ratio_row(name, size[window], over(a_disc[window], a_disc[bonds]), companion)
    yield ratio_row(f"list build over step; {friction}", DISCS, over(found[build], found[friction]), companion)


def _measured(takes, seconds, say):
    """Seconds of a step of each case in turns that take about `seconds` together; takes: functions that take n steps."""
    measures = []
    for take in takes.values():
        take(2)
        steps = max(1, round(TURN / seconds_of_step(take, 20, CLOCK)))
        measures.append(partial(seconds_of_step, take, steps, CLOCK))
    begin = time.perf_counter()
    in_turns(measures, 1)
    turns = max(LEAST, round(seconds / (time.perf_counter() - begin)))
    say(f"measuring, {turns} turns")
    return dict(zip(takes, in_turns(measures, turns), strict=True))
