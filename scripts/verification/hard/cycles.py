"""A hundred thousand cycles of stick and slip.

The contact of the discrete case stick-slip, 16 steps a cycle (so that sticking begins and ends at steps), 100,000 cycles: the
work against the closed form.
"""

from verification.discrete import stickslip
from verification.verdict_rows import row

NAME = "cycles"


def rows(fast):
    """100,000 cycles (fast: 1,000)."""
    cycles = 1000 if fast else 100_000
    done, _, expected = stickslip.slipping(cycles, 16)
    yield row(f"work of {cycles:,} cycles of slip [J]", done, expected, 1e-3, "closed form")
