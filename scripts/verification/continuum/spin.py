"""Large strain: a stressed zone is spun by a right angle, and zones are stretched and sheared.

K = 0.5 GPa, G = 0.15 GPa. A distorted zone without strain turns by 90 degrees about a point outside in 50,000 steps; its
stress turns with it: sigma(t) = R sigma(0) R'. Under the Jaumann rate of Hooke's law, with M = K + 4G/3:

    stretch to lambda without lateral strain:   sigma_xx = M ln lambda
    simple shear gamma:                         sigma_xy = G sin gamma,  sigma_xx = -sigma_yy = G (1 - cos gamma)
"""

from math import cos, log, pi, sin

import numpy as np

from fdm_server.observe import fields
from fdm_server.step.present_shape import begin_large_strain
from fdm_server.step.zone_pass import advance
from verification import as_a_run
from verification.continuum.meshes import model_of_zones, set_stress
from verification.verdict_rows import row

NAME = "spin"
K, G = 0.5e9, 0.15e9
START = np.array([[-3e5, 1e5], [1e5, -8e5]])  # [Pa]
ACROSS = -4e5


def zone():
    """Model and State of one distorted zone in large strain."""
    xy = np.array([[0.0, 0.0], [1.1, 0.1], [0.9, 1.0], [0.1, 0.8]])
    model, state = model_of_zones(xy, np.array([[0, 1, 2, 3]]), as_a_run.material(K, G))
    begin_large_strain(model, state)
    return model, state


def follow(model, state, place, steps):
    """Move gridpoints along place(t, xy), t from 0 to 1 in so many steps; yields t after every step."""
    start = place(0.0, model.grid.xy)
    for step in range(1, steps + 1):
        state.velocity[:] = place(step / steps, model.grid.xy) - start - state.displacement
        advance(model, state)
        yield step / steps


def turned(angle):
    """The starting stress turned by an angle [rad]."""
    R = np.array([[cos(angle), -sin(angle)], [sin(angle), cos(angle)]])
    return R @ START @ R.T


def spun(steps):
    """Largest error of the stress on the way to the right angle, over its largest component, and the stress at the end."""
    model, state = zone()
    set_stress(state, START[0, 0], START[1, 1], ACROSS, START[0, 1])

    def place(t, points):
        c, s = cos(0.5 * pi * t), sin(0.5 * pi * t)
        return (points - [7.0, -2.0]) @ np.array([[c, s], [-s, c]])

    worst = 0.0
    for t in follow(model, state, place, steps):
        if round(t * steps) % max(1, steps // 50) == 0:
            stress = fields.stress(model, state)[0]
            worst = max(worst, np.abs(stress[[0, 1, 3]] - turned(0.5 * pi * t)[[0, 1, 0], [0, 1, 1]]).max())
    return worst / np.abs(START).max(), fields.stress(model, state)[0]


def strained(place, steps):
    """Stress [Pa] of the zone after the motion."""
    model, state = zone()
    for _ in follow(model, state, place, steps):
        pass
    return fields.stress(model, state)[0]


def rows(fast):
    """The spin in 50,000 steps (fast: 5,000), strains in 2,000."""
    jaumann = "closed form (Jaumann rate)"
    error, end = spun(5_000 if fast else 50_000)
    yield row("stress xx after 90 degrees [Pa]", end[0], START[1, 1], 1e-4, jaumann)
    yield row("stress yy after 90 degrees [Pa]", end[1], START[0, 0], 1e-4, jaumann)
    yield row("stress xy after 90 degrees [Pa]", end[3], -START[0, 1], 1e-4, jaumann)
    yield row("largest error along the path", error, 0.0, 1e-4, jaumann)
    stretch = strained(lambda t, xy: xy * [1.0 + 2.0 * t, 1.0], 2_000)
    yield row("stretch to 3: stress xx [Pa]", stretch[0], (K + 4 * G / 3) * log(3.0), 1e-5, jaumann)
    dienes = "Dienes (1979), Acta Mechanica 32"
    shear = strained(lambda t, xy: xy + np.outer(xy[:, 1], [3.0 * t, 0.0]), 2_000)
    yield row("simple shear of 3: stress xy [Pa]", shear[3], G * sin(3.0), 1e-4, dienes)
    yield row("simple shear of 3: stress xx [Pa]", shear[0], G * (1.0 - cos(3.0)), 1e-4, dienes)
