"""Bisection between factors at which the ground rests and at which it fails, with undecided trials.

Both ends of the first bracket are tried, and moved outwards if they have the wrong verdict. An undecided trial counts as neither:
its factor stays inside the bracket, which is then narrowed from both sides.
"""

from dataclasses import dataclass, field

from fdm_server.fos.verdict import FAILS, RESTS, UNDECIDED

WIDEST = 64.0  # largest ratio of a factor to the first bracket
MOST = 60  # trials


class NoBracket(ArithmeticError):  # noqa: N818
    """No factor within WIDEST rests, or none fails."""


@dataclass
class Bracket:
    """The trials so far and their verdicts."""

    resolution: float
    tried: dict[float, str] = field(default_factory=dict)

    @property
    def high(self):
        """Lowest factor that fails, or None."""
        return min((f for f, v in self.tried.items() if v == FAILS), default=None)

    @property
    def low(self):
        """Highest factor that rests below `high`, or None."""
        high = self.high
        return max((f for f, v in self.tried.items() if v == RESTS and (high is None or f < high)), default=None)

    @property
    def undecided(self):
        """Factors within the bracket without a verdict."""
        return sorted(f for f, v in self.tried.items() if v == UNDECIDED and self.low < f < self.high)

    @property
    def contradictions(self):
        """Factors above `high` that rest nevertheless."""
        return sorted(f for f, v in self.tried.items() if v == RESTS and self.high is not None and f > self.high)

    @property
    def middle(self):
        """The factor found: middle of the bracket."""
        return 0.5 * (self.low + self.high)

    def next_factor(self, first):
        """The next factor to try, None when the search is complete. first: initial (low, high)."""
        for factor in first:
            if factor not in self.tried:
                return factor
        step = max(first[1] / first[0], 1.1)
        if self.low is None:
            return min(self.tried) / step
        if self.high is None:
            return max(self.tried) * step
        low, high, between = self.low, self.high, self.undecided
        for a, b in [(low, between[0]), (between[-1], high)] if between else [(low, high)]:
            if b - a > self.resolution * 0.5 * (a + b):
                return 0.5 * (a + b)
        return None

    def next_factors(self, first, count):
        """Up to `count` factors to try at the same time, [] when the search is complete. first: initial (low, high).

        They divide the bracket into equal parts: two trials at the same time reduce it to a third.
        """
        if ends := [factor for factor in first if factor not in self.tried]:
            return ends[:count]
        step = max(first[1] / first[0], 1.1)
        if self.low is None:
            return [min(self.tried) / step**k for k in range(1, count + 1)]
        if self.high is None:
            return [max(self.tried) * step**k for k in range(1, count + 1)]
        low, high, between = self.low, self.high, self.undecided
        parts = [(low, between[0]), (between[-1], high)] if between else [(low, high)]
        wide = [(a, b) for a, b in parts if b - a > self.resolution * 0.5 * (a + b)]
        if not wide:
            return []
        each = max(1, count // len(wide))
        return [a + (b - a) * k / (each + 1) for a, b in wide[:count] for k in range(1, each + 1)]

    def refuse_endless(self, factors, first):
        """Raises NoBracket if `factors`, the next to try, are too many or too far from the initial (low, high) `first`."""
        if len(self.tried) + len(factors) > MOST or any(not first[0] / WIDEST <= f <= first[1] * WIDEST for f in factors):
            kind = "rests" if self.low is None else "fails"
            raise NoBracket(f"no factor between {min(self.tried):.4g} and {max(self.tried):.4g} {kind} within the given steps")


def search(oracle, first, resolution):
    """The Bracket at the end of a search. oracle(factor) gives a verdict; first: initial (low, high).

    Raises NoBracket if no factor between first[0]/64 and 64 first[1] rests, or none fails.
    """
    bracket = Bracket(resolution)
    while (factor := bracket.next_factor(first)) is not None:
        bracket.refuse_endless([factor], first)
        bracket.tried[factor] = oracle(factor)
    return bracket
