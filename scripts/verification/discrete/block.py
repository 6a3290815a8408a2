"""A rigid block on a slope slides or stays.

A bar of 8 R by 2 R of four discs in a row (R = 0.03 m), one clump, lies on a wall under its weight.

    slides where tan(theta) > mu:  a = g (sin(theta) - mu cos(theta)),     otherwise it stays

The acceleration comes from the paths in two equal times, (path(2t) - 2 path(t)) / t^2. "Stays" means that within 0.4 s, with
local damping, it moves only by the deformation of its springs: the weight along the slope over 4 ks, and a small rotation (the
outer feet carry its moment), which also moves its centroid.
"""

from types import SimpleNamespace

import numpy as np

from dem_server.effects.damping import Damping
from dem_server.effects.friction import Friction
from dem_server.effects.spring import Spring
from dem_server.step.contact_pass import contact_forces
from dem_server.step.cycle import advance, in_real_time
from dem_server.step.walls import make_walls
from dem_server.stones import bodies
from verification.discrete.discs import KN, KS, loose_discs
from verification.verdict_rows import row

NAME = "block"
R, G, DENSITY = 0.03, 9.81, 2000.0
WEIGHT = DENSITY * 16.0 * R**2 * G


def on_slope(slope, friction, damping=None):
    """Model and State of the block, and the direction down the slope."""
    along, up = np.array([np.cos(slope), -np.sin(slope)]), np.array([np.sin(slope), np.cos(slope)])
    frame = np.array([along, up])
    press = 0.25 * WEIGHT * np.cos(slope) / KN
    middle = (R - press) * up
    xy = middle + R * np.array([[-3.0, 0.0], [-1.0, 0.0], [1.0, 0.0], [3.0, 0.0]]) @ frame
    outline = middle + R * np.array([[-4.0, -1.0], [4.0, -1.0], [4.0, 1.0], [-4.0, 1.0]]) @ frame
    grain = SimpleNamespace(
        density=DENSITY, spring=Spring(normal=5e7, shear=2e7), friction=Friction(coefficient=friction), bond=None
    )
    changes = {"bond": None, "friction": Friction(coefficient=friction), "damping": damping, "stone": grain}
    model, state = loose_discs(xy, np.full(4, R), **changes)
    bodies.assign_discs(model, state, [outline], DENSITY)
    model = bodies.form_stones(model, state, [outline], "clump")
    state.walls = make_walls([[*(-along), *(9.0 * along)]], np.zeros((1, 2)), model)
    contact_forces(model, state)
    return in_real_time(model, state, 0.1), state, along


def acceleration(slope, friction):
    """Acceleration down the slope [m/s2]."""
    model, state, along = on_slope(slope, friction)
    start, way = state.clumps.motion[0, :2].copy(), []
    for _ in range(2):
        time = advance(model, state, G, round(0.2 / state.next_dt))
        way.append((state.clumps.motion[0, :2] - start) @ along)
    return (way[1] - 2.0 * way[0]) / time**2


def way_of_rest(slope, friction):
    """Way down the slope after .4 s [m]."""
    model, state, along = on_slope(slope, friction, Damping(local=0.7))
    start = state.clumps.motion[0, :2].copy()
    advance(model, state, G, round(0.4 / state.next_dt))
    return (state.clumps.motion[0, :2] - start) @ along


def rows(fast):
    """Slopes and coefficients on both sides of tan(theta) = mu."""
    for degrees, friction in ((30.0, 0.3), (20.0, 0.1), (40.0, 0.7), (10.0, 0.0)):
        slope = np.radians(degrees)
        expected = G * (np.sin(slope) - friction * np.cos(slope))
        words = f"acceleration, {degrees:g} degrees, mu {friction:g} [m/s2]"
        yield row(words, acceleration(slope, friction), expected, 1e-3, "closed form")
    for degrees, friction in ((30.0, 0.7), (20.0, 0.44)):
        spring = WEIGHT * np.sin(np.radians(degrees)) / (4.0 * KS)
        found = way_of_rest(np.radians(degrees), friction)
        words = f"stays, {degrees:g} degrees, mu {friction:g}: way over that of its springs"
        yield row(words, found / spring, 1.0, [-1.0, 4.0], "closed form")
