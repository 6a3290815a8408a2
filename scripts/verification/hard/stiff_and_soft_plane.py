"""Windows with oblique and curved sides whose discs are much stiffer or much softer than the zones.

*Stiff*: the body of `free_body.py`, free, its contacts a thousand times as stiff as its zones, in real time without damping,
with the short step that the contacts on the rim require. *Soft*: a quarter of a ring with such a window, held on its sides,
full of bonded discs a thousandth as stiff; the disc nearest to the middle of the window has a weight. When the unbalanced
ratios of both codes are below 1e-5 it has moved by K^-1 f, solved with the assembled stiffness of zones, rim and discs."""

import numpy as np

from verification.coupling.energy import followed
from verification.hard.coupled_system import MODULUS, system
from verification.hard.free_body import SIZE, body, bond_all
from verification.hard.stiff_and_soft import come_to_rest, load, static
from verification.verdict_rows import row

NAME = "stiff and soft, plane"
RADII = (1 / 10, 1 / 20)  # [m], in zones of .4 to .9 m


def moved(stiffness, radius):
    """How far from the K^-1 f of the loaded disc it comes to rest, over that; steps that took."""
    found = system(stiffness, radius, 0.8, oblique=True)
    (window,) = found.windows
    bond_all(window)
    discs, ring = window.state, window.model.ring
    found.state.added_mass[window.nodes] = window.rim.stiffness_sums(window.model, discs)
    heavy = ring + int(np.hypot(*(discs.x[ring:] - window.rim.nodes.mean(axis=0)).T).argmin())
    load(discs, heavy, 1e-6 * radius * stiffness * MODULUS)
    expected = static(found, heavy)
    steps = come_to_rest(found)
    return np.hypot(*(discs.displacement[heavy] - expected)) / np.hypot(*expected), steps


def rows(fast):
    """Stiff: 100,000 steps (fast: 10,000)."""
    steps = 10_000 if fast else 100_000
    energy, lost = followed(body(stiffness=1000.0), steps, 1e-6 * SIZE, every=10)
    yield row(f"stiff, k/K 1000: band of the energy in {steps:,} steps", np.ptp(energy) / energy.mean(), 0.0, 1e-6, "leap-frog")
    yield row("stiff, k/K 1000: momentum lost, over its parts", lost, 0.0, 1e-12, "conservation")
    for radius in RADII:
        error, taken = moved(1e-3, radius)
        name = f"soft, k/K 1e-3, R {radius:g} m: displacement of the loaded disc, at rest after {taken} steps, error"
        yield row(name, error, 0.0, 1e-4, "K^-1 f")
