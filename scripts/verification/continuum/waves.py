"""P and S waves in a bar of the paper's material, compared with their speeds and the dispersion law of leap-frog.

K = 0.5 GPa, G = 0.15 GPa, rho = 2700 kg/m3: c_P = sqrt((K + 4G/3)/rho) = 509.2 m/s, c_S = sqrt(G/rho) = 235.7 m/s. A row of
square zones of h = 0.5 m, L = 20 m long, is held at x = 0, moves along its axis only (P) or across it only (S), and starts
with a uniform stress, xx or xy, that its free end cannot carry. In a stage in real time without damping it oscillates in its
modes sin k_n x, k_n = (n - 1/2) pi/L, each with

    q_n(t) = q_n (1 - cos w_n t),    sin(w_n dt/2) = (c dt/h) sin(k_n h/2)

(time counts from half a step before the first force). The displacement at the end of the stage gives the phase of every mode,
and w_n/k_n its speed; long waves travel at c."""

from math import asin, cos, pi, sin, sqrt

import numpy as np

from verification import as_a_run
from verification.verdict_rows import row

NAME = "waves"
SOURCE = "closed form (leap-frog dispersion)"
K, G, DENSITY = 0.5e9, 0.15e9, 2700.0
LENGTH, ZONES, STRESS = 20.0, 40, 1e5
SPEED = {"xx": sqrt((K + 4 * G / 3) / DENSITY), "xy": sqrt(G / DENSITY)}
MODULUS = {"xx": K + 4 * G / 3, "xy": G}


def scene(component, seconds):
    """The bar under an initial stress xx (P) or xy (S)."""
    along = component == "xx"
    held = {"left": "xy", "bottom": "y" if along else "x", "top": "y" if along else "x"}
    return as_a_run.tables(
        {"kind": "box", "length": LENGTH, "height": LENGTH / ZONES, "zone_size": LENGTH / ZONES},
        as_a_run.material(K, G, DENSITY),
        [{"name": "swing", "kind": "load", "time": "real", "until": {"time": seconds}}],
        held,
        damping={"local": 0.0},
        initial_stress={component: STRESS},
    )


def speeds(component, mode, periods):
    """Speed [m/s] of a mode by its phase after about so many periods and a quarter, and by the dispersion law."""
    c, h, k = SPEED[component], LENGTH / ZONES, (mode - 0.5) * pi / LENGTH
    found = as_a_run.compute(scene(component, (periods + 0.25) * 2.0 * pi / (k * c)))
    dt = found.state.dt
    law = 2.0 / dt * asin(c * dt / h * sin(0.5 * k * h))
    axis = 0 if component == "xx" else 1
    x, y = found.model.grid.xy.T
    line = np.flatnonzero(y == 0.0)
    shape = np.sin(k * x[line])
    weight = np.where((x[line] == 0.0) | (x[line] == LENGTH), 0.5, 1.0)
    rest = -STRESS / MODULUS[component] * x[line]  # where the stress is gone
    share = 1.0 - (weight * shape * found.state.displacement[line, axis]).sum() / (weight * shape * rest).sum()
    time = (found.stages[0]["steps"] + 0.5) * dt
    cosine = share * cos(0.5 * law * dt)
    phase = law * time + (cos(law * time) - cosine) / sin(law * time)
    return phase / time / k, law / k


def rows(fast):
    """Ten periods of the first mode, and the ninth mode, whose waves are nine zones long (fast: three periods)."""
    periods = 3 if fast else 10
    for name, component in (("P", "xx"), ("S", "xy")):
        value, _ = speeds(component, 1, periods)
        yield row(f"speed of long {name} waves [m/s]", value, SPEED[component], 1e-3, SOURCE)
        value, law = speeds(component, 9, periods)
        yield row(f"speed of {name} waves of 9 zones [m/s]", value, law, 1e-9, SOURCE)
