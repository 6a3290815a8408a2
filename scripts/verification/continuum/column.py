"""A column of 12 m under its own weight between smooth walls.

K = 0.5 GPa, G = 0.15 GPa, rho = 2700 kg/m3, g = 9.81 m/s2, bottom held vertically, unbalanced ratio 1e-9. With M = K + 4G/3,
K0 = nu/(1 - nu), y from the base:

    sigma_yy = -rho g (H - y)    sigma_xx = sigma_zz = K0 sigma_yy    settlement of the top rho g H^2/2M

The same with the upper half ten times softer and a third lighter: the settlements of both halves add up. The base reaction is
from run.json; the lateral stress at the base is extrapolated from the zones by a straight line.
"""

import numpy as np

from fdm_server.observe import fields
from verification import as_a_run
from verification.verdict_rows import row

NAME = "K0 column"
SOURCE = "closed form (uniaxial strain)"
K, G, DENSITY, GRAVITY, HEIGHT, WIDTH = 0.5e9, 0.15e9, 2700.0, 9.81, 12.0, 2.0


def scene(size, *upper):
    """The column in zones of `size` m; upper: materials that lie upon the first one."""
    return as_a_run.tables(
        {"kind": "box", "length": WIDTH, "height": HEIGHT, "zone_size": size},
        [as_a_run.material(K, G, DENSITY), *upper],
        [{"name": "weight", "kind": "load", "gravity": GRAVITY, "until": {"ratio": 1e-9, "steps": 200_000}}],
        {"left": "x", "right": "x", "bottom": "y"},
    )


def rows(fast):
    """Zones of .25 m (fast: .5 m)."""
    found = as_a_run.compute(scene(0.5 if fast else 0.25))
    model, state = found.model, found.state
    modulus, k0 = K + 4 * G / 3, (K - 2 * G / 3) / (K + 4 * G / 3)
    top = model.grid.xy[:, 1] == HEIGHT
    weight = DENSITY * GRAVITY * HEIGHT
    reaction = found.stages[0]["reactions"]["bottom"]["y"]
    yield row("base reaction / width [N/m]", reaction / WIDTH, weight, 1e-6, SOURCE)
    stress = fields.stress(model, state)
    depth = HEIGHT - model.grid.xy[model.zones, 1].mean(axis=1)
    lateral = -np.polyval(np.polyfit(depth, stress[:, 0], 1), HEIGHT)
    yield row("lateral stress at the base [Pa]", lateral, k0 * weight, 1e-5, SOURCE)
    yield row("settlement [m]", -state.displacement[top, 1].mean(), weight * HEIGHT / (2 * modulus), 1e-5, SOURCE)
    error = np.abs(stress[:, 1] + DENSITY * GRAVITY * depth).max() / weight
    yield row("vertical stress, largest error over rho g H", error, 0.0, 1e-5, SOURCE)

    region = [[0.0, HEIGHT / 2], [WIDTH, HEIGHT / 2], [WIDTH, HEIGHT], [0.0, HEIGHT]]
    soft = as_a_run.material(K / 10, G / 10, DENSITY * 2 / 3) | {"name": "soft", "region": region}
    found = as_a_run.compute(scene(0.5 if fast else 0.25, soft))
    half, light = HEIGHT / 2, 2 / 3
    below = DENSITY * GRAVITY * half**2 * (light + 0.5) / modulus
    settled = below + light * DENSITY * GRAVITY * half**2 * 0.5 / (modulus / 10)
    yield row("two layers: settlement [m]", -found.state.displacement[top, 1].mean(), settled, 1e-5, SOURCE)
