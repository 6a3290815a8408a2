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
           or, after at least `LEAST_CONSTANT` spans, it flows at constant speed at any ratio: in the second half
           against the second quarter, and in its own second half against its first, the speed is the same (`CONSTANT`,
           `CONSTANT_LATE`), in a field that keeps its shape closely, over `FAR_CONSTANT` settlements;
           or a gridpoint has moved farther than `RUN_OUT` settlements;
undecided  neither, within the budget.

A ratio alone is not enough: in a trial at a factor 0.2 % too high the ratio fell below 1e-5 for a time. A mechanism at its limit
needs no unbalanced force to flow: its stresses balance, nothing accelerates or brakes it (local damping is a share of the
unbalanced force), and it continues at a ratio of 1e-8 (an infinite slope of sand with psi = phi).
Creep that decays as 1/n loses half of its speed from the second quarter to the second half, and a slope at the peak of its speed
has grown by more than `CONSTANT` allows. In 252 trials within 2 % of the factors of 14 slopes, no trial that came to rest later
was taken for constant flow.

All lengths count in settlements of the elastic ground under its loads, and steps in those of settling: neither stiffness nor
size nor units change a verdict.
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
LEAST_CONSTANT = 32  # spans before flow can be called constant
CONSTANT = 0.95, 1.01  # speed in the second half over that in the second quarter
CONSTANT_LATE = 0.98, 1.005  # speed in the fourth quarter over that in the third
ALIKE_CONSTANT = 0.99  # mean similarity in the second half
FAR_CONSTANT = 1.0  # motion in the second half over the settlement
RUN_OUT = 1e4  # largest displacement over the settlement: sand at rest below its factor has gone half as far


class Span(NamedTuple):
    """Measured quantities of one span of a trial."""

    ratio: float  # [-] median of the unbalanced ratios
    last_ratio: float  # [-]
    motion: float  # [m]
    similarity: float  # [-] 0 in the first span


def verdict(spans, ratio, settlement, gone=0.0):
    """RESTS, FAILS or None (go on) after `spans`.

    ratio: limit [-]; settlement [m] of the elastic grid under its weight; gone [m]: largest displacement.
    """
    last = spans[-1]
    if last.last_ratio <= ratio and last.motion <= STILL * settlement:
        return RESTS
    if gone > RUN_OUT * settlement:
        return FAILS
    count = len(spans)
    if count < LEAST or count % 4:
        return None
    before, after = spans[count // 4 : count // 2], spans[count // 2 :]
    third, fourth = after[: count // 4], after[count // 4 :]
    now, late = _speed(after) / _speed(before), _speed(fourth) / _speed(third)
    alike, far = fmean(s.similarity for s in after), sum(s.motion for s in after) / settlement
    driven = median(s.ratio for s in after) >= FALLEN * median(s.ratio for s in before)
    grows = driven and now >= STEADY and late >= STEADY and alike >= ALIKE and far >= FAR
    constant = _within(now, CONSTANT) and _within(late, CONSTANT_LATE) and alike >= ALIKE_CONSTANT and far >= FAR_CONSTANT
    return FAILS if grows or (constant and count >= LEAST_CONSTANT) else None


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
        "least_constant": LEAST_CONSTANT,
        "constant": CONSTANT,
        "constant_late": CONSTANT_LATE,
        "alike_constant": ALIKE_CONSTANT,
        "far_constant": FAR_CONSTANT,
        "run_out": RUN_OUT,
        "spans_of_settling": SPANS_OF_SETTLING,
    }


def _speed(spans):
    return max(fmean(s.motion for s in spans), 1e-300)


def _within(value, limits):
    return limits[0] <= value <= limits[1]
