"""Cases that must stay stable: no NaN, bounded velocities, a clear report, and a number for each."""

from verification.hard import (
    bonds_gone,
    cycles,
    impacts,
    overlap,
    recontact,
    size_ratio,
    step_limit,
    stiff_and_soft,
    stiff_stones,
    stiffness_jump,
)

TITLE = "Hard cases"
HEAD = """What is likely to break a computation, at the edge of what the codes promise. Every case demands finite numbers and
bounded velocities beside its own criterion; scenes of windows stand in `tests/hard` as they are. Where a computation cannot go
on it must say so: rows "ends with" count the messages."""
CASES = [bonds_gone, stiff_stones, stiffness_jump, cycles, recontact, size_ratio, overlap, impacts, step_limit, stiff_and_soft]
