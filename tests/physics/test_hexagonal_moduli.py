"""Hexagonal packing under uniform strain.

    C11 = sqrt3/4 (3 kn + ks),   C12 = sqrt3/4 (kn - ks),   G = sqrt3/4 (kn + ks)
"""

import numpy as np
import pytest
from disc_cases import KN, KS, displace, loose_discs

from dem_server.effects.bond import Bond
from dem_server.fields import contacts
from dem_server.stress import contact_moments

R = 0.03
CELL = 2.0 * np.sqrt(3.0) * R * R  # area of one disc's cell
STRAIN = 1.0e-5


def stress_of(strain, turned):
    """Stress xx, yy, xy of the middle disc's cell in a hexagon of 7 discs under a uniform strain."""
    angle = turned + np.arange(6) * np.pi / 3.0
    xy = np.vstack([[0.0, 0.0], 2.0 * R * np.column_stack([np.cos(angle), np.sin(angle)])])
    model, state = loose_discs(xy, np.full(7, R), bonded=True, bond=Bond(tension=1e9, shear=1e9))
    displace(model, state, xy @ strain)
    pairs = contacts(state)
    spokes = (pairs.disc_a == 0) | (pairs.disc_b == 0)
    assert spokes.sum() == 6
    return 0.5 * contact_moments(pairs)[spokes].sum(axis=0) / CELL


@pytest.mark.parametrize("turned", [0.0, 0.2, 0.9])
@pytest.mark.parametrize(
    ("strain", "factors"),
    [
        ([[1.0, 0.0], [0.0, 0.0]], ["C11", "C12", 0.0]),
        ([[0.0, 0.0], [0.0, 1.0]], ["C12", "C11", 0.0]),
        ([[0.0, 0.5], [0.5, 0.0]], [0.0, 0.0, "G"]),
    ],
)
def test_moduli(strain, factors, turned):
    moduli = {
        "C11": np.sqrt(3.0) / 4.0 * (3.0 * KN + KS),
        "C12": np.sqrt(3.0) / 4.0 * (KN - KS),
        "G": np.sqrt(3.0) / 4.0 * (KN + KS),
    }
    expected = np.array([moduli.get(f, 0.0) for f in factors])
    strain = STRAIN * np.array(strain)
    found = (stress_of(strain, turned) - stress_of(-strain, turned)) / (2.0 * STRAIN)
    np.testing.assert_allclose(found, expected, rtol=1e-8, atol=1e-8 * moduli["C11"])
