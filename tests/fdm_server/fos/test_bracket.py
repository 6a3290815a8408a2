"""Bisection for a factor, on made-up slopes: ends that do not hold, trials without a verdict, contradictions."""

import pytest

from fdm_server.fos.bracket import WIDEST, Bracket, NoBracket, search
from fdm_server.fos.verdict import FAILS, RESTS, UNDECIDED


def slope(limit, undecided=(1.0, 1.0)):
    """An oracle of a slope with this factor of safety at a loss inside a span of factors; and the factors it was asked."""
    asked = []

    def oracle(factor):
        asked.append(factor)
        if undecided[0] < factor < undecided[1]:
            return UNDECIDED
        return RESTS if factor < limit else FAILS

    return oracle, asked


@pytest.mark.parametrize("limit", [0.31, 0.97, 1.2345, 1.49, 2.49, 17.0])
def test_the_factor_is_found_wherever_it_lies(limit):
    oracle, asked = slope(limit)
    found = search(oracle, (1.0, 1.5), 0.004)
    assert found.low < limit <= found.high
    assert found.high - found.low <= 0.004 * found.middle
    assert asked[:2] == [1.0, 1.5]  # both ends are tried, not believed
    assert len(asked) == len(set(asked)) < 25


def test_a_trial_without_a_verdict_stays_inside_the_bracket():
    """It counts neither as rest nor as failure: the bracket is narrowed from both sides and stays as wide as the unknown."""
    oracle, _ = slope(1.30, undecided=(1.28, 1.33))
    found = search(oracle, (1.0, 1.5), 0.004)
    assert found.low <= 1.28
    assert found.high >= 1.33
    assert found.undecided
    assert found.low < min(found.undecided)
    assert max(found.undecided) < found.high
    assert found.high - found.low < 0.05 + 2 * 0.004 * 1.3


def test_the_outermost_trials_may_be_undecided():
    """A bracket whose very ends give no verdict is widened beyond them."""
    oracle, _ = slope(1.2, undecided=(0.9, 1.6))
    found = search(oracle, (1.0, 1.5), 0.01)
    assert found.low <= 0.9
    assert found.high >= 1.6


def test_resting_above_a_failure_is_named():
    """Strength that does not act in one direction only: the lowest failure counts, and the rest above it is reported."""
    found = search(lambda f: FAILS if 0.8 < f < 1.4 else RESTS, (1.0, 1.5), 0.01)
    assert found.high == pytest.approx(0.8, abs=0.01)
    assert found.contradictions == [1.5]


@pytest.mark.parametrize(("verdict", "words"), [(RESTS, "fails"), (FAILS, "rests"), (UNDECIDED, "rests")])
def test_ground_that_never_fails_or_never_rests(verdict, words):
    with pytest.raises(NoBracket, match=f"no factor between .* {words}"):
        search(lambda f: verdict, (1.0, 1.5), 0.01)


@pytest.mark.parametrize("count", [1, 2, 3])
@pytest.mark.parametrize("limit", [0.31, 0.97, 1.2345, 2.49])
def test_trials_at_the_same_time_find_the_same_factor(limit, count):
    """Rounds of `count` factors; the bracket shrinks by count + 1 in each."""
    oracle, asked = slope(limit)
    bracket, rounds = Bracket(0.004), []
    while factors := bracket.next_factors((1.0, 1.5), count):
        bracket.refuse_endless(factors, (1.0, 1.5))
        rounds.append(factors)
        bracket.tried |= {factor: oracle(factor) for factor in factors}
    assert bracket.low < limit <= bracket.high
    assert bracket.high - bracket.low <= 0.004 * bracket.middle
    assert max(map(len, rounds)) <= count
    assert len(asked) == len(set(asked))
    if count == 1:
        assert bracket == search(slope(limit)[0], (1.0, 1.5), 0.004)


def test_rounds_narrow_the_bracket_from_both_sides_of_trials_without_a_verdict():
    oracle, _ = slope(1.25, undecided=(1.2, 1.3))
    bracket = Bracket(0.02)
    while factors := bracket.next_factors((1.0, 1.5), 2):
        bracket.tried |= {factor: oracle(factor) for factor in factors}
    assert bracket.low <= 1.2 < 1.3 <= bracket.high
    assert bracket.high - bracket.low < 0.15


def test_rounds_end_where_nothing_rests():
    bracket = Bracket(0.02)
    while min(factors := bracket.next_factors((1.0, 1.5), 2)) >= 1.0 / WIDEST:
        bracket.refuse_endless(factors, (1.0, 1.5))
        bracket.tried |= dict.fromkeys(factors, FAILS)
    with pytest.raises(NoBracket, match=r"no factor between .* rests"):
        bracket.refuse_endless(factors, (1.0, 1.5))
