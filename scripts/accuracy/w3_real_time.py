"""W3: a disc on a bar, a wave into discs and the energy of a chain, against the step in real time and the half disc's mass.

The bars and chains of scripts/verification/coupling. Steps are shares of the step that grid, rim and discs agree on. Errors:
of the restitution against its closed form, over it; of a wave, what comes back at equal impedances, over the pulse; of the
energy, its largest change over it with the kinetic energy that a recorder sees, mean of those half a step before and after.
"""

from itertools import product

import numpy as np
from verification.coupling import chain, restitution, waves
from verification.orders import order

from accuracy.common import curves, timed
from colluvium.figures.style import styled

TITLE = "a disc on a bar, a wave, a chain: step and half disc's mass"
PICTURE = "accuracy_w3.png"
READ = """Steps are shares of the agreed one; small ones are on the right. The error of the energy falls with the square of the
step, as in leap-frog (the leap-frog energy itself is conserved to round-off at any of these steps: docs/verification.md).
Restitution and wave do not depend on the step: their curves are level, at the floor of the bar's columns (half the width gives
a quarter of the error) and of the half disc's mass. The reflection of a wave that should pass is fifty times stronger if the
rim's gridpoints do not carry that mass. The closed form of the disc on a bar has no mass at the end of the bar: there, the
real mass of the half disc is the difference."""
COLUMNS = {
    "case": "case",
    "method": "method",
    "share": "share of the step",
    "steps": "steps",
    "error": ("error [%]", lambda v: f"{100 * v:.5f}"),
    "seconds": ("seconds", lambda v: f"{v:.3f}"),
    "spread": ("spread", lambda v: f"{v:.2f}"),
    "repeats": "repeats",
    "order": ("order", lambda v: "-" if v is None else f"{round(v, 2) + 0.0:.2f}"),
    "reference": "reference",
}
SHARES = (0.95, 0.8, 0.5, 0.3, 0.2, 0.1)
MASS = {True: "with the half disc's mass", False: "without"}
B = 0.2
REFERENCES = {"disc on a bar": "closed form", "wave": "closed form (nothing comes back)", "energy of a chain": "conservation"}


def impact(fine, half_mass):
    """Function of the share: error and steps of an impact with `fine` columns to c/omega."""

    def compute(share):
        found, steps = restitution.rebound(B, fine, share, half_mass)
        return abs(found / restitution.restitution(B) - 1.0), steps

    return compute


def wave(half_mass):
    """Function of the share: error and steps of a short pulse at equal impedances."""

    def compute(share):
        back, _, steps = waves.reflected(1.0, waves.SHORT, half_mass, share)
        return abs(back), steps

    return compute


def energy(share):
    """Error and steps of a shaken chain over the time of 300 whole steps."""
    joined, _, _ = chain.coupled(share=share)
    steps, values = round(300 / share), []
    for _ in range(steps):
        stored, before = joined.stored(), joined.kinetic()
        joined.step()
        values.append(stored + 0.5 * (before + joined.kinetic()))
    return float(np.ptp(values) / values[0]), steps


def run(fast):
    """Rows of all curves; fast: three shares, one mesh of the bar, one repeat."""
    shares, meshes, repeats = (SHARES[::2], (20,), 1) if fast else (SHARES, (20, 40), 3)
    cases = [("disc on a bar", f"{n} columns, {MASS[m]}", impact(n, m)) for n, m in product(meshes, MASS)]
    cases += [("wave", MASS[m], wave(m)) for m in MASS]
    cases.append(("energy of a chain", "leap-frog", energy))
    rows = []
    for case, method, compute in cases:
        compute(SHARES[0])  # compiles
        own = []
        for share in shares:
            seconds, spread, (error, steps) = timed(lambda compute=compute, share=share: compute(share), repeats)
            row = {"case": case, "method": method, "share": share, "steps": steps, "error": error, "seconds": seconds}
            own.append(row | {"spread": spread, "repeats": repeats, "reference": REFERENCES[case]})
        observed = order(shares, [row["error"] for row in own])
        rows += [row | {"order": observed} for row in own]
    return rows


@styled
def draw(rows, path):
    """Error against wall time, one panel a case."""
    import matplotlib.pyplot as plt

    figure, panels = plt.subplots(1, len(REFERENCES), figsize=(9.6, 3.6), layout="constrained")
    for axes, case in zip(panels, REFERENCES, strict=True):
        curves(axes, [row for row in rows if row["case"] == case])
        axes.set_title(case)
        axes.legend(fontsize=7.0)
    figure.savefig(path)
    plt.close(figure)
