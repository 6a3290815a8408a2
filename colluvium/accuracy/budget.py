"""Settings that a study chooses itself, for a budget of seconds.

It begins with the coarsest value of every knob. In each turn it makes one knob finer: the one whose last step changed the value
most for its seconds; a knob that was never turned comes first. A step is taken if what it is expected to cost, and the coarser
values beside the new setting that an extrapolation needs, are within what is left. Seconds of a step are expected to grow by the
factor of the last step of the same knob, before its first one by GROWTH.
"""

from collections.abc import Callable

from colluvium.accuracy.knobs import Knob, Setting, setting
from colluvium.accuracy.study import Result

GROWTH = 8.0  # four times the zones, twice the steps
BESIDE = 2  # coarser values of each knob beside the finest setting: with it the three of an extrapolation

Compute = Callable[[Setting], tuple[Result, float]]  # the result, and the seconds that it took now (0: known from before)


def explore(knobs: list[Knob], budget: float, compute: Compute) -> tuple[list[Result], list[Knob]]:
    """Results of the chosen settings, and the knobs with the values up to the finest one that was reached."""
    at = [0] * len(knobs)
    found: dict[str, Result] = {}
    left = budget

    def computed(levels: list[int]) -> Result:
        nonlocal left
        one = setting(knobs, tuple(knob.values[level] for knob, level in zip(knobs, levels, strict=True)))
        if one.name not in found:
            found[one.name], seconds = compute(one)
            left -= seconds
        return found[one.name]

    last = computed(at)
    growth, gain = [GROWTH] * len(knobs), [float("inf")] * len(knobs)
    while not last.failed:
        best = _next_knob(knobs, at, growth, gain, last.seconds or 0.0, left)
        if best is None:
            break
        finer = computed([level + (i == best) for i, level in enumerate(at)])
        if finer.failed:
            gain[best] = 0.0
            break
        if last.seconds and finer.seconds:
            growth[best] = max(1.0, finer.seconds / last.seconds)
        change = abs((finer.value or 0.0) - (last.value or 0.0))
        gain[best] = change / max(finer.seconds or 0.0, 1e-9)
        at[best] += 1
        last = finer
    for i in range(len(knobs)):
        for coarser in range(max(0, at[i] - BESIDE), at[i]):
            computed([coarser if j == i else level for j, level in enumerate(at)])
    reached = [knob._replace(values=knob.values[: level + 1]) for knob, level in zip(knobs, at, strict=True)]
    return list(found.values()), reached


def _next_knob(
    knobs: list[Knob], at: list[int], growth: list[float], gain: list[float], seconds: float, left: float
) -> int | None:
    """The knob to turn next, or None: all are at their finest, or nothing is left for another step."""
    open_ones = []
    for i, knob in enumerate(knobs):
        finest = seconds * growth[i]
        beside = BESIDE * finest * sum(1.0 / max(g, 2.0) for g in growth)
        if at[i] + 1 < len(knob.values) and finest + beside <= left:
            open_ones.append(i)
    return max(open_ones, key=lambda i: gain[i]) if open_ones else None
