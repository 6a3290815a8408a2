"""Earth pressure on a smooth wall that moves away from the ground or into it.

Ground of 4 m with K = 20 MPa, G = 10 MPa, rho = 2000 kg/m3, g = 9.81 m/s2, phi = 30, psi = 0, at rest first; then its right
side moves slowly in the horizontal direction until all ground yields. Rankine's forces on a wall of height H, N = (1 + sin
phi)/(1 - sin phi):

    active:   rho g H^2/2N                              c = 0
    passive:  N rho g H^2/2 + 2 c sqrt(N) H             c = 10 kPa

The force is the mean of the last fifth of the motion, under combined damping. Every zone has the state of its neighbours, so
any mesh is exact.
"""

from math import radians, sin, sqrt

from verification import as_a_run
from verification.verdict_rows import row

NAME = "earth pressure"
SOURCE = "Rankine (1857)"
K, G, DENSITY, GRAVITY, HEIGHT, FRICTION = 20e6, 10e6, 2000.0, 9.81, 4.0, 30.0
N = (1 + sin(radians(FRICTION))) / (1 - sin(radians(FRICTION)))


def scene(size, cohesion, distance, steps, damping=None):
    """Ground in zones of `size` m whose right side moves by a distance [m] in so many steps."""
    move = {"on": "right", "velocity": {"x": distance / steps}}
    return as_a_run.tables(
        {"kind": "box", "length": 4.0, "height": HEIGHT, "zone_size": size},
        as_a_run.material(K, G, DENSITY, mohr_coulomb={"friction": FRICTION, "cohesion": cohesion}),
        [
            {"name": "equilibrium", "gravity": GRAVITY, "until": {"ratio": 1e-8}},
            {"name": "move", "kind": "load", "boundary": [move], "until": {"steps": steps}},
        ],
        {"left": "x", "right": "x", "bottom": "y"},
        damping=damping or {"combined": 0.8},
    )


def force_on_wall(size, cohesion, distance, steps, damping=None):
    """Horizontal force [N] on the right side in the last fifth of its motion."""
    found = as_a_run.compute(scene(size, cohesion, distance, steps, damping), ["reaction_x:right"])
    return -found.histories["reaction_x:right"][-steps // (5 * as_a_run.LOOK) :].mean()


def rows(fast):
    """Zones of .5 m (fast: 1 m) in 10,000 steps; what local damping, which does not know a steady motion, does to it."""
    size, steps = (1.0 if fast else 0.5), 10_000
    weight = 0.5 * DENSITY * GRAVITY * HEIGHT**2
    yield row("active force, c = 0 [N/m]", force_on_wall(size, 0.0, 0.04, steps), weight / N, 1e-6, SOURCE)
    passive = N * weight + 2e4 * sqrt(N) * HEIGHT
    yield row("passive force, c = 10 kPa [N/m]", force_on_wall(size, 10e3, -0.2, steps), passive, 1e-6, SOURCE)
    found = force_on_wall(size, 10e3, -0.2, steps, {"local": 0.8})
    yield row("passive force under local damping [N/m]", found, passive, 0.02, SOURCE)
