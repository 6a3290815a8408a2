"""Disc-steps a second of the discs: by size, with bonds, in the paper's window, by law, beside a scalar loop.

All packings are settled: static mode, local damping .7, held from outside, no gravity. A step is motion and contact forces of
all discs in compiled code (cycle.py), without what the coupled run does between steps. At rest no list gets out of date, so a
build is timed by itself and one in `BUILD_EVERY` steps is added to the cost of a step, as in slow shear. Only free discs count.
Boxes have no reference gaps (8 bytes a pair more in a window). "list build" is the whole of it: pairs, histories, masses.
"""

from copy import deepcopy
from functools import partial
from pathlib import Path
from statistics import median
from types import SimpleNamespace

import numpy as np

from bench.dense_box import BOND, FRICTION, dense_box
from bench.scalar_disc import step_of_discs
from bench.timing_rows import in_turns, over, repeated, row, seconds_of_step
from coupler_protocol.compiled import threads as team
from coupler_protocol.compiled.jit import jit
from coupler_protocol.interface.ring import build_ring
from coupler_protocol.scene.reader import read_scene
from coupler_protocol.scene.tables.grading import Grading
from dem_server.effects.damping import Damping
from dem_server.effects.dashpot import Dashpot
from dem_server.effects.histories import history_of
from dem_server.effects.parallel_bond import ParallelBond
from dem_server.effects.rolling import Rolling
from dem_server.effects.spring import Spring
from dem_server.model import build_model
from dem_server.observe.unbalanced_ratio import unbalanced_ratio
from dem_server.packing import packing
from dem_server.packing.alone_window import rim_of
from dem_server.pairs import contacts as contacts_of
from dem_server.pairs import listed_pairs
from dem_server.step import bonds_made
from dem_server.step.contact_pass import contact_forces, force_pass
from dem_server.step.cycle import advance, stop
from dem_server.step.neighbours import rebuild
from dem_server.stones import bodies, mesostructure

SIZES = {2_500: (2, 2), 10_000: (4, 4), 50_000: (8, 10), 200_000: (16, 20)}  # tiles across and up
LAW_SIZE = 2_500
THREADED = (50_000, 200_000)  # the smaller one by two threads although they do not gain there
RATIOS = (1.0, 5.0, 20.0)  # of the largest to the smallest disc
BUILD_EVERY = 2_000  # steps: taken for slow shear, not measured here
SETTLING = 8  # times 50 steps, after which all discs are stopped: nothing else stops loose ones
SCENE = Path(__file__).resolve().parents[2] / "configs" / "paper_slope.toml"
OTHERS = {
    "bond": BOND,
    "rolling": Rolling(coefficient=0.1),
    "dashpot": Dashpot(normal=0.1, shear=0.1),
    "parallel_bond": ParallelBond(normal_stiffness=1e9, shear_stiffness=1e9, tension=1e9, shear=1e9),
}
LAWS = {"spring": {}, "spring, friction": {"friction": FRICTION}}
LAWS |= {f"spring, friction, {name}".replace("_", " "): {"friction": FRICTION, name: table} for name, table in OTHERS.items()}
LAWS |= {"all": {"friction": FRICTION} | OTHERS}


class Case:
    """A settled packing, `model` and `state`, bonded if its law has bonds."""

    def __init__(self, model, state, settling=SETTLING):
        self.model, self.state = model, state
        self.free = model.count - model.ring
        contact_forces(model, state)
        for _ in range(settling):
            advance(model, state, 0.0, 50)
            stop(state)
        if model.law.bond is not None:
            bonds_made.add_bonds(model, state)
        if model.law.parallel_bond is not None:
            bonds_made.add_parallel_bonds(model, state)
        advance(model, state, 0.0, 50)

    def take(self, steps):
        """Takes steps, in one compiled call."""
        advance(self.model, self.state, 0.0, steps)

    def seconds(self, steps):
        """Seconds of one step, from `steps` of them."""
        return seconds_of_step(self.take, steps)

    def seconds_of_pass(self, times):
        """Seconds of one force pass, from `times` of them over discs that stand still, so that no force changes."""
        stop(self.state)
        model, state = self.model, self.state
        tuples = tuple(state.listed), tuple(history_of(state)), tuple(model.parameters)
        arguments = (state.disc, state.load, *tuples, state.dt, state.counters, None)
        passes(1, arguments)
        return repeated(lambda: passes(times, arguments), 1, 1, warm_up=0)[0] / times

    def build(self, times):
        """Builds the list several times."""
        for _ in range(times):
            rebuild(self.model, self.state)

    def build_seconds(self):
        """Seconds of one build of the list."""
        return seconds_of_step(self.build, 1)

    def contacts(self):
        """Number of contacts."""
        return len(contacts_of(self.state).disc_a)

    def about(self):
        """What must be known of the packing to judge its numbers."""
        broken = self.state.broken_tension + self.state.broken_shear
        ratio = unbalanced_ratio(self.model, self.state, 0.0)
        bonds = f", {broken} bonds broken" if self.model.law.bond else ""
        return f"{self.contacts() / self.free:.2f} contacts a disc, unbalanced {ratio:.0e}{bonds}"

    def bytes_of_pair(self):
        """Bytes a listed pair of all that is kept of it."""
        shape = self.state.first.shape
        kept = [a for a in vars(self.state).values() if isinstance(a, np.ndarray) and a.shape == shape]
        return sum(a.nbytes for a in (*kept, *(self.state.parallel or ()))) / shape[0]


class ScalarCase:
    """The scalar loop from the state of a case with springs and friction on."""

    def __init__(self, case):
        model, s, self.free = case.model, case.state, case.free
        pairs, law = listed_pairs(s), model.law
        self.x, self.v, self.spin = s.x.copy(), s.v.copy(), s.spin.copy()
        self.shear, self.force, self.moment = pairs.shear_force.copy(), s.force.copy(), s.moment.copy()
        kind = pairs.kind[0]
        self._constant = (model.ring, law.damping.local, s.mass.copy(), s.inertia.copy(), s.radius.copy())
        self._pairs = pairs.disc_a.copy(), pairs.disc_b.copy()
        self._law = float(law.spring.normal[kind]), float(law.spring.shear[kind]), float(law.friction.coefficient[kind])

    def take(self, steps):
        """Takes steps."""
        moving = (self.x, self.v, self.spin, *self._pairs, *self._law, self.shear, self.force, self.moment)
        for _ in range(steps):
            step_of_discs(*self._constant, *moving)

    def seconds(self, steps):
        """Seconds of one step, from `steps` of them."""
        self.take(2)
        return seconds_of_step(self.take, steps)


def rows(fast, repeats, companion, say):
    """All rows, each as soon as it is known; `fast` takes the smallest box, larger discs in the window and few steps.

    say(text): what is done.
    """
    work = 250_000 if fast else 8_000_000
    for size in [2_500] if fast else SIZES:
        yield from box_rows(size, work, repeats, companion, say)
    for size in () if fast else THREADED:
        yield from threads_rows(size, work, repeats, companion, say)
    say("preparing the paper's window")
    yield from rows_of("paper window, bonded, stones as clumps", window(0.06 if fast else 0.03), work, repeats, companion)
    yield from ratio_rows(600 if fast else 6_000, work, repeats, companion, say)
    yield from law_rows(work, repeats, companion, say)


def box_rows(size, work, repeats, companion, say):
    """A dense box with friction alone, with contact bonds too, and under the scalar loop, in turns."""
    say(f"preparing a box of {size:,} discs, without and with bonds")
    smooth, bonded = (Case(*dense_box(*SIZES[size], friction=FRICTION, bond=bond)) for bond in (None, BOND))
    scalar, steps = ScalarCase(smooth), max(3, work // size)
    say("measuring")
    first, second, third = in_turns([partial(case.seconds, steps) for case in (smooth, bonded, scalar)], repeats)
    yield from rows_of("dense box, friction", smooth, work, repeats, companion, first)
    yield row("scalar loop; dense box, friction", size, [size / s for s in third], "disc-steps/s", companion, "no builds")
    yield from rows_of("dense box, friction, contact bonds", bonded, work, repeats, companion, second)
    name = "cost of a step with contact bonds over without"
    yield row(name, size, over(second, first), "-", companion, "step by step in turns")


def ratio_rows(size, work, repeats, companion, say):
    """Packings of about as many discs with other ratios of sizes, in turns, and what a disc costs there over equal discs."""
    say(f"preparing packings of {size:,} discs, sizes {', '.join(f'1:{ratio:g}' for ratio in RATIOS)}")
    cases = [Case(*graded(size, ratio)) for ratio in RATIOS]
    for case in cases:
        case.build_seconds()
    say("measuring")
    steps = in_turns([partial(case.seconds, max(3, work // size)) for case in cases], repeats)
    builds = in_turns([case.build_seconds for case in cases], repeats)
    for name, seconds in (("step", steps), ("list build", builds)):
        of_disc = [[s / case.free for s in each] for case, each in zip(cases, seconds, strict=True)]
        for ratio, case, values in zip(RATIOS, cases, of_disc, strict=True):
            nanoseconds = [1e9 * s for s in values]
            yield row(f"{name}; sizes 1:{ratio:g}", case.free, nanoseconds, "ns/disc", companion, case.about())
            yield row(f"{name} a disc; sizes 1:{ratio:g} over 1:1", case.free, over(values, of_disc[0]), "-", companion)


def graded(size, ratio, smallest=0.02):
    """Model and State of a square packed with about `size` discs of diameters from `smallest` [m] to `ratio` times that.

    Each class of sizes covers as much area as the others (linear over the logarithm); friction, no gravity.
    """
    grading = Grading(curve=[(smallest, 0.0), (smallest * max(ratio, 1.0 + 1e-6), 1.0)])
    side = float(np.sqrt(size * 0.25 * np.pi * grading.moment(2) / 0.84))
    absent = dict.fromkeys(("bond", "rolling", "dashpot", "parallel_bond"))
    soil = SimpleNamespace(density=2000.0, spring=Spring(normal=5e7, shear=2e7), friction=FRICTION, **absent)
    discs = SimpleNamespace(
        soil=soil, stone=None, stiffness="disc", damping=Damping(local=0.7), radius=0.5 * smallest, porosity=0.16,
        packing="relaxed", confinement=1e5, target="stress", grading=grading,
    )  # fmt: skip
    nodes = rim_of([(0.0, 0.0), (side, 0.0), (side, side), (0.0, side)], smallest * max(2.0, 0.5 * ratio))
    ring = build_ring(nodes, 0.5 * smallest * max(1.0, 0.125 * ratio))
    packed = packing.pack(nodes, ring.xy, ring.radius, discs, np.random.default_rng(1))
    return build_model(ring.xy, ring.radius, packed, discs, insitu=False)


def threads_rows(size, work, repeats, companion, say):
    """One and two threads in turn on copies of one state, bonds included, and whether their bits are the same."""
    say(f"preparing a box of {size:,} discs for one thread and two")
    model, state = dense_box(*SIZES[size], friction=FRICTION, bond=BOND)
    cases = [Case(model, deepcopy(state)) for _ in range(2)]
    say("measuring")

    def seconds(threads):
        team.set_size(threads)
        return cases[threads - 1].seconds(max(3, work // size))

    found = in_turns([partial(seconds, threads) for threads in (1, 2)], repeats)
    team.set_size(1)
    one, two = (case.state for case in cases)
    same = all(np.array_equal(getattr(one, name), getattr(two, name)) for name in ("disc", "load", "normal", "shear"))
    name = "dense box, friction, contact bonds; by threads"
    for threads, each in enumerate(found, start=1):
        yield row(name, size, [size / s for s in each], "disc-steps/s", companion, "no builds", threads)
    yield row("two threads over one", size, over(*found), "-", companion, "bit-identical" if same else "BITS DIFFER", 2)


def rows_of(name, case, work, repeats, companion, seconds=None):
    """Disc-steps a second of a case, builds included, and the cost of a build; `seconds` of a step if they are known."""
    seconds = seconds or [case.seconds(max(3, work // case.free)) for _ in range(repeats)]
    case.build_seconds()
    builds = [case.build_seconds() for _ in range(repeats)]
    build = median(builds) / BUILD_EVERY
    share = 100.0 * build / (median(seconds) + build)
    rates = [case.free / (s + build) for s in seconds]
    return [
        row(name, case.free, rates, "disc-steps/s", companion, f"{case.about()}, list build {share:.1f} %"),
        row(f"list build; {name}", case.free, [1e9 * s / case.free for s in builds], "ns/disc", companion),
    ]


def window(radius):
    """The window of the paper's slope: packed at the scene's confinement without the grid's stress, stones as clumps, bonded."""
    scene = read_scene(SCENE, [f"discs.radius={radius}"])
    hole, zone = scene.window[0], scene.grid.zone_size
    x0, x1, y0, y1 = (z * k for z, (low, high) in zip(zone, (hole.columns, hole.rows), strict=True) for k in (low, high + 1))
    nodes = rim_of([(x0, y0), (x1, y0), (x1, y1), (x0, y1)], zone[0])
    found = mesostructure.draw(nodes, scene.stones, np.random.default_rng([scene.seed, 1, *b"stones"]))
    ring = build_ring(nodes, scene.discs.radius)
    packed = packing.pack(nodes, ring.xy, ring.radius, scene.discs, np.random.default_rng([scene.seed, 1]))
    model, state = build_model(ring.xy, ring.radius, packed, scene.discs, scene.ring)
    contact_forces(model, state)
    bodies.assign_discs(model, state, found.outlines, scene.discs.stone.density)
    return Case(bodies.form_stones(model, state, found.outlines, scene.stones.body), state, settling=40)


def law_rows(work, repeats, companion, say):
    """Cost of the force pass a contact, laws in turns, and memory a pair under each law."""
    cases = []
    for law, effects in LAWS.items():
        say(f"preparing a box of {LAW_SIZE:,} discs, {law}")
        cases.append(Case(*dense_box(*SIZES[LAW_SIZE], **effects)))
        cases[-1].seconds_of_pass(1)
    say("measuring")
    found = in_turns([partial(case.seconds_of_pass, max(3, work // LAW_SIZE)) for case in cases], repeats)
    for law, case, seconds in zip(LAWS, cases, found, strict=True):
        number, note = case.contacts(), f"{case.bytes_of_pair():.0f} B/pair, {case.about()}"
        yield row(f"law: {law}", LAW_SIZE, [1e9 * s / number for s in seconds], "ns/contact", companion, note)


@jit(package="dem_server")
def passes(times, arguments):
    """`times` force passes."""
    for _ in range(times):
        force_pass(*arguments)
