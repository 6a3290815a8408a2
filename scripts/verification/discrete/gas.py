"""Discs that collide without damping and friction keep their energy at the default real-time step.

36 discs of three sizes in a box of walls, random velocities of 0.3 or 3 m/s; 25 discs and five rigid stones likewise. The
energy is kinetic plus stored, averaged over 400 steps at the beginning and at the end.

Each contact changes the energy of two bodies by a little, up or down by how it falls between the steps, so the error of many
bodies averages out and that of one disc between two held ones, the last two columns, is a random walk.
"""

import numpy as np

from coupler_protocol.scene.scene import scene_class
from dem_server.observe import energy
from dem_server.step.cycle import advance, in_real_time
from dem_server.step.neighbours import rebuild
from dem_server.step.walls import make_walls
from verification.discrete import conservation
from verification.discrete.discs import loose_discs, with_held
from verification.verdict_rows import row

NAME = "gas"
R, SIDE = 0.03, 6
BOX = SIDE * 2.2 * R


def default_fraction():
    """Share of the stable step that scenes take where they say nothing."""
    discs = scene_class().model_fields["discs"].annotation.__args__[0]
    return discs.model_fields["time_step"].default


def gas(speed, fraction):
    """Discs of three sizes in a box, moving at random."""
    rng = np.random.default_rng(4)
    side = (np.arange(SIDE) + 0.5) * 2.2 * R
    xy = np.stack(np.meshgrid(side, side), axis=-1).reshape(-1, 2)
    model, state = loose_discs(xy, R * rng.choice([0.8, 0.9, 1.0], len(xy)), bond=None, friction=None, damping=None)
    corners = np.array([[0.0, 0.0], [BOX, 0.0], [BOX, BOX], [0.0, BOX]])
    state.walls = make_walls(np.hstack([corners, np.roll(corners, -1, axis=0)]), np.zeros((4, 2)), model)
    rebuild(model, state)
    model = in_real_time(model, state, fraction)
    state.v[:] = rng.normal(0.0, speed, xy.shape)
    return model, state


def stones(speed, fraction):
    """25 discs and five rigid stones between walls, moving at random."""
    model, state = conservation.crowd(fraction)
    end = 15.0 * R
    corners = np.array([[-end, -end], [end, -end], [end, end], [-end, end]])
    state.walls = make_walls(np.hstack([corners, np.roll(corners, -1, axis=0)]), np.zeros((4, 2)), model)
    rng = np.random.default_rng(8)
    for body in (state.disc, state.clumps.motion):
        body[:, 2:4], body[:, 4] = rng.normal(0.0, speed, (len(body), 2)), rng.normal(0.0, speed / R, len(body))
    return in_real_time(model, state, fraction), state


def single(speed, fraction):
    """One disc that flies to and fro between two held ones."""
    held = [[0.0, 0.0], [6.0 * R, 0.0]]
    model, state = with_held(held, [R, R], [[3.0 * R, 0.0]], [R], bond=None, friction=None, damping=None)
    model = in_real_time(model, state, fraction)
    state.v[2, 0] = speed
    return model, state


def mean_energy(model, state, steps=400):
    """Mean over steps of kinetic (of both half steps) and elastic energy."""
    total = 0.0
    for _ in range(steps):
        before, stored = energy.kinetic(model, state), energy.stored(model, state)
        advance(model, state, 0.0, 1)
        total += 0.5 * (before + energy.kinetic(model, state)) + stored
    return total / steps


def study(pictures):
    """Largest error of the energy at ten looks in a million steps, by fraction."""
    cases = {
        "36 discs, 0.3 m/s": lambda f: gas(0.3, f),
        "36 discs, 3 m/s": lambda f: gas(3.0, f),
        "25 discs and 5 stones, 0.3 m/s": lambda f: stones(0.3, f),
        "25 discs and 5 stones, 3 m/s": lambda f: stones(3.0, f),
        "one disc, 1 m/s": lambda f: single(1.0, f),
        "one disc, 3 m/s": lambda f: single(3.0, f),
    }
    lines = ["| share of the stable step | " + " | ".join(cases) + " |", "|---" * (len(cases) + 1) + "|"]
    for fraction in (0.05, 0.1, 0.2, 0.4):
        found = [largest_error(*make(fraction)) for make in cases.values()]
        lines.append(f"| {fraction:g} | " + " | ".join(f"{100.0 * e:.2f} %" for e in found) + " |")
    return "Largest error of the energy in ten measurements over 1,000,000 steps:\n\n" + "\n".join(lines)


def largest_error(model, state, steps=1_000_000):
    """Largest relative error of the mean energy at ten looks."""
    start, worst = mean_energy(model, state), 0.0
    for _ in range(10):
        advance(model, state, 0.0, steps // 10)
        worst = max(worst, abs(mean_energy(model, state) / start - 1.0))
    return worst


def rows(fast):
    """A million steps (fast: 20,000)."""
    steps = 20_000 if fast else 1_000_000
    for words, make, speeds in (("", gas, (0.3, 3.0)), ("with stones, ", stones, (0.3, 3.0)), ("one disc, ", single, (1.0, 3.0))):
        for speed in speeds:
            model, state = make(speed, default_fraction())
            start = mean_energy(model, state)
            advance(model, state, 0.0, steps)
            found = mean_energy(model, state)
            yield row(f"energy after {steps:,} steps, {words}{speed:g} m/s [J]", found, start, 1e-2, "conservation")
