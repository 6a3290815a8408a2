"""Limits of manufactured values whose order is known."""

import numpy as np
import pytest

from colluvium.accuracy.smooth_limit import smooth_limit

SIZES = [1.0, 0.5, 0.25]
EXACT = -36.0


def limit(sizes, values, formal=2.0, half_width=0.0):
    return smooth_limit(sizes, values, [half_width] * len(sizes), formal)


def values_of(sizes, order, amplitude=3.0):
    return [EXACT + amplitude * h**order for h in sizes]


@pytest.mark.parametrize("sizes", [SIZES, [*SIZES, 0.125], [0.9, 0.5, 0.3]])
@pytest.mark.parametrize("order", [2.0, 1.0])
def test_exact_for_values_of_first_and_of_second_order(sizes, order):
    found = limit(sizes, values_of(sizes, order))
    assert found.value == pytest.approx(EXACT, abs=1e-6)
    assert found.observed_order == pytest.approx(order, abs=1e-4)
    finest = 3.0 * min(sizes) ** order
    assert found.half_width == pytest.approx({2.0: 1.25, 1.0: 3.0}[order] * finest, rel=1e-3)


def test_an_observed_order_somewhat_above_the_formal_one_is_the_formal_one():
    """Order 2.14, as the tangential stress beside a hole has: with order 1 the limit would be four times too far."""
    values = values_of(SIZES, 2.14)
    found = limit(SIZES, values)
    assert found.observed_order == pytest.approx(2.14)
    assert abs(found.value - EXACT) < found.half_width < 1.5 * abs(values[-1] - EXACT)
    assert abs(found.value - EXACT) < 0.15 * abs(values[-1] - EXACT)


def test_an_order_far_from_the_formal_one_is_clipped_and_doubted():
    high = limit(SIZES, values_of(SIZES, 5.0))
    finest = values_of(SIZES, 5.0)[-1]
    second = values_of(SIZES, 5.0)[-2]
    assert high.value == pytest.approx(finest + (finest - second) / 3.0)  # r^2 - 1 = 3
    assert high.half_width == pytest.approx(3.0 * abs(finest - high.value))
    low = limit(SIZES, values_of(SIZES, 0.3))
    finest, second = values_of(SIZES, 0.3)[-1:-3:-1]
    assert low.half_width == pytest.approx(3.0 * abs(finest - low.value))
    assert abs(low.value - EXACT) < low.half_width  # order 1/2 falls short, its interval does not


def test_values_without_a_limit_have_none():
    assert limit(SIZES, [1.0, 2.0, 4.0]).value is None
    assert limit([*SIZES, 0.125], [np.log(h) for h in [*SIZES, 0.125]]).value is None


@pytest.mark.parametrize("values", [[1.2, 0.9, 1.05], [1.2, 0.9, 1.05, 0.98], [0.9, 1.1, 0.95]])
def test_of_values_to_and_fro_the_finest_counts_with_three_times_the_range(values):
    found = limit([1.0, 0.5, 0.25, 0.125][: len(values)], values)
    assert found.observed_order is None
    assert found.value == values[-1]
    assert found.half_width == pytest.approx(3.0 * np.ptp(values))


def test_equal_values_are_their_limit():
    assert limit(SIZES, [2.0, 2.0, 2.0], half_width=0.1) == (2.0, 0.1, None)


@pytest.mark.parametrize("order", [1.0, 2.0])
def test_the_interval_holds_the_limit_of_noisy_values(order):
    """Noise of a fifth of the finest error: at least 95 of 100 draws, as is asked of a grid convergence index."""
    draw, inside = np.random.default_rng(3), 0
    sizes = [1.0, 0.7, 0.5, 0.35, 0.25]
    noise = 0.2 * 3.0 * sizes[-1] ** order
    for _ in range(100):
        found = limit(sizes, np.array(values_of(sizes, order)) + noise * draw.uniform(-1.0, 1.0, len(sizes)))
        inside += abs(found.value - EXACT) <= found.half_width
    assert inside >= 95


def test_what_is_not_known_of_the_values_widens_the_interval():
    """Weights of order 2 on halved sizes are 4/3 and -1/3 of two values: more than the largest half width is left."""
    plain, wide = (limit(SIZES, values_of(SIZES, 2.0), half_width=d) for d in (0.0, 0.01))
    assert wide.half_width - plain.half_width > 0.01


def test_the_first_order_of_a_ratio_is_confirmed_as_such():
    found = limit([1e-2, 1e-3, 1e-4], [EXACT + 5 * r for r in (1e-2, 1e-3, 1e-4)], formal=1.0)
    assert found.value == pytest.approx(EXACT, abs=1e-9)
    assert found.half_width == pytest.approx(1.25 * 5e-4, rel=1e-6)
