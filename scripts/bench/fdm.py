"""Zone-steps a second of the continuum: by size, by law, by threads, beside a scalar loop and the memory's bandwidth.

Two states bound what a scene costs. *at rest*: no zone exceeds its strength. *flowing*: every triangle of every zone yields in
every step. A real slope lies between. Gridpoints are so heavy that their velocities stay as set: every step is the same work.
"""

from collections import Counter
from functools import partial
from statistics import median

import numpy as np

from bench import laws
from bench.operations import operations
from bench.scalar_zone import step_of_zones
from bench.timing_rows import in_turns, over, row, seconds_of_step
from fdm_server.step.blocks import from_blocks
from fdm_server.step.forces import corner_forces
from fdm_server.step.strain import strain_increments
from fdm_server.step.stress import limit, load, return_triangles

SIZES = {1_600: (40, 40), 10_000: (100, 100), 100_000: (400, 250), 1_000_000: (1000, 1000)}
THREADED = (100_000, 1_000_000)
LAW_SIZE = 1_600


def rows(fast, repeats, companion, say):
    """All rows, each as soon as it is known; `fast` takes small sizes and few steps. say(text): what is done."""
    work = 200_000 if fast else 8_000_000
    sizes = [1_600] if fast else list(SIZES)
    for size in sizes:
        yield from box_rows(size, work, repeats, companion, say)
    for size in (s for s in THREADED if s in sizes):
        yield from threads_rows(size, work, repeats, companion, say)
    yield from laws.rows(*SIZES[LAW_SIZE], work, repeats, companion, say)


def box_rows(size, work, repeats, companion, say):
    """A box at rest and flowing, each in turns with the scalar loop."""
    both = []
    for flowing in (False, True):
        name = f"Mohr-Coulomb, tension, flags; {'flowing' if flowing else 'at rest'}"
        say(f"preparing {size:,} zones, {name}")
        case = laws.Box(*SIZES[size], laws.FULL, flowing)
        case.settle()
        scalar = ScalarBox(case)
        say("measuring")
        steps, fewer = max(3, work // size), max(1, work // size // 4)
        ours, theirs = in_turns([partial(case.seconds, steps), partial(scalar.seconds, fewer)], repeats)
        both.append(size / median(ours))
        yield row(name, size, [size / s for s in ours], "zone-steps/s", companion)
        note = counted(size, both, companion["triad_GB_per_s"]) if flowing else ""
        yield row(f"scalar loop; {name}", size, [size / s for s in theirs], "zone-steps/s", companion, note)


def counted(size, rates, bandwidth):
    """What a zone-step asks for, and what share of the memory's bandwidth it takes at the measured rates, as a note."""
    present = ("mohr_coulomb", "tension")
    flowing = sum((operations(f, present=present) for f in (strain_increments, load, limit, corner_forces)), Counter())
    at_rest = flowing - operations(return_triangles, present=present)
    case = laws.Box(*SIZES[size], laws.FULL)
    g, m, s = case.model.geometry, case.model, case.state
    read = (*g, m.start, m.place, m.partition.order, m.pattern, m.mass, m.weight_mass, m.fixed)
    read += (s.velocity, s.applied, s.added_mass)
    both = (s.stress, s.plastic, s.displacement, s.velocity, s.force)
    bytes_ = (sum(a.nbytes for a in read) + 2 * sum(a.nbytes for a in (*both, s.corner_force))) / case.zones
    words = "; ".join(
        f"{name}: {c['flops']} flops, {c['divisions']} divisions, {c['roots']} roots, {c['selects']} selects"
        for name, c in (("at rest", at_rest), ("flowing", flowing))
    )
    share = [f"{100 * rate * bytes_ / bandwidth / 1e9:.0f} %" for rate in rates]
    return f"{words}; {bytes_:.0f} B, {' / '.join(share)} of the triad at rest / flowing"


class ScalarBox:
    """The scalar loop from the state of a box on, velocities of gridpoints left out."""

    def __init__(self, case):
        model, state = case.model, case.state
        stress = from_blocks(state.stress, case.zones)
        plastic = from_blocks(state.plastic, case.zones)[:, 0].copy()
        force, material = np.zeros_like(state.force), model.material_law
        parameters = (tuple(p[0]) for p in (material.elastic, material.mohr_coulomb, material.tension))
        self._arguments = (model.zones, model.grid.xy, state.velocity, *parameters, stress, plastic, force)

    def take(self, steps):
        """Takes steps."""
        for _ in range(steps):
            step_of_zones(*self._arguments)

    def seconds(self, steps):
        """Seconds of one step, from `steps` of them."""
        self.take(1)
        return seconds_of_step(self.take, steps)


def threads_rows(size, work, repeats, companion, say):
    """One and two threads in turn on the same state, and whether their bits are the same."""
    say(f"preparing {size:,} zones for one thread and two")
    cases = [laws.Box(*SIZES[size], laws.FULL, True, n) for n in (1, 2)]
    for case in cases:
        case.settle()
    say("measuring")
    found = in_turns([partial(case.seconds, max(3, work // size)) for case in cases], repeats)
    one, two = (case.state for case in cases)
    same = all(np.array_equal(getattr(one, n), getattr(two, n)) for n in ("stress", "force", "displacement"))
    name = "Mohr-Coulomb, tension, flags; flowing, thread by thread"
    for n, seconds in enumerate(found, start=1):
        yield row(name, size, [size / s for s in seconds], "zone-steps/s", companion, threads=n)
    yield row("two threads over one", size, over(*found), "-", companion, "bit-identical" if same else "BITS DIFFER", 2)
