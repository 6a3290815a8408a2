"""Gaussian-process regression: it passes through exact answers, averages over samples, and knows the bias of short tests."""

import numpy as np
import pytest

from colluvium.calibration.surrogate import Observation, Surrogate

ZERO, ONE = np.zeros(2), np.ones(1)


def surrogate(rows):
    return Surrogate(lambda x: np.array([0.5]), ONE, ZERO, rows)


def line(x):
    return 1.0 + 0.8 * x[0] - 0.3 * x[1]


def test_without_slopes_in_the_estimate_a_linear_law_is_learned():
    places = [np.array(p) for p in ((0.0, 0.0), (0.8, 0.0), (0.0, 0.8), (0.8, 0.8))]
    rows = [Observation(x, seed, False, np.array([line(x)])) for x in places for seed in range(4)]
    found = surrogate(rows)
    assert found.mean(np.array([0.4, 0.4]))[0] == pytest.approx(line([0.4, 0.4]), abs=0.03)
    assert found.slopes(np.array([0.4, 0.4]))[0] == pytest.approx([0.8, -0.3], abs=0.1)


def test_a_sample_that_deviates_everywhere_moves_the_mean_of_all_sets_and_not_the_slopes():
    places = [np.array([x, 0.0]) for x in (0.0, 0.5, 1.0)]
    rows = [Observation(x, seed, False, np.array([line(x) + 0.1 * (seed == 3)])) for x in places for seed in (1, 2)]
    more = [*rows, Observation(places[0], 3, False, np.array([line(places[0]) + 0.1]))]
    before, after = surrogate(rows), surrogate(more)
    gain = after.mean(places[2])[0] - before.mean(places[2])[0]
    assert 0.01 < gain < 0.06  # a third of 0.1, less what the scatter of samples explains
    assert after.slopes(places[1])[0][0] == pytest.approx(before.slopes(places[1])[0][0], abs=0.05)


def test_the_bias_of_short_tests_is_learned_from_one_set_with_both():
    x, y = ZERO, np.array([0.5, 0.0])
    rows = [Observation(x, 1, True, np.array([1.2])), Observation(x, 1, False, np.array([1.0]))]
    rows += [Observation(y, 1, True, np.array([1.5]))]
    found = surrogate(rows)
    assert found.mean(y, short=True)[0] == pytest.approx(1.5, abs=0.05)
    assert found.mean(y)[0] == pytest.approx(1.3, abs=0.07)


def test_an_answer_that_a_test_does_not_have_is_left_out():
    rows = [Observation(ZERO, 1, False, np.array([1.0, np.nan])), Observation(ZERO, 2, False, np.array([1.0, np.nan]))]
    found = Surrogate(lambda x: np.array([0.0, 7.0]), np.ones(2), ZERO, rows).mean(ZERO)
    assert found[0] == pytest.approx(1.0, abs=0.05)
    assert found[1] == 7.0
