"""Rigid stones have the mass and inertia of their polygons, fall freely and rotate steadily.

An angle of five squares of side 2 R, R = 0.03 m, of five discs, density 2700 kg/m3. About the centre of the squares

    A = 20 R^2,     I = rho 4 R^2 (5 (2 R)^2 / 6 + 25.6 R^2)

Area and inertia are those of its mass in real time. Under g it falls by g t^2 / 2 (from second differences of equal times) and
turns by its spin times t, and its outermost disc with it. A quarter turn of two stones and loose discs, bonded, changes no
contact force: second order in the step. The scene fills an L-shaped window with stones of content 0.3, whose polygons cover
that share of its area; all fall freely, at g (t - dt / 2): velocities belong to half steps."""

import numpy as np

from coupler_protocol.geometry import polygon_area
from dem_server.effects.bond import Bond
from dem_server.effects.friction import Friction
from dem_server.effects.spring import Spring
from dem_server.pairs import listed_pairs
from dem_server.step.clumps import place_members
from dem_server.step.contact_pass import contact_forces
from dem_server.step.cycle import advance, in_real_time
from dem_server.stones import bodies
from verification.discrete import scenes
from verification.discrete.discs import KN, loose_discs
from verification.verdict_rows import row

NAME = "stone"
R, G = 0.03, 9.81
ANGLE = R * np.array([[-1.0, -1.0], [5.0, -1.0], [5.0, 1.0], [1.0, 1.0], [1.0, 5.0], [-1.0, 5.0]])  # of five discs
FIVE = R * np.array([[0.0, 0.0], [2.0, 0.0], [4.0, 0.0], [0.0, 2.0], [0.0, 4.0]])
AREA, INERTIA = 20.0 * R**2, 4.0 * R**2 * (5.0 * 4.0 * R**2 / 6.0 + 25.6 * R**2)  # of the angle, inertia over density
WINDOW = [[0.0, 0.0], [0.0, 1.4], [0.7, 1.4], [0.7, 0.7], [1.4, 0.7], [1.4, 0.0]]
CONTENT = 0.3


class Stone:
    """Material of the stones, smooth where `friction` is 0."""

    density = 2700.0
    spring = Spring(normal=5.0e8, shear=5.0e8)
    friction = Friction(coefficient=1.0)
    bond = Bond(tension=1e9, shear=1e9)


def angles(places, loose=(), **changes):
    """Stones of five discs at `places` (x, y, turned by), and loose discs of soil, made into clumps."""
    outlines, xy = [], []
    for x, y, turn in places:
        c, s = np.cos(turn), np.sin(turn)
        M = np.array([[c, s], [-s, c]])
        outlines.append(ANGLE @ M + [x, y])
        xy.append(FIVE @ M + [x, y])
    xy = np.vstack([*xy, *np.reshape(loose, (-1, 2))])
    model, state = loose_discs(xy, np.full(len(xy), R), stone=Stone(), **changes)
    bodies.assign_discs(model, state, outlines, Stone.density)
    return bodies.form_stones(model, state, outlines, "clump"), state


def quarter_turn(steps):
    """Largest change of a contact force, over kn R, after a quarter turn of everything in so many steps."""
    loose = [[0.0925, 0.092], [0.15, 0.09]]
    glue = Bond(tension=1e9, shear=1e9)
    model, state = angles([(0.0, 0.0, 0.0), (0.24, 0.148, np.pi)], loose, bond=glue)
    state.bond_state[:] = 1
    contact_forces(model, state)
    pairs = listed_pairs(state)
    state.shear[pairs.slot] = np.random.default_rng(0).normal(0.0, 300.0, len(pairs.slot))
    before = np.column_stack([pairs.normal_force, state.shear[pairs.slot]])
    clumps, centre = state.clumps, np.array([0.4, -0.2])
    body, disc = clumps.motion[:, :2].copy(), state.x[10:].copy()
    for step in range(1, steps + 1):
        angle = 0.5 * np.pi * step / steps
        c, s = np.cos(angle), np.sin(angle)
        M = np.array([[c, s], [-s, c]])
        for now, was, velocity in ((clumps.motion[:, :2], body, clumps.motion[:, 2:4]), (state.x[10:], disc, state.v[10:])):
            velocity[:] = centre + (was - centre) @ M - now
            now[:] = centre + (was - centre) @ M
        clumps.motion[:, 4], clumps.motion[:, 5], state.spin[10:] = 0.5 * np.pi / steps, angle, 0.5 * np.pi / steps
        for k in range(2):
            place_members(k, clumps, state.disc, state.angle, 1.0)
        contact_forces(model, state)
    pairs = listed_pairs(state)
    if not len(pairs.slot) == len(before) >= 4:
        raise ArithmeticError("the quarter turn made or lost pairs")
    after = np.column_stack([pairs.normal_force, pairs.shear_force])
    return np.abs(np.sort(after, axis=0) - np.sort(before, axis=0)).max() / (KN * R)


def thrown(spin, steps):
    """Mass, inertia, acceleration downwards, turn over spin t, and error over R of the place of the outermost disc."""
    model, state = angles([(0.2, 0.5, 0.7)], damping=None)
    model = in_real_time(model, state, 0.1)
    motion = state.clumps.motion[0]
    motion[2:5] = 0.3, 0.2, spin
    start, lever = motion[:2].copy(), state.x[4] - motion[:2]
    time, height = 0.0, [start[1]]
    for _ in range(2):
        time += advance(model, state, G, steps)
        height.append(motion[1])
    fall = -(height[2] - 2.0 * height[1] + height[0]) / (0.5 * time) ** 2
    c, s = np.cos(spin * time), np.sin(spin * time)
    place = motion[:2] + np.array([c * lever[0] - s * lever[1], s * lever[0] + c * lever[1]])
    return motion[6], motion[7], fall, motion[5] / (spin * time), np.hypot(*(state.x[4] - place)) / R


def of_scene():
    """Area of the stones of a scene with an L-shaped window [m2], mean speed of all bodies, and that of free fall [m/s]."""
    grain = scenes.SOIL | {"density": 2700.0, "spring": {"normal": 5e8, "shear": 5e8}}
    size = {"mean": 0.3, "sigma": 0.2, "min": 0.2, "max": 0.4}
    stage = {"name": "fall", "kind": "discs", "time": "real", "gravity": G, "until": {"time": 0.02}}
    more = {"window": [{"name": "L", "polygon": WINDOW}], "stones": {"content": CONTENT, "size": size}}
    _, state, found, results = scenes.computed(scenes.tables([stage], {"stone": grain}, **more))
    area = sum(abs(polygon_area(np.asarray(outline))) for outline in found.outlines)
    mass = state.mass.copy()
    own = state.clumps.body >= 0
    momentum = (mass * state.v[:, 1])[~own].sum() + state.clumps.motion[:, 6] @ state.clumps.motion[:, 3]
    total = mass[~own].sum() + state.clumps.motion[:, 6].sum()
    return area, -momentum / total, G * (results[1]["seconds_simulated"] - 0.5 * results[1]["time_step"])


def rows(fast):
    """The angle by hand; the quarter turn in 10,000 steps; the scene."""
    closed = "closed form"
    mass, inertia, fall, turn, error = thrown(3.0, 2000)
    yield row("area [m2]", mass / Stone.density, AREA, 1e-3, closed)
    yield row("inertia [kg m2 per metre]", inertia, Stone.density * INERTIA, 1e-3, closed)
    yield row("free fall [m/s2]", fall, G, 1e-3, closed)
    yield row("turn over spin t", turn, 1.0, 1e-3, closed)
    yield row("error over R of the place of the outermost disc", error, 0.0, 1e-3, closed)
    yield row("quarter turn: change of a contact force over kn R", quarter_turn(10_000), 0.0, 1e-8, closed)
    area, speed, expected = of_scene()
    covered = CONTENT * abs(polygon_area(np.array(WINDOW)))
    yield row("as a scene: area of the stones in an L-shaped window [m2]", area, covered, 1e-3, closed)
    yield row("as a scene: mean speed of fall [m/s]", speed, expected, 1e-9, closed)
