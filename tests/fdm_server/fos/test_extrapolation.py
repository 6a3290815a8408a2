"""Richardson extrapolation and the grid convergence index, on values that are known to converge, and on such that do not."""

import pytest

from fdm_server.fos.extrapolation import extrapolate, observed_order


@pytest.mark.parametrize("order", [0.85, 1.0, 1.6])
@pytest.mark.parametrize("sizes", [(0.25, 0.5, 1.0), (0.3, 0.5, 0.6), (1.0, 1.2, 2.0)])
def test_the_order_and_the_limit_of_a_power_law(order, sizes):
    values = [1.4 + 0.3 * h**order for h in sizes]
    assert observed_order(sizes, values) == pytest.approx(order, abs=1e-9)
    found = extrapolate(sizes[::-1], values[::-1], [0.0] * 3)
    assert found.value == pytest.approx(1.4, abs=1e-9)
    assert found.safety == 1.25
    assert found.gci == pytest.approx(1.25 * (values[0] - 1.4) / values[0], rel=1e-9)
    assert found.from_brackets == 0.0


def test_roache_1994():
    """Fs = 3 with two meshes and an assumed order: 1.03 and 1.06 on h and 2 h go to 1.00."""
    found = extrapolate([0.5, 1.0], [1.03, 1.06], [0.001, 0.002])
    assert found.value == pytest.approx(1.0)
    assert (found.order, found.observed_order, found.safety) == (1.0, None, 3.0)
    assert found.gci == pytest.approx(3 * 0.03 / 1.03)
    assert found.from_brackets == pytest.approx(0.004)


@pytest.mark.parametrize("order", [0.85, 1.0, 1.6])
def test_four_meshes_are_fitted_together(order):
    """A power law is found again; noise as large as a bracket moves the limit by no more than the brackets are said to leave."""
    sizes = [0.25, 0.35, 0.5, 1.0]
    values = [1.4 + 0.3 * h**order for h in sizes]
    exact = extrapolate(sizes, values, [0.0] * 4)
    assert (exact.order, exact.value) == (pytest.approx(order, abs=1e-4), pytest.approx(1.4, abs=1e-5))
    noisy = extrapolate(sizes, [f + e for f, e in zip(values, (1e-3, -1e-3, 1e-3, -1e-3), strict=True)], [1e-3] * 4)
    assert noisy.from_brackets > 1e-3
    assert abs(noisy.value - 1.4) < 10 * noisy.from_brackets


@pytest.mark.parametrize("values", [[1.0, 1.1, 1.05], [1.0, 1.0, 1.1], [1.0, 1.1, 1.1], [1.0, 1.001, 1.5]])
def test_an_order_nobody_can_trust_is_not_used(values):
    found = extrapolate([1.0, 2.0, 4.0], values, [0.0] * 3)
    assert (found.order, found.safety) == (1.0, 3.0)


@pytest.mark.parametrize("values", [[1.0, 1.1, 1.0, 1.1], [1.0, 1.0001, 1.0002, 1.5]])
def test_four_meshes_that_follow_no_power_law(values):
    assert extrapolate([1.0, 2.0, 3.0, 4.0], values, [0.0] * 4).safety == 3.0


@pytest.mark.parametrize("count", [3, 4])
def test_a_low_order_gives_an_interval(count):
    """A slope of factor 1.000 whose finest mesh gives 1.077, the others by the order .62: a value at that order is .958."""
    sizes = [1.0, 2.0, 4.0, 8.0][:count]
    values = [0.958 + 0.119 * h**0.62 for h in sizes]
    found = extrapolate(sizes, values, [0.002] * count)
    assert found.value is None
    assert found.observed_order == pytest.approx(0.62, abs=1e-4)
    assert found.low < 0.958 < 1.0 < found.high < values[0]
    assert found.from_brackets > 0.002
    assert found.gci == pytest.approx(3.0 * (1.077 - 0.958) / 1.077, rel=1e-3)


@pytest.mark.parametrize("order", [0.2, 0.45])
@pytest.mark.parametrize("count", [3, 4])
def test_hardly_any_order_gives_nothing(order, count):
    sizes = [1.0, 2.0, 4.0, 8.0][:count]
    found = extrapolate(sizes, [0.9 + 0.2 * h**order for h in sizes], [0.0] * count)
    assert (found.value, found.low, found.high, found.gci) == (None, None, None, None)


@pytest.mark.parametrize("values", [[1.0, 1.2, 1.3], [1.0, 1.1, 1.2], [1.3, 1.1, 1.0], [1.0, 1.2, 1.3, 1.35]])
def test_values_that_go_away_have_no_order(values):
    """The finer the mesh, the larger the change: 1.3, 1.2, 1.0 are on the way to nowhere, not to .8 with the first order."""
    sizes = [1.0, 2.0, 4.0, 8.0][: len(values)]
    found = extrapolate(sizes, values, [0.0] * len(values))
    assert found.observed_order < 0.1
    assert (found.value, found.low, found.high) == (None, None, None)


def test_a_value_has_its_interval():
    found = extrapolate([0.5, 1.0], [1.03, 1.06], [0.001, 0.002])
    assert (found.low, found.high) == (pytest.approx(0.996), pytest.approx(1.004))


def test_one_mesh_says_nothing():
    with pytest.raises(ValueError, match="two or more different sizes"):
        extrapolate([1.0], [1.0], [0.0])


def test_brackets_may_hide_the_order():
    """Griffiths & Lane's slope on three coarse meshes: brackets of .4 % leave the first order possible, and an interval."""
    sizes, values = [2.5, 5 / 3, 1.25], [1.4086, 1.3845, 1.3661]
    assert extrapolate(sizes, values, [0.0] * 3).low is None
    found = extrapolate(sizes, values, [0.0028] * 3)
    assert found.value is None
    assert found.observed_order < 0.5
    assert found.low < 1.3444 < found.high < 1.3661
