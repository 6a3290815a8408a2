"""Impacts at the speed limit of the springs, and beyond.

A spring kn stops a disc of mass m at a wall before it passes through if its speed is below 0.9 R sqrt(kn / m) = 57 m/s (R =
0.03 m). *Below*: a disc in an oblique box of walls, at 0.94 of that speed from the first step, stays inside and keeps its
energy. Two discs meet at 0.9 of the speed that their spring can stop. *Beyond*: at 2.2 times the speed, the run ends and names
the disc, the wall and the speed that could be stopped; at 1e7 m/s it states that no step is short enough."""

import numpy as np
import shapely

from coupler_protocol.exits import PhysicsFailed
from verification.discrete import scenes
from verification.discrete.discs import KN
from verification.verdict_rows import row

NAME = "impacts"
R = 0.03
MASS = 2000.0 * np.pi * R**2
STOPS = R * (KN / MASS) ** 0.5
SMOOTH = {key: table for key, table in scenes.SOIL.items() if key != "friction"}
CORNERS = np.array([[0.0, 0.0], [0.5, 0.1], [0.6, 0.5], [0.1, 0.6]])
WALLS = [{"ends": [CORNERS[i].tolist(), CORNERS[(i + 1) % 4].tolist()]} for i in range(4)]


def shot(rows_, seconds, walls=WALLS):
    """The last frame's positions and velocities, the seconds a step took at the end, and the energy then [J]."""
    stage = {"name": "shot", "kind": "discs", "time": "real", "until": {"time": seconds}}
    with scenes.of_file(rows_, "x,y,radius,vx,vy", [stage], {"soil": SMOOTH, "wall": walls}, every=10**9) as run:
        energy = sum(run.history(name, 1)[1][-1] for name in ("kinetic_energy", "elastic_energy"))
        return run.discs(-1).xy, run.discs(-1).velocity, run.info["stages"][1]["time_step"], energy


def message_of(speed):
    """What a disc shot at a wall with this speed ends with; empty where it does not."""
    try:
        shot([[0.3, 0.3, R, 0.0, -speed]], 0.1)
    except PhysicsFailed as error:
        return str(error)
    return ""


def rows(fast):
    """In seconds."""
    speed = 0.85 * STOPS
    x, _, step, energy = shot([[0.3, 0.3, R, 0.6 * speed, 0.8 * speed]], 0.05 if fast else 1.0)
    inside = shapely.contains_xy(shapely.Polygon(CORNERS), *x[0])
    yield row("disc inside the box of walls after many impacts", inside, 1.0, 0.0, "none passes")
    yield row("energy, kinetic and stored, over that at the start", energy / (0.5 * MASS * speed**2), 1.0, 2e-2, "conservation")
    yield row("way in a step over a tenth of the radius", speed * step / (0.1 * R), 1.0, [-1.0, 1e-12], "as asked for")
    meet = 0.9 * 2.0**0.5 * STOPS
    _, v, *_ = shot([[0.0, 0.0, R, meet, 0.0], [2.5 * R, 0.0, R, 0.0, 0.0]], 2e-3, [])
    words = "two discs: speed of the one that was at rest over that of the other before"
    yield row(words, v[1, 0] / meet, 1.0, 1e-3, "closed form")
    said = "disc 0 is going through a wall" in message_of(2.0 * STOPS)
    yield row("beyond: ends with disc, wall and speed", said, 1.0, 0.0, "as asked for")
    said = "too fast for any sensible time step" in message_of(1e7)
    yield row("1e7 m/s: ends with the speed", said, 1.0, 0.0, "as asked for")
