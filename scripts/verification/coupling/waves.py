"""A wave travels from a bar of zones into a chain of discs.

A displacement wave u(x - c t) that meets a change of impedance from Z1 to Z2 is reflected with the factor

    (Z1 - Z2) / (Z1 + Z2):    -1/3 for Z2 = 2 Z1,  -0.6 for Z2 = 4 Z1,  +0.6 for Z2 = Z1 / 4,  0 for equal ones.

The chain has the bar's wave speed, its masses and stiffnesses are those of the bar times Z2/Z1 (spacing dx). The pulse, a
Gaussian of standard deviation 12 dx, travels from the bar to the chain; amplitudes are the largest displacements of
the bar and of the chain. Equal impedances without the half disc's mass at the bar's end: reflection of a pulse 3 dx long.
"""

import numpy as np

from fdm_server.step.zone_pass import advance
from verification.coupling.bar import DENSITY, SPEED, M, bar
from verification.verdict_rows import row

NAME = "waves"
DX, COLUMNS, SHORT = 0.25, 400, 6.0


def reflected(ratio, width=12.0, half_mass=True, share=0.5):
    """Amplitudes of what came back and of what went on, over that of the pulse, for Z2/Z1 = ratio; and the steps that took."""
    joined, _ = bar(COLUMNS, DX, COLUMNS, ratio * M, ratio * DENSITY * DX**2, half_mass=half_mass)
    joined.begin(share, from_rest=False)
    grid, dt = joined.grid, joined.grid.dt
    x, centre, sigma = joined.grid_model.grid.xy[:, 0], 0.7 * COLUMNS * DX, width * DX

    def pulse(t):
        return 1e-6 * DX * np.exp(-0.5 * ((x - centre - SPEED * t) / sigma) ** 2)

    grid.velocity[:, 0] = pulse(0.0) / dt
    advance(joined.grid_model, grid)  # displacements and stresses of the pulse
    grid.velocity[:, 0] = (pulse(0.0) - pulse(-dt)) / dt
    steps = round(0.55 * COLUMNS * DX / SPEED / dt)
    for _ in range(steps):
        joined.step()
    back, on = grid.displacement[:, 0], joined.discs.x[1:, 0] - joined.discs.origin[1:, 0]
    return *(values[np.abs(values).argmax()] / (1e-6 * DX) for values in (back, on)), steps


def rows(fast):
    """Three impedance ratios, equal impedances with and without the half disc's mass."""
    source = "closed form; Achenbach (1973), Wave Propagation in Elastic Solids, section 3.3"
    for ratio, words in ((2.0, "twice"), (4.0, "4 times"), (0.25, "a quarter of")):
        back, on, _ = reflected(ratio)
        yield row(f"discs {words} the impedance: what comes back", back, (1.0 - ratio) / (1.0 + ratio), 0.01, source)
        yield row(f"discs {words} the impedance: transmitted wave", on, 2.0 / (1.0 + ratio), 0.01, source)
    back, _, _ = reflected(1.0, SHORT)
    yield row("equal impedance, short pulse: what comes back", back, 0.0, 1e-3, source)
    back, _, _ = reflected(1.0, SHORT, half_mass=False)
    yield row("the same without the half disc's mass, size", abs(back), np.exp(-0.5) / (4.0 * SHORT), 0.1, source)
