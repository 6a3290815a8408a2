"""Discs that leave the rim of a coupled window and return to it.

A quarter of a ring of zones, held on its sides, with a window whose sides are oblique and curved; eight discs fly in it
without friction at 5 m/s, in real time without damping, in steps of a tenth of the stable one. One of them is initially bonded
to the rim and breaks the bond. The bond stays broken, nothing pulls, forces on the nodes are zero while no disc touches the
rim, and the energy (of zones, discs and contacts) keeps its value after the break over all separations and contacts."""

import numpy as np

from dem_server.effects.bond import BONDED
from verification.coupling.joined import Joined
from verification.hard.coupled_system import with_few_discs
from verification.hard.free_body import SIZE, SMALL, discs_that_break
from verification.verdict_rows import row

NAME = "rim contacts"
SPEED, STRENGTH = 5.0, 1e3  # [m/s]; of the bond [N]; the energy it takes with it is 1e-5 of a disc's


def places(ring):
    """One disc at the rim, seven about the middle; their radii."""
    at, middle = ring.xy[5], ring.xy.mean(axis=0)
    inward = (middle - at) / np.hypot(*(middle - at))
    turn = 2.0 * np.pi * np.arange(7) / 7.0
    about = middle + 3.0 * SIZE * np.column_stack([np.cos(turn), np.sin(turn)])
    first = at + (ring.radius[5] + SIZE - 1e-9) * inward
    return np.vstack([first, about]), np.full(8, SIZE)


def flown(steps):
    """Joined, energies [J] since the bond broke, contacts begun at the rim, largest tension and force on untouched nodes [N]."""
    found = with_few_discs(places, 1.0, SIZE, 0.0, oblique=True, discs=discs_that_break(STRENGTH, 0.0), **SMALL)
    (window,) = found.windows
    joined = Joined((found.model, found.state), (window.model, window.state), window.nodes, window.rim.ring)
    joined.begin(0.1, from_rest=False)
    discs, R = joined.discs, joined.disc_model.ring
    away = discs.x[R:] - joined.rim.nodes.mean(axis=0)
    discs.v[R:] = SPEED * away / np.hypot(*away.T)[:, None]
    discs.v[R] *= -1.0
    energy, begun, touched, pull, stray = [], 0, 0, 0.0, 0.0
    for _ in range(steps):
        whole = joined.step_with_energy()
        touching = int(np.sum((discs.first < R) & (discs.normal != 0.0)))
        begun, touched = begun + max(0, touching - touched), touching
        if discs.broken_tension + discs.broken_shear:
            energy.append(whole)
            pull = max(pull, float(-discs.normal.min(initial=0.0)))
            stray = stray if touching else max(stray, float(np.abs(joined.rim.nodal_forces(discs)).max()))
    return joined, np.array(energy[1:]), begun, pull, stray


def rows(fast):
    """100,000 steps (fast: 15,000)."""
    joined, energy, begun, pull, stray = flown(15_000 if fast else 100_000)
    discs = joined.discs
    yield row("bonds broken", discs.broken_tension + discs.broken_shear, 1.0, 0.0, "closed form")
    yield row("bonds at the end", np.sum(discs.bond_state == BONDED), 0.0, 0.0, "it does not heal")
    yield row("largest tension after the break [N]", pull, 0.0, 0.0, "closed form")
    yield row("largest force on a node while nothing touches the rim [N]", stray, 0.0, 0.0, "closed form")
    yield row("contacts begun at the rim, at least", begun, 15.0, [0.0, 100.0], "as asked for")
    band = np.abs(energy / energy[0] - 1.0).max()
    yield row("energy over these contacts, largest change over it", band, 0.0, 0.01, "conservation")
    yield row("all numbers finite", np.isfinite(discs.disc).all() and np.isfinite(energy).all(), 1.0, 0.0, "as asked for")
