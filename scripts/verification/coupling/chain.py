"""A coupled chain is the monolithic leap-frog, and conserves energy.

A bar of 12 columns and 12 discs on its end, contacts 30 times as stiff as the columns, with random velocities (30 m/s, so that
round-off of positions is small beside the motion; in one dimension everything is linear). It is compared with the same chain
as one system of springs and masses, M a = -K u, written without either code:

    v(n+1/2) = v(n-1/2) + a(u(n)) dt,    u(n+1) = u(n) + v(n+1/2) dt

Its energy of whole steps, v(n-1/2).M.v(n+1/2) / 2 + u(n).K.u(n) / 2, is constant; so must be that of both codes together, from
their own masses, stresses and contact forces. The step is 0.9 of the stable one."""

import numpy as np

from verification.coupling.bar import DENSITY, M, bar
from verification.verdict_rows import row

NAME = "chain"
SOURCE = "closed form (leap-frog)"
DX, COLUMNS, DISCS, STIFF, HEAVY = 0.25, 12, 12, 30.0, 3.0


def system():
    """Masses (n,) [kg] and springs (n - 1,) [N/m] of the chain, the interface's node at COLUMNS."""
    column, disc = DENSITY * DX**2, HEAVY * DENSITY * DX**2
    mass = np.concatenate([np.full(COLUMNS, column), [0.5 * (column + disc)], np.full(DISCS, disc)])
    mass[0] = 0.5 * column
    return mass, np.concatenate([np.full(COLUMNS, M), np.full(DISCS, STIFF * M)])


def coupled(seed=3, share=0.9):
    """The chain of both codes, shaken, and its velocities (n,) by place."""
    joined, _ = bar(COLUMNS, DX, DISCS, STIFF * M, HEAVY * DENSITY * DX**2)
    joined.begin(share, from_rest=False)
    velocity = 30.0 * np.random.default_rng(seed).normal(size=COLUMNS + 1 + DISCS)
    place = np.rint(joined.grid_model.grid.xy[:, 0] / DX).astype(int)
    joined.grid.velocity[:, 0] = velocity[place]
    joined.discs.v[1:, 0] = velocity[COLUMNS + 1 :]
    return joined, velocity, place


def alone(velocity, dt, steps):
    """Displacements (steps, n) [m] of the monolithic chain."""
    mass, spring = system()
    v, u, found = velocity.copy(), np.zeros(len(mass)), []
    for _ in range(steps):
        pull = spring * np.diff(u)
        v += dt / mass * (np.append(pull, 0.0) - np.append(0.0, pull))
        u += dt * v
        found.append(u.copy())
    return np.array(found)


def run(steps):
    """Largest difference to the monolithic chain over its amplitude, energies (steps,) [J], momentum lost over its parts."""
    joined, velocity, place = coupled()
    expected, energy, worst = alone(velocity, joined.grid.dt, steps), [], 0.0
    low = np.flatnonzero(joined.grid_model.grid.xy[:, 1] == 0.0)
    low = low[np.argsort(place[low])]
    before, _ = joined.momentum()
    lost = 0.0
    for n in range(steps):
        energy.append(joined.step_with_energy())
        discs = joined.discs.x[1:, 0] - joined.discs.origin[1:, 0]
        found = np.concatenate([joined.grid.displacement[low, 0], discs])
        worst = max(worst, np.abs(found - expected[n]).max())
        now, scale = joined.momentum()
        lost = max(lost, np.abs(now - before).max() / scale)
    return worst / np.abs(expected).max(), np.array(energy), lost


def rows(fast):
    """Differences after 2,000 (fast: 300) steps."""
    difference, energy, lost = run(300 if fast else 2000)
    yield row("difference to one system of springs and masses, over its amplitude", difference, 0.0, 1e-11, SOURCE)
    yield row("energy, largest change over it", np.ptp(energy) / energy[0], 0.0, 1e-12, SOURCE)
    yield row("momentum, largest change over the sum of its parts' sizes", lost, 0.0, 1e-13, SOURCE)
