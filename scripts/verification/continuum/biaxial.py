"""Biaxial compression of Mohr-Coulomb soil between smooth plates: strength and dilation.

K = 50 MPa, G = 20 MPa, c = 20 kPa, phi = 30, psi = 10; a square zone under a pressure p on its sides and its top, then the top
moves down, under combined damping (local damping removes more from oscillations against a steady motion than from those along
it, which leaves 0.5 % here). With N = (1 + sin phi)/(1 - sin phi) and Np the same with psi, the stress across the plane in
between:

    strength N p + 2 c sqrt(N),    and from there d eps_x = -Np d eps_y
"""

from math import radians, sin, sqrt

from verification import as_a_run
from verification.verdict_rows import row

NAME = "biaxial"
SOURCE = "closed form (Mohr-Coulomb)"
K, G, COHESION, PHI, PSI = 50e6, 20e6, 20e3, 30.0, 10.0
N, NP = ((1 + sin(radians(a))) / (1 - sin(radians(a))) for a in (PHI, PSI))


def pressed(pressure, strain):
    """Vertical pressure [Pa] and horizontal strain when the top has come down by `strain` m."""
    law = {"friction": PHI, "cohesion": COHESION, "dilation": PSI}
    move = {"on": "top", "velocity": {"y": -strain / 20_000}}
    found = as_a_run.compute(
        as_a_run.tables(
            {"kind": "box", "length": 1.0, "height": 1.0, "zone_size": 1.0},
            as_a_run.material(K, G, mohr_coulomb=law),
            [{"name": "press", "kind": "load", "boundary": [move], "until": {"steps": 20_000}}],
            [{"on": "left", "fix": "x"}, {"on": "bottom", "fix": "y"}, {"on": "right", "pressure": pressure}],
            damping={"combined": 0.8},
            initial_stress={"xx": -pressure, "yy": -pressure, "zz": -pressure},
        ),
        ["reaction_y:top"],
    )
    right = found.model.grid.xy[:, 0] == 1.0
    return -found.histories["reaction_y:top"][-1], found.state.displacement[right, 0].mean()


def rows(fast):
    """Strengths at two pressures, dilation between 2 and 4 %."""
    for pressure in (100e3, 400e3):
        strength = N * pressure + 2.0 * COHESION * sqrt(N)
        first, second = pressed(pressure, 0.04), pressed(pressure, 0.08)
        yield row(f"strength at {pressure / 1e3:g} kPa [Pa]", second[0], strength, 1e-10, SOURCE)
        yield row(f"dilation at {pressure / 1e3:g} kPa, -d eps_x/d eps_y", (second[1] - first[1]) / 0.04, NP, 1e-10, SOURCE)
