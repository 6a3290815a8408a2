"""All bonds of a coupled window broken at once, gravity off.

The body of `free_body.py`, free, under a uniform strain with tension one way and pressure the other, at rest; then every bond
breaks, including those with the rim, and both codes continue in real time without damping. Contacts in tension and in shear
lose their energy, and nothing may add any:

    kinetic + stored, of zones and discs, <= stored when the bonds broke, + 1 %

The case also requires motion: at least 0.05 of the stored energy becomes kinetic, and the largest speed is at least 0.01 of
that of the lightest disc with all of it.

The energy of the loose discs' contacts, which open and close within steps, has an error of second order in the step: after the
break it grows by 2.5 % of the stored energy in 20,000 steps of half the stable one, by 0.24 % in 40,000 of a quarter, in which
its gain is measured."""

import numpy as np

from dem_server.effects.bond import BONDED, BROKEN_TENSION
from dem_server.step.contact_pass import contact_forces
from verification.hard.free_body import body
from verification.verdict_rows import row

NAME = "bonds gone, coupled"
STRAIN = np.array([[1e-4, 0.5e-4], [0.5e-4, -1e-4]])


def burst(steps, share):
    """Energy stored before the bonds broke [J]; kinetic, whole energy [J] and largest speed [m/s] (steps,) after it."""
    joined = body()
    joined.strain(STRAIN)
    stored = joined.stored()
    joined.begin(share)
    state = joined.discs.bond_state
    state[state == BONDED] = BROKEN_TENSION
    contact_forces(joined.disc_model, joined.discs)
    seen = np.empty((steps, 3))
    for n in range(steps):
        whole = joined.step_with_energy()
        speed = max(np.abs(joined.grid.velocity).max(), np.abs(joined.discs.v).max())
        seen[n] = joined.kinetic(), whole, speed
    lightest = joined.discs.mass[joined.disc_model.ring :].min()
    return stored, seen, (2.0 * 1.01 * stored / lightest) ** 0.5, joined.momentum()


def rows(fast):
    """20,000 steps of the burst, and twice as many of half the length (fast: a fifth)."""
    steps = 4000 if fast else 20_000
    stored, seen, bound, (momentum, parts) = burst(steps, 0.5)
    kinetic, whole, speed = seen.max(axis=0)
    yield row("largest kinetic energy over what was stored", kinetic / stored, 1.0, [-0.95, 0.01], "conservation")
    yield row("largest kinetic and stored energy over what was stored", whole / stored, 1.0, [-0.95, 0.01], "conservation")
    yield row("largest speed over that of the lightest disc with all the energy", speed / bound, 1.0, [-0.99, 0], "conservation")
    yield row("momentum at the end, over its parts", np.abs(momentum).max() / parts, 0.0, 1e-12, "conservation")
    yield row("all numbers finite", np.isfinite(seen).all(), 1.0, 0.0, "as asked for")
    finer = gain(burst(2 * steps, 0.25)[1][:, 1]) / stored
    yield row("in steps half as long: largest gain after the break, over what was stored", finer, 0.0, 0.01, "conservation")


def gain(energy):
    """By how much it exceeds, at most, the least it was before."""
    return (energy - np.minimum.accumulate(energy)).max()
