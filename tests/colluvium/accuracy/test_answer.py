"""Errors, front and sentences of settings whose values and seconds are known functions of their sizes."""

from dataclasses import replace

import pytest

from colluvium.accuracy import answer
from colluvium.accuracy.budget import explore
from colluvium.accuracy.knobs import Knob, settings_of
from colluvium.accuracy.study import Result

ZONES = Knob("zone_size", ("grid.zone_size",), (1.0, 0.5, 0.25, 0.125), False)
RATIO = Knob("ratio", ("stage.a.until.ratio",), (1e-2, 1e-3), False)
RIGHT = 2.0


def result(setting, seed=0.0):
    """2 + 0.3 h^2 + 5 r, in h^-3 seconds, times 1.5 for a ratio ten times smaller."""
    h, r = setting.values["zone_size"], setting.values.get("ratio", 0.0)
    seconds = h**-3 * (1.5 if r == 1e-3 else 1.0)
    return Result(setting.name, setting.values, RIGHT + 0.3 * h**2 + 5 * r + seed, 0.0, round(100 / h), seconds)


def judged(knobs, results, given=None):
    points = answer.points_of(results)
    reference = answer.reference_of(points, knobs, given, "closed form" if given is not None else "")
    return answer.judged(points, reference), reference


def test_the_limit_of_second_order_values_is_the_reference():
    points, reference = judged([ZONES], [result(setting) for setting in settings_of([ZONES])])
    assert reference.value == pytest.approx(RIGHT, rel=1e-9)
    assert reference.orders["zone_size"] == pytest.approx(2.0)
    assert [point.error for point in points] == pytest.approx([0.15, 0.0375, 0.009375, 0.00234375], rel=1e-6)
    assert all(point.on_front for point in points)
    assert answer.slope(points) == pytest.approx(2 / 3)


def test_what_the_target_and_the_next_digit_cost():
    points, reference = judged([ZONES], [result(setting) for setting in settings_of([ZONES])], given=RIGHT)
    first, second = answer.sentences(points, reference, 0.01)
    assert first == "The cheapest setting within 1 % is zone_size=0.25: error 0.94 %, 64 s."
    # error 0.1 % at h = sqrt(0.001/0.15): h^-3 = 1837 s
    assert second == "An error of 0.1 % would cost about 1.8e+03 s, 29 times as much: the error falls as time^-0.67."
    first, second = answer.sentences(points, reference, 1e-3)
    assert first == "No setting is within 0.1 %: the best, zone_size=0.125, has 0.23 % in 512 s."
    assert "would cost about 1.8e+03 s, 3.6 times as much" in second
    first, second = answer.sentences(points, reference, 0.05)
    assert second == "An error of 0.5 % costs 512 s (zone_size=0.125), 64 times as much."


def test_an_error_below_what_is_known_of_the_reference_is_doubted():
    """GCI of the finest zones: 1.25 times their error of 0.23 %."""
    points, reference = judged([ZONES], [result(setting) for setting in settings_of([ZONES])])
    assert len(answer.sentences(points, reference, 0.05)) == 2
    doubt = answer.sentences(points, reference, 0.01)[2]
    assert doubt.startswith("The reference itself (extrapolated, zone_size -> 0) is known within 0.29 % only")


def test_a_setting_is_on_the_front_if_nothing_cheaper_is_better():
    knobs = [ZONES, RATIO]
    points, reference = judged(knobs, [result(setting) for setting in settings_of(knobs)], given=RIGHT)
    assert reference.source == "closed form"
    on_front = {(p.values["zone_size"], p.values["ratio"]) for p in points if p.on_front}
    errors = {(p.values["zone_size"], p.values["ratio"]): (p.seconds, p.error) for p in points}
    for key, (seconds, error) in errors.items():
        assert (key in on_front) == all(error < e for s, e in errors.values() if s < seconds), key
    assert (0.125, 1e-2) not in on_front  # the ratio's floor: finer zones alone gain less than a smaller ratio costs


def test_without_a_limit_the_finest_setting_is_the_reference_and_has_no_error():
    two = ZONES._replace(values=(1.0, 0.5))
    points, reference = judged([two], [result(setting) for setting in settings_of([two])])
    assert reference.itself == "zone_size=0.5"
    assert [point.error is None for point in points] == [False, True]
    assert "own error is not known" in reference.source


def test_seeds_are_one_setting_with_an_interval():
    seeds = Knob("seed", ("seed",), (1, 2, 3), False)
    knobs = [ZONES._replace(values=(1.0, 0.5)), seeds]
    results = [result(setting, seed=0.01 * (setting.values["seed"] - 2)) for setting in settings_of(knobs)]
    points, _ = judged(knobs, results, given=RIGHT)
    assert [point.name for point in points] == ["zone_size=1", "zone_size=0.5"]
    assert [point.seeds for point in points] == [3, 3]
    assert points[0].value == pytest.approx(2.3)
    assert points[0].interval == pytest.approx(4.302653 * 0.01 / 3**0.5, rel=1e-6)  # t of 2 degrees of freedom


def test_failed_settings_are_listed_and_judge_nothing():
    results = [result(setting) for setting in settings_of([ZONES])]
    results[1] = Result(results[1].name, results[1].values, failed="exit code 6: physics")
    points, reference = judged([ZONES], results)
    assert points[1].error is None
    assert not points[1].on_front
    lines = answer.as_lines("f", points, reference, 0.01)
    assert any(line.split()[1:3] == ["failed:", "exit"] for line in lines)
    results[-1] = Result(results[-1].name, results[-1].values, failed="exit code 6: physics")
    points, reference = judged([ZONES], results)
    assert answer.sentences(points, reference, 0.01) == ["No setting can be judged: none: the finest setting failed."]


@pytest.mark.parametrize("budget", [30.0, 1000.0])
def test_a_budget_is_kept_and_its_finest_setting_extrapolated(budget):
    spent = 0.0

    def compute(setting):
        nonlocal spent
        found = result(setting)
        spent += found.seconds
        return found, found.seconds

    zones = ZONES._replace(values=tuple(2.0**-k for k in range(8)), open_ended=True)
    results, (reached,) = explore([zones], budget, compute)
    assert spent <= budget
    assert 8.0 * results[-1].seconds + spent > budget or len(reached.values) > 2
    points, reference = judged([reached], results)
    assert reached.values[-1] == min(point.values["zone_size"] for point in points)
    assert len(results) == len(reached.values)
    if budget == 1000.0:
        assert reached.values[-1] == 0.125
        assert reference.value == pytest.approx(RIGHT, rel=1e-9)


def test_a_budget_turns_the_knob_that_gains_more():
    def compute(setting):
        found = result(setting)
        return found, found.seconds

    ratios = RATIO._replace(values=(1e-1, 1e-2, 1e-3))
    results, reached = explore([ZONES, ratios], 300.0, compute)
    assert [len(knob.values) for knob in reached] == [3, 3]  # both: neither is left at its coarsest
    assert results[1].values["zone_size"] == 0.5  # the first knob first, then the one that was never turned
    assert results[2].values["ratio"] == 1e-2


def test_a_collapse_load_converges_with_the_first_order_where_a_smooth_quantity_has_the_second():
    """Values of order 2.14: the limit of a stress is near, that of a collapse load is taken as far as order 1 would leave it."""
    sizes = ZONES._replace(values=(1.0, 0.5, 0.25))
    points = answer.points_of([result(setting) for setting in settings_of([sizes])])
    points = [replace(p, value=RIGHT + 0.3 * p.values["zone_size"] ** 2.14) for p in points]
    finest = points[-1].value - RIGHT
    smooth = answer.reference_of(points, [sizes])
    collapse = answer.reference_of(points, [sizes], collapse=True)
    assert abs(smooth.value - RIGHT) < 0.2 * finest
    assert abs(collapse.value - RIGHT) > finest
    assert collapse.half_width > 5 * smooth.half_width
    assert smooth.orders == collapse.orders


def test_a_ratio_has_the_formal_order_one():
    ratios = RATIO._replace(values=(1e-2, 1e-3, 1e-4))
    results = [Result(s.name, s.values, RIGHT + 5 * s.values["ratio"], 0.0, 1, 1.0) for s in settings_of([ratios])]
    _, reference = judged([ratios], results)
    assert reference.value == pytest.approx(RIGHT, rel=1e-9)
    assert reference.half_width == pytest.approx(1.25 * 5e-4, rel=1e-6)
