"""Whether a trial rests or fails, judged from its motion span by span.

A span is an eighth of the steps that the elastic grid needs to come to rest under its weight, so it grows with the mesh. In each,
`motion` is the root mean square displacement of the ground (weighted by mass), `similarity` the cosine between the displacement
fields of this span and the one before, `ratio` the median of the unbalanced ratios seen in it.

Local damping takes a share of the unbalanced force only. A slope above its factor of safety therefore keeps a constant
unbalanced force and grows faster evenly, in a field that keeps its shape; below it, both die away. Near the limit they do so
after a long time in which the motion grows all the same, so growth alone proves nothing: the unbalanced ratio must not fall
either.

rests      the ratio is below its limit and the last span's motion is below `STILL` of the settlement under own weight;
fails      after at least `LEAST` spans, in the second half of the steps taken against the second quarter: the motion is
           no slower (`STEADY`), the median ratio has not halved, the field keeps its shape, and it has gone somewhere;
           or a gridpoint has gone further than `RUN_OUT` of the grid's larger side;
undecided  neither, within the budget.

A ratio alone would not do: flow at a factor .2 % too high has been seen to pass below 1e-5 for a time, and to stop later.
"""

from statistics import fmean, median
from typing import NamedTuple

RESTS, FAILS, UNDECIDED = "rests", "fails", "undecided"
SPANS_OF_SETTLING = 8  # spans in the steps that the elastic grid needs
LEAST = 16  # spans before a trial can fail: twice the steps of settling
STILL = 1e-4  # motion of a span over the settlement
STEADY = 0.9  # speed in the second half over that in the second quarter
FALLEN = 0.5  # median ratio in the second half over that in the second quarter
ALIKE = 0.9  # mean similarity in the second half
FAR = 0.1  # motion in the second half over the settlement
RUN_OUT = 0.05  # largest displacement over the larger side of the grid


class Span(NamedTuple):
    """What was seen in one span of a trial."""

    ratio: float  # [-] median of the unbalanced ratios
    last_ratio: float  # [-]
    motion: float  # [m]
    similarity: float  # [-] 0 in the first span


def verdict(spans, ratio, settlement, gone=0.0):
    """RESTS, FAILS or None (go on) after `spans`.

    ratio: limit [-]; settlement [m] of the elastic grid under its weight; gone: largest displacement over the grid's larger side.
    """
    last = spans[-1]
    if last.last_ratio <= ratio and last.motion <= STILL * settlement:
        return RESTS
    if gone > RUN_OUT:
        return FAILS
    count = len(spans)
    if count < LEAST or count % 4:
        return None
    before, after = spans[count // 4 : count // 2], spans[count // 2 :]
    third, fourth = after[: count // 4], after[count // 4 :]
    fails = (
        _speed(after) >= STEADY * _speed(before)
        and _speed(fourth) >= STEADY * _speed(third)
        and median(s.ratio for s in after) >= FALLEN * median(s.ratio for s in before)
        and fmean(s.similarity for s in after) >= ALIKE
        and sum(s.motion for s in after) >= FAR * settlement
    )
    return FAILS if fails else None


def criterion(table):
    """The numbers a verdict depends on, for the record; table: [fos] of the scene."""
    return {
        "ratio": table.ratio,
        "still": STILL,
        "least_spans": LEAST,
        "steady": STEADY,
        "fallen": FALLEN,
        "alike": ALIKE,
        "far": FAR,
        "run_out": RUN_OUT,
        "spans_of_settling": SPANS_OF_SETTLING,
    }


def _speed(spans):
    return fmean(s.motion for s in spans)
