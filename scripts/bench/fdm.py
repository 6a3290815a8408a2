"""Zone-steps a second of the continuum: by size, by law, by threads, beside a scalar loop and the memory's bandwidth.

Two states bound what a scene costs. *at rest*: no zone exceeds its strength. *flowing*: every triangle of every zone yields in
every step. A real slope lies between. Gridpoints are so heavy that their velocities stay as set: every step is the same work.
"""

from collections import Counter
from dataclasses import fields, is_dataclass
from statistics import median

import numpy as np

from bench import laws
from bench.operations import operations
from bench.rows import repeated, row, triad
from bench.scalar_zone import step_of_zones
from coupler_protocol import team
from coupler_protocol.scene_reader import build_scene
from fdm_server.advance import advance
from fdm_server.blocks import from_blocks
from fdm_server.forces import corner_forces
from fdm_server.grid import build_grid
from fdm_server.model import build_model, new_state
from fdm_server.motion import update_velocities
from fdm_server.shape import begin_large_strain
from fdm_server.strain import strain_increments
from fdm_server.stress import limit, load, return_triangles

SIZES = {1_600: (40, 40), 10_000: (100, 100), 100_000: (400, 250), 1_000_000: (1000, 1000)}
THREADED = (100_000, 1_000_000)
LAW_SIZE = 1_600
ELASTIC = {"elastic": {"bulk": 5e8, "shear": 1.5e8}}
MOHR_COULOMB = ELASTIC | {"mohr_coulomb": {"friction": 30.0, "cohesion": 5e4}}
FULL = MOHR_COULOMB | {"tension": {"strength": 1e2}}
LAWS = {
    "elastic": (ELASTIC, {}),
    "Mohr-Coulomb": (MOHR_COULOMB, {}),
    "Mohr-Coulomb, tension": (FULL, {}),
    "elastic, large strain": (ELASTIC, {"large_strain": True}),
    "Mohr-Coulomb, tension, large strain": (FULL, {"large_strain": True}),
}
PRESSURE = -1e6  # [Pa], so that neither tension nor shear yields at rest
REST, FLOW = 1e-15, 1e-3  # shear strain a step; flow: every triangle yields after a few steps


class Case:
    """A box of zones of 1 m under one law, at rest or flowing."""

    def __init__(self, size, law="Mohr-Coulomb, tension", flowing=False, threads=1):
        tables, kept = LAWS[law]
        nx, ny = SIZES[size]
        self.zones, self.flowing = nx * ny, flowing
        box = {"kind": "box", "length": float(nx), "height": float(ny), "zone_size": 1.0} | kept
        scene = build_scene(
            {
                "format": 1, "seed": 1, "grid": box, "damping": {"local": 0.8},
                "material": [{"name": "soil", "density": 2000.0} | tables],
                "stage": [{"name": "overload", "until": {"steps": 1}}],
            }
        )  # fmt: skip
        before = team.size()
        team.set_size(threads)
        self.model = build_model(scene, build_grid(scene))
        team.set_size(before)
        self.state = new_state(self.model)
        self.state.stress[:, :32] = PRESSURE  # sm and zz
        self.state.added_mass[:] = 1e60
        x, y = self.model.grid.xy.T
        speed = FLOW if flowing else REST
        self.state.velocity[:] = speed * np.column_stack([y + 0.5 * np.sin(y), 0.3 * (x + 0.5 * np.sin(2.0 * x))])  # keeps volume
        if kept.get("large_strain"):
            begin_large_strain(self.model, self.state)

    def step(self):
        """One step of zones and gridpoints."""
        update_velocities(self.model, self.state, 9.81)
        advance(self.model, self.state)

    def settle(self):
        """Steps until every triangle yields (flowing), and as a warm-up."""
        for _ in range(30 if self.flowing else 3):
            self.step()
        if self.state.plastic is not None:
            yields = from_blocks(self.state.plastic, self.zones) & 3 > 0
            if bool(yields.all()) != self.flowing or bool(yields.any()) != self.flowing:
                raise ArithmeticError(f"{yields.mean():.1%} of the zones yield, flowing={self.flowing}")

    def rates(self, work, repeats):
        """Zone-steps a second in runs of about `work` zone-steps."""
        self.settle()
        return [self.zones / seconds for seconds in repeated(self.step, max(3, work // self.zones), repeats, warm_up=1)]

    def allocated(self):
        """Bytes a zone of Model and State."""
        return (_bytes(self.model) + _bytes(self.state)) / self.zones


def run(fast, repeats):
    """All rows; `fast` takes small sizes and few steps."""
    work = 200_000 if fast else 8_000_000
    companion = {"triad_GB_per_s": median(triad(repeats, 1_000_000 if fast else 8_000_000))}
    sizes = [1_600] if fast else list(SIZES)
    rows = []
    for size in sizes:
        for flowing in (False, True):
            name = f"Mohr-Coulomb, tension, flags; {'flowing' if flowing else 'at rest'}"
            case = Case(size, flowing=flowing)
            rows.append(row(name, size, case.rates(work, repeats), "zone-steps/s", companion))
            rows.append(row(f"scalar loop; {name}", size, scalar_rates(case, work, repeats), "zone-steps/s", companion))
        both = [r["value"] for r in rows if r["size"] == size and r["name"].startswith("Mohr")]
        rows[-1]["note"] = counted(size, both, companion["triad_GB_per_s"])
    for size in (s for s in THREADED if s in sizes):
        rows += threads_rows(size, work, repeats, companion)
    return rows + law_rows(work, repeats, companion) + laws.rows(*SIZES[LAW_SIZE], work, repeats, companion)


def counted(size, rates, bandwidth):
    """What a zone-step asks for, and what share of the memory's bandwidth it takes at the measured rates, as a note."""
    laws = ("mohr_coulomb", "tension")
    flowing = sum((operations(f, present=laws) for f in (strain_increments, load, limit, corner_forces)), Counter())
    at_rest = flowing - operations(return_triangles, present=laws)
    case = Case(size)
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
    laws = (tuple(p[0]) for p in (material.elastic, material.mohr_coulomb, material.tension))
    args = (model.zones, model.grid.xy, state.velocity, *laws, stress, plastic, force)
    steps = max(1, work // case.zones // 4)
    return [case.zones / seconds for seconds in repeated(lambda: step_of_zones(*args), steps, repeats, warm_up=1)]


def threads_rows(size, work, repeats, companion):
    """One and two threads in turn on the same state, and whether their bits are the same."""
    cases = [Case(size, flowing=True, threads=n) for n in (1, 2)]
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


def law_rows(work, repeats, companion):
    """Cost and memory of each law at 1,600 zones."""
    rows = []
    for law, (tables, kept) in LAWS.items():
        for flowing in (False, True) if "mohr_coulomb" in tables and not kept else (False,):
            case = Case(LAW_SIZE, law, flowing)
            name = f"law: {law}" + (", flowing" if flowing else "")
            nanoseconds = [1e9 / rate for rate in case.rates(work, repeats)]
            rows.append(row(name, LAW_SIZE, nanoseconds, "ns/zone-step", companion, f"{case.allocated():.0f} B/zone"))
    return rows


def _bytes(thing):
    """Bytes of all arrays below a dataclass or tuple."""
    if isinstance(thing, np.ndarray):
        return thing.nbytes
    if is_dataclass(thing):
        return sum(_bytes(getattr(thing, field.name)) for field in fields(thing))
    return sum(map(_bytes, thing)) if isinstance(thing, tuple) else 0
