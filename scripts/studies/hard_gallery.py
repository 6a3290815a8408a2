"""Ten hard cases, computed by a naive scheme and by this project; writes docs/pictures/hard_cases.png.

    python scripts/studies/hard_gallery.py [--fast] [--json FILE] [--picture FILE]

Every panel has two curves, both from runs of the kernels of this project: the naive scheme lacks one rule (docs/theory.md says
which), all else is the same. A curve of this project that ends early is a run that stopped with a message. --fast: fewer steps.
"""

import argparse
import json
import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))  # what the scripts share

from verification.coupling import energy as coupled_energy
from verification.discrete.discs import KN, loose_discs
from verification.hard import stiffness_jump
from verification.hard.coupled_system import at_share, excite, system
from verification.hard.free_body import SIZE, body
from verification.hard.watched import scene_of

from colluvium.figures.style import styled
from coupler_protocol.interface.ring import build_ring
from coupler_protocol.scene.reader import build_scene
from dem_server.effects.damping import Damping
from dem_server.effects.friction import Friction
from dem_server.observe import energy
from dem_server.observe.unbalanced_ratio import unbalanced_ratio
from dem_server.packing import alone_window, packing
from dem_server.step.contact_pass import add_forces, contact_forces
from dem_server.step.cycle import advance, in_real_time, in_static_mode
from dem_server.step.motion import move_free
from dem_server.step.neighbours import rebuild
from dem_server.stones import bodies, mesostructure

PICTURE = Path(__file__).resolve().parents[2] / "docs" / "pictures" / "hard_cases.png"
ENOUGH = 1e8  # growth at which a naive curve ends
UTM = np.array([412345.0, 5300000.0])  # [m]
R = 0.03  # radius of the discs in panels of two discs [m]


class Panel(NamedTuple):
    """What was asked, what the naive scheme lacks, axes, and the curves (x, y) of the naive scheme and of this project."""

    asked: str
    naive: str
    x: str
    y: str
    curves: tuple
    log: bool = True


def growing(values):
    """The values up to the first one that is not finite or ENOUGH times the first."""
    values = np.asarray(values, dtype=float)
    wrong = np.flatnonzero(~(values < ENOUGH * values[0]))
    return values[: wrong[0]] if len(wrong) else values


def over_steps(naive, ours, every=1):
    """Curves over steps, each relative to its first value."""
    found = []
    for values in (naive, ours):
        kept = growing(values)
        found.append((every * np.arange(len(kept)), kept / kept[0]))
    return tuple(found)


def speeds(found, steps):
    """Largest speed after each of so many steps, until it has grown ENOUGH."""
    seen = []
    for _ in range(steps):
        found.step()
        seen.append(found.speed())
        if not seen[-1] < ENOUGH * seen[0]:
            break
    return seen


def stiff_contacts(few):
    """Contacts a thousand times as stiff as the zones."""
    seen = []
    for rule in (False, True):
        found = system(1000.0, 1 / 4, 0.8)
        if not rule:
            found.state.added_mass[:] = 0.0
        window = found.windows[0]
        free = window.state.v[window.model.ring :]
        free[:] = 1e-9 * np.random.default_rng(1).normal(size=free.shape)
        seen.append(speeds(found, 200 // few))
    asked = "contacts 1,000 times as stiff as zones, damped"
    return Panel(asked, "no mass rule at the rim", "steps", "largest speed", over_steps(*seen))


def step_too_long(few):
    """Steps on both sides of the stability limit."""
    seen = []
    for share in (1.01, 0.99):
        found, mode = at_share(system(1.0, 1 / 4, 0.0), share)
        excite(found, mode, 1e-9 / 4, np.random.default_rng(0))
        seen.append(speeds(found, 400 // few))
    return Panel("the longest step, undamped", "step 1 % above the limit", "steps", "largest speed", over_steps(*seen))


def with_forces(choose, steps):
    """Energies of the free body, every tenth step, if choose(forces of all steps so far) acts on its rim."""
    joined, kept = body(), []

    def hang(gravity=0.0):
        kept.append(joined.rim.nodal_forces(joined.discs).copy())
        del kept[:-20]
        joined.grid.applied[joined.nodes] = choose(kept)

    joined.hang = hang
    return coupled_energy.followed(joined, steps, 1e-6 * SIZE, every=10)[0]


def coupled_body(asked, naive, choose, steps):
    """Panel of the free, undamped body."""
    curves = over_steps(with_forces(choose, steps), with_forces(lambda kept: kept[-1], steps), 10)
    return Panel(asked, naive, "steps", "energy", curves)


def late_forces(few):
    """Forces of the step before, as by two codes that exchange at the same moment."""
    return coupled_body("both codes compute at once", "forces one step late", lambda kept: kept[-2:][0], 2000 // few)


def held_forces(few):
    """Forces held over ten steps."""
    age = [0, None]

    def held(kept):
        if age[0] % 10 == 0:
            age[1] = kept[-1]
        age[0] += 1
        return age[1]

    return coupled_body("few exchanges, undamped", "forces held over ten steps", held, 2000 // few)


def lost_messages(few):
    """Every twentieth message is lost and not asked for again."""
    rng, last = np.random.default_rng(3), [None]

    def lossy(kept):
        if last[0] is None or rng.random() > 0.05:
            last[0] = kept[-1]
        return last[0]

    return coupled_body("5 % of the messages are lost", "the last force acts again", lossy, 4000 // few)


def off_the_line(few):
    """Control discs outside of their segments."""
    steps, shift = 9000 // few, 3.0 * coupled_energy.R
    naive, ours = (coupled_energy.shaken(steps, mapping=name, shift=shift)[0] for name in ("paper", "work-consistent"))
    return Panel("control discs off their segments, undamped", "the paper's mapping", "steps", "energy", over_steps(naive, ours))


def pair(gap, speed):
    """Model and State of two discs with a gap [m]; the left one moves at `speed` [m/s] towards the other, in real time."""
    model, state = loose_discs([[0.0, 0.0], [2.0 * R + gap, 0.0]], [R, R], bond=None, friction=None, damping=None)
    model = in_real_time(model, state, 0.05)
    state.v[0, 0] = speed
    return model, state


def distances(model, state, forces, steps):
    """Distance of the right disc from the left one over 2 R, signed, after each step; forces(model, state): the contact pass."""
    state.dt = state.next_dt
    seen = []
    for _ in range(steps):
        move_free(model, state, 0.0)
        forces(model, state)
        seen.append((state.x[1, 0] - state.x[0, 0]) / (2.0 * R))
    return np.array(seen)


def over_time(state, values, step=None):
    """A curve over milliseconds."""
    return 1e3 * (state.dt if step is None else step) * np.arange(1, len(values) + 1), values


def stale_list(few):
    """Contacts of a list of pairs that nobody renews."""
    curves, steps = [], 2500
    for forces in (add_forces, contact_forces):
        model, state = pair(0.5 * R, 5.0)
        curves.append(over_time(state, distances(model, state, forces, steps)))
    return Panel("two discs meet", "the list of pairs is not renewed", "ms", "distance / 2R", tuple(curves), log=False)


def soft_springs(few):
    """An impact that the spring cannot stop."""
    mass = 2000.0 * np.pi * R**2
    speed = 1.3 * 2.0 * R * (2.0 * KN / mass) ** 0.5
    model, state = pair(0.1 * R, speed)
    naive = over_time(state, distances(model, state, contact_forces, 120))
    model, state = pair(0.1 * R, speed)
    seen, time = [], []
    try:
        for _ in range(120):
            time.append((time[-1] if time else 0.0) + 1e3 * advance(model, state, 0.0, 1))
            seen.append((state.x[1, 0] - state.x[0, 0]) / (2.0 * R))
    except ArithmeticError:
        time = time[: len(seen)]
    ours = np.array(time), np.array(seen)
    return Panel("faster than a spring can stop", "no guard: discs pass", "ms", "distance / 2R", (naive, ours), log=False)


def switched_stones(few):
    """Stones become ten thousand times as stiff under stress."""
    scene, curves = build_scene(scene_of("stiff_stones")), []
    for keeps in (False, True):
        nodes = alone_window.rim_of(scene.window[0].polygon, 4.0 * scene.discs.radius)
        found = mesostructure.draw(nodes, scene.stones, np.random.default_rng(11))
        ring = build_ring(nodes, scene.discs.radius)
        discs = packing.pack(nodes, ring.xy, ring.radius, scene.discs, np.random.default_rng(11))
        model, state = alone_window.bare(scene, discs, reference_gap=True)
        contact_forces(model, state)
        bodies.assign_discs(model, state, found.outlines, scene.discs.stone.density)
        stored = energy.stored(model, state)
        model = bodies.stiffen_stones(model, state)
        if not keeps:
            state.reference_gap[:] = 0.0
        contact_forces(model, state)
        model, seen, time = in_real_time(model, state, 0.05), [], [0.0]
        for _ in range(100 // few):
            time.append(time[-1] + 1e3 * advance(model, state, 0.0, 20))
            seen.append((energy.kinetic(model, state) + energy.stored(model, state)) / stored)
        curves.append((np.array(time[1:]), np.array(seen)))
    asked = "stones 10,000 times stiffer, switched on under stress"
    return Panel(asked, "contacts lose their reference", "ms", "energy / stored before", tuple(curves))


def far_away(few):
    """A box of discs at UTM coordinates."""
    curves = []
    for place in (UTM, np.zeros(2)):
        model, state, _ = stiffness_jump.mixed(1.75, friction=Friction(coefficient=0.55), damping=Damping(local=0.7))
        state.x[:] += place
        state.walls.ends[:] += np.tile(place, 2)
        rebuild(model, state)
        model = in_static_mode(model, state)
        steps, seen = 1000 * np.arange(1, 1 + 60 // few), []
        for _ in steps:
            advance(model, state, 0.0, 1000)
            seen.append(unbalanced_ratio(model, state, 0.0))
        curves.append((steps, np.array(seen)))
    asked = "at rest at UTM coordinates, E 412345 N 5300000"
    return Panel(asked, "positions from the origin of UTM", "steps", "unbalanced ratio", tuple(curves))


PANELS = (
    stiff_contacts, step_too_long, late_forces, held_forces, lost_messages, off_the_line, stale_list, soft_springs,
    switched_stones, far_away,
)  # fmt: skip


@styled
def draw(panels, path):
    """One axes a panel: the naive scheme in red, this project in blue."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(5, 2, figsize=(10.2, 13.0), layout="constrained")
    for place, panel in zip(axes.flat, panels, strict=True):
        for (x, y), name, colour in zip(panel.curves, (panel.naive, "this project"), ("#d0472f", "#123a5e"), strict=True):
            place.plot(x, y, color=colour, label=name, lw=1.2)
            place.plot(x[-1:], y[-1:], "o", color=colour, markersize=3)
        place.set(title=panel.asked, xlabel=panel.x, ylabel=panel.y)
        if panel.log:
            place.set_yscale("log")
        place.legend(fontsize=7.5)
    figure.savefig(path)
    plt.close(figure)


def as_row(panel):
    """A panel for JSON."""
    return panel._asdict() | {"curves": [[list(map(float, part)) for part in curve] for curve in panel.curves]}


def main(argv=None):
    """Compute, print, draw."""
    parser = argparse.ArgumentParser(description=__doc__.partition(";")[0])
    parser.add_argument("--fast", action="store_true", help="fewer steps")
    parser.add_argument("--json", metavar="FILE", type=Path, help="write the curves to FILE")
    parser.add_argument("--picture", metavar="FILE", type=Path, default=PICTURE)
    options = parser.parse_args(argv)
    panels = []
    for compute in PANELS:
        panel = compute(4 if options.fast else 1)
        panels.append(panel)
        (_, naive), (_, ours) = panel.curves
        print(f"{panel.asked:<55} {panel.naive:<34} ends at {naive[-1]:10.3g}, this project at {ours[-1]:10.3g}", flush=True)
    if options.json:
        options.json.write_text(json.dumps([as_row(panel) for panel in panels]) + "\n", encoding="utf-8")
    draw(panels, options.picture)


if __name__ == "__main__":
    main()
