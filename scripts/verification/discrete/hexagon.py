"""Moduli of a hexagonal packing under uniform strain.

Every disc moves with the strain, so the springs of a contact give the moduli at once.

    C11 = sqrt3/4 (3 kn + ks),     C12 = sqrt3/4 (kn - ks),     G = sqrt3/4 (kn + ks)

Seven bonded discs, kn = 2.5e7, ks = 1e7 N/m, turned by 0.2 rad; strains of ±1e-5, whose difference has no second-order part.
The stress is the average over the cell of the middle disc.
"""

import numpy as np

from dem_server.effects.bond import Bond
from dem_server.insitu.contact_stress import contact_moments
from dem_server.pairs import contacts
from verification.discrete.discs import KN, KS, displace, loose_discs
from verification.verdict_rows import row

NAME = "hexagon"
R = 0.03
CELL = 2.0 * np.sqrt(3.0) * R * R  # area of one disc's cell
STRAIN = 1.0e-5
C11, C12, G = (np.sqrt(3.0) / 4.0 * k for k in (3.0 * KN + KS, KN - KS, KN + KS))


def stress_of(strain, turned):
    """Stress xx, yy, xy of the middle disc's cell in a hexagon of 7 discs under a uniform strain."""
    angle = turned + np.arange(6) * np.pi / 3.0
    xy = np.vstack([[0.0, 0.0], 2.0 * R * np.column_stack([np.cos(angle), np.sin(angle)])])
    model, state = loose_discs(xy, np.full(7, R), bonded=True, bond=Bond(tension=1e9, shear=1e9))
    displace(model, state, xy @ strain)
    pairs = contacts(state)
    spokes = (pairs.disc_a == 0) | (pairs.disc_b == 0)
    if spokes.sum() != 6:
        raise ArithmeticError("the middle disc does not touch its six neighbours")
    return 0.5 * contact_moments(pairs)[spokes].sum(axis=0) / CELL


def moduli(strain, turned):
    """Stress xx, yy, xy over the strain [N/m]."""
    strain = STRAIN * np.array(strain)
    return (stress_of(strain, turned) - stress_of(-strain, turned)) / (2.0 * STRAIN)


def rows(fast):
    """Stretch in x, and shear."""
    closed = "closed form (affine motion of a Bravais lattice)"
    xx, yy, _ = moduli([[1.0, 0.0], [0.0, 0.0]], 0.2)
    yield row("C11 [N/m]", xx, C11, 1e-8, closed)
    yield row("C12 [N/m]", yy, C12, 1e-8, closed)
    yield row("G [N/m]", moduli([[0.0, 0.5], [0.5, 0.0]], 0.2)[2], G, 1e-8, closed)
