"""Verdicts over made-up motions: rest, steady flow, and those that only look like one of them for a while."""

import numpy as np
import pytest

from fdm_server.fos.verdict import FAILS, LEAST, LEAST_CONSTANT, RESTS, Span, verdict

RATIO, SETTLEMENT = 1e-5, 0.01


def outcome(motion, ratio, similarity=1.0, spans=200, gone=0.0):
    """(verdict, spans it took) of a trial with motion(k) [m] and ratio(k) in its k-th span."""
    seen = []
    for k in range(1, spans + 1):
        seen.append(Span(ratio(k), ratio(k), motion(k), similarity))
        found = verdict(seen, RATIO, SETTLEMENT, gone * k)
        if found:
            return found, k
    return None, spans


def test_motion_that_dies_away_rests():
    found, spans = outcome(lambda k: 1e-3 * 0.3**k, lambda k: 1e-3 * 0.3**k)
    assert found == RESTS
    assert spans < 10


@pytest.mark.parametrize("power", [0.0, 0.5, 1.0])
def test_steady_or_growing_flow_fails(power):
    """A constant unbalanced force makes the speed grow with the steps; friction of the mesh may keep it constant."""
    assert outcome(lambda k: 1e-3 * k**power, lambda k: 1e-4) == (FAILS, LEAST)


def test_a_low_ratio_alone_is_no_rest():
    """Slow flow can pass below the ratio: as long as it moves, the trial goes on."""
    assert outcome(lambda k: 2e-5, lambda k: 5e-6, similarity=0.0)[0] is None


def test_growth_alone_is_no_failure():
    """Below its limit a slope can move faster and faster while its unbalanced force falls, and come to rest after all."""
    found, spans = outcome(lambda k: 1e-4 * min(k, 40) * 0.2 ** max(0, k - 40), lambda k: 0.02 * k**-2.0 * 0.5 ** max(0, k - 40))
    assert found == RESTS
    assert spans > 40


def test_motion_to_and_fro_is_no_flow():
    """Oscillation keeps neither its direction nor its shape."""
    assert outcome(lambda k: 1e-3, lambda k: 1e-3, similarity=-0.9)[0] is None


def test_slow_noise_is_no_flow():
    """Steady motion that goes nowhere: a hundredth of a per cent of the settlement a span."""
    assert outcome(lambda k: 1e-6, lambda k: 1e-4, spans=100)[0] is None


def test_a_run_out_fails_whatever_the_forces_say():
    assert outcome(lambda k: 1e-3 * np.sin(k) ** 2, lambda k: 1e-6, similarity=0.0, gone=20.0) == (FAILS, 6)


def test_constant_flow_fails_without_any_unbalanced_force():
    """The stresses of a mechanism at its limit balance: nothing brakes it, and the ratio falls for ever."""
    found, spans = outcome(lambda k: 1.645e-2 * (1.0 + 1.0 / k), lambda k: 1e-3 / k**2)
    assert found == FAILS
    assert LEAST_CONSTANT <= spans <= 64


@pytest.mark.parametrize("motion", [
    lambda k: 1e-2 / k,  # creep, displacements as log n
    lambda k: 1e-2 * k**-0.2,
    lambda k: 1e-2 * np.exp(-k / 300.0),  # an age of 1.5 time constants at the end: it is dying away
    lambda k: 1e-3 * np.sin(np.pi * min(k, 199) / 200.0),  # grows, stops
    lambda k: 1e-4 * k * np.exp(-k / 50.0),
    lambda k: 1e-3 * (k / 40) ** 2 if k < 40 else 1e-3 * np.exp(-(k - 40) / 20.0),
])  # fmt: skip
def test_creep_that_dies_away_is_no_constant_flow(motion):
    """With a ratio that falls as well: no verdict, or rest, as long as it is looked at."""
    assert outcome(motion, lambda k: 1e-2 * 0.8**k)[0] != FAILS


def test_constant_flow_that_goes_nowhere_is_none():
    assert outcome(lambda k: 1e-5, lambda k: 1e-2 * 0.8**k)[0] is None


def test_flow_that_changes_its_shape_is_not_constant():
    assert outcome(lambda k: 1e-2, lambda k: 1e-2 * 0.8**k, similarity=0.97)[0] is None
