"""Cases that must stay stable: no NaN, bounded velocities, a clear report, and a number for each."""

from verification.hard import (
    bonds_gone,
    bonds_gone_coupled,
    curved_rim,
    cycles,
    free_free,
    impacts,
    inverted_zone,
    large_discs,
    near_failure,
    off_the_line,
    overlap,
    pauses,
    peer_faults,
    quarter_turn,
    recontact,
    rim_contacts,
    rim_impacts,
    shaking,
    size_ratio,
    slow_peer,
    step_limit,
    stiff_and_soft,
    stiff_and_soft_plane,
    stiff_stones,
    stiffness_jump,
    stones_switched,
    stretched_rim,
    twenty_g,
    weak_ground,
    wrong_once,
)

TITLE = "Hard cases"
HEAD = """Cases that are likely to break a computation, at the limits of the codes. Every case requires finite numbers and
bounded velocities in addition to its own criterion; scenes of windows are in `tests/hard`. A computation that cannot
continue must say so: rows "ends with" count the messages."""
CASES = [bonds_gone, stiff_stones, stiffness_jump, cycles, recontact, size_ratio, overlap, impacts, step_limit, stiff_and_soft]
CASES += [pauses]
CASES += [large_discs, curved_rim, quarter_turn, free_free, off_the_line, bonds_gone_coupled]
CASES += [rim_contacts, stretched_rim, stiff_and_soft_plane]
CASES += [
    stones_switched,
    inverted_zone,
    peer_faults,
    slow_peer,
    twenty_g,
    near_failure,
    weak_ground,
    rim_impacts,
    shaking,
    wrong_once,
]
