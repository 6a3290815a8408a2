"""Verdict of a trial, rest or failure, from its motion in each span.

A span is an eighth of the steps that the elastic grid needs to come to rest under its weight, so it grows with the mesh. In each,
`motion` is the root mean square displacement of the ground (weighted by mass), `similarity` the cosine between the displacement
fields of this span and the previous one, `ratio` the median of the unbalanced ratios in it.

Local damping removes only a share of the unbalanced force. So a slope above its factor of safety keeps a constant unbalanced
force and accelerates uniformly, with a displacement field of constant shape; below it, force and motion decay. Near the limit
they decay after a long time in which the motion still grows, so growth alone is not enough: the unbalanced ratio must not fall
either.

rests      the ratio is below its limit and the last span's motion is below `STILL` of the settlement under own weight;
fails      after at least `LEAST` spans, in the second half of the steps taken against the second quarter: the motion is
           not slower (`STEADY`), the median ratio has not halved, the field keeps its shape, and the motion exceeds `FAR`;
           or a gridpoint has moved farther than `RUN_OUT` of the grid's larger side;
undecided  neither, within the budget.

A ratio alone is not enough: in a trial at a factor 0.2 % too high the ratio fell below 1e-5 for a time.
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
    """Measured quantities of one span of a trial."""

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
    """Numbers on which a verdict depends, for fos.json; table: [fos] of the scene."""
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
