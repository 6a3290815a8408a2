"""A coupled body in the plane conserves energy and momentum.

The block of zones with a bonded lattice inside (block.py), free, at 29 degrees, with random velocities: undamped in real time,
displacements of 1e-6 R. The leap-frog energy v(n-1/2).M.v(n+1/2) / 2 + stored(n) is exact for what is linear (case chain); in
the plane directions turn with the motion, and shear forces that accumulate by increments have no potential: the energy changes
in proportion to the amplitude (5e-7 of it in 10,000 steps at 1e-5 R, 5e-6 at 1e-4 R), here by as much as round-off. Also with
control discs off their segments (2 R outside).
"""

import numpy as np

from verification.coupling.block import R, block
from verification.verdict_rows import row

NAME = "energy"
SOURCE = "conservation (leap-frog)"
AMPLITUDE = 1e-6


def shaken(steps, share=0.5, seed=5, **how):
    """`followed` for the block of zones; how: of block.block."""
    return followed(block(around=1, across=2, **how), steps, AMPLITUDE * R, share, seed)


def followed(joined, steps, size, share=0.5, seed=5, every=1, look=None):
    """Energies (steps/every,) [J], and momentum lost over the sum of its parts' sizes, of a body shaken at random by `size` [m].

    look(joined): called as often.
    """
    joined.begin(share, from_rest=False)
    rng, speed = np.random.default_rng(seed), size / joined.grid.dt / 10.0
    moving = ~joined.grid_model.fixed
    joined.grid.velocity[:] = speed * rng.normal(size=moving.shape) * moving
    free = joined.discs.v[joined.disc_model.ring :]
    free[:] = speed * rng.normal(size=free.shape)
    before, lost, energy = joined.momentum()[0], 0.0, []
    for n in range(steps):
        if n % every:
            joined.step()
            continue
        energy.append(joined.step_with_energy())
        now, parts = joined.momentum()
        lost = max(lost, np.abs(now - before).max() / parts)
        if look is not None:
            look(joined)
    return np.array(energy), lost


def rows(fast):
    """20,000 steps (fast: 1,000)."""
    for shift, words in ((0.0, "on"), (2.0 * R, "off")):
        energy, lost = shaken(1000 if fast else 20_000, shift=shift)
        mean = energy.mean()
        slope = np.polyfit(np.linspace(0.0, 1.0, len(energy)), energy, 1)[0]
        yield row(f"discs {words} their segments: energy, band over it", np.ptp(energy) / mean, 0.0, 1e-6, SOURCE)
        yield row(f"discs {words} their segments: energy, trend over it", slope / mean, 0.0, 1e-7, SOURCE)
        yield row(f"discs {words} their segments: momentum lost, over its parts", lost, 0.0, 1e-13, SOURCE)
