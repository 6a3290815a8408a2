"""Zone-steps a second of the continuum: by size, by law, by threads, beside a scalar loop and the memory's bandwidth.

Two states bound what a scene costs. *at rest*: no zone exceeds its strength. *flowing*: every triangle of every zone yields in
every step. A real slope lies between. Gridpoints are so heavy that their velocities stay as set: every step is the same work.
"""

from collections import Counter
from statistics import median

import numpy as np

from bench import laws
from bench.operations import operations
from bench.scalar_zone import step_of_zones
from bench.timing_rows import repeated, row, triad
from fdm_server.step.blocks import from_blocks
from fdm_server.step.forces import corner_forces
from fdm_server.step.strain import strain_increments
from fdm_server.step.stress import limit, load, return_triangles

SIZES = {1_600: (40, 40), 10_000: (100, 100), 100_000: (400, 250), 1_000_000: (1000, 1000)}
THREADED = (100_000, 1_000_000)
LAW_SIZE = 1_600


def run(fast, repeats):
    """All rows; `fast` takes small sizes and few steps."""
    work = 200_000 if fast else 8_000_000
    companion = {"triad_GB_per_s": median(triad(repeats, 1_000_000 if fast else 8_000_000))}
    sizes = [1_600] if fast else list(SIZES)
    rows = []
    for size in sizes:
        for flowing in (False, True):
            name = f"Mohr-Coulomb, tension, flags; {'flowing' if flowing else 'at rest'}"
            case = laws.Box(*SIZES[size], laws.FULL, flowing)
            rows.append(row(name, size, case.rates(work, repeats), "zone-steps/s", companion))
            rows.append(row(f"scalar loop; {name}", size, scalar_rates(case, work, repeats), "zone-steps/s", companion))
        both = [r["value"] for r in rows if r["size"] == size and r["name"].startswith("Mohr")]
        rows[-1]["note"] = counted(size, both, companion["triad_GB_per_s"])
    for size in (s for s in THREADED if s in sizes):
        rows += threads_rows(size, work, repeats, companion)
    return rows + laws.rows(*SIZES[LAW_SIZE], work, repeats, companion)


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


def scalar_rates(case, work, repeats):
    """Zone-steps a second of the scalar loop from the state of `case` on, velocities of gridpoints left out."""
    model, state = case.model, case.state
    stress = from_blocks(state.stress, case.zones)
    plastic = from_blocks(state.plastic, case.zones)[:, 0].copy()
    force, material = np.zeros_like(state.force), case.model.material_law
    parameters = (tuple(p[0]) for p in (material.elastic, material.mohr_coulomb, material.tension))
    args = (model.zones, model.grid.xy, state.velocity, *parameters, stress, plastic, force)
    steps = max(1, work // case.zones // 4)
    return [case.zones / seconds for seconds in repeated(lambda: step_of_zones(*args), steps, repeats, warm_up=1)]


def threads_rows(size, work, repeats, companion):
    """One and two threads in turn on the same state, and whether their bits are the same."""
    cases = [laws.Box(*SIZES[size], laws.FULL, True, n) for n in (1, 2)]
    for case in cases:
        case.settle()
    found = [[], []]
    for _ in range(repeats):
        for values, case in zip(found, cases, strict=True):
            values += [size / s for s in repeated(case.step, max(3, work // size), 1, warm_up=1)]
    one, two = (case.state for case in cases)
    same = all(np.array_equal(getattr(one, n), getattr(two, n)) for n in ("stress", "force", "displacement"))
    name = "Mohr-Coulomb, tension, flags; flowing, thread by thread"
    rows = [row(name, size, values, "zone-steps/s", companion, threads=n) for n, values in enumerate(found, start=1)]
    ratios = [two / one for one, two in zip(*found, strict=True)]
    rows.append(row("two threads over one", size, ratios, "-", companion, "bit-identical" if same else "BITS DIFFER", 2))
    return rows
