"""Static masses keep bonded discs inside the stability limit: largest eigenvalue of the linearised step."""

import numpy as np
import pytest
import scipy.sparse
import scipy.sparse.linalg
from window_case import OBLIQUE, SQUARE, packed, soil_discs, two_discs

from dem_server.pairs import listed_pairs
from dem_server.step import neighbours
from dem_server.step.masses import safety


def largest_omega2(model, state):
    """Largest eigenvalue of M^-1 K of the free discs, every listed pair taken as a bond."""
    pairs = listed_pairs(state)
    a, b, (nx, ny), m = pairs.disc_a, pairs.disc_b, pairs.normal.T, len(pairs.slot)
    gap = np.hypot(*pairs.branch.T) - state.radius[a] - state.radius[b]
    la, lb = state.radius[a] + 0.5 * gap, state.radius[b] + 0.5 * gap

    def stretch(*columns):
        """Rows of the relative displacement: coefficients of (x, y, spin) of disc a, then of disc b."""
        at = np.concatenate([3 * a, 3 * a + 1, 3 * a + 2, 3 * b, 3 * b + 1, 3 * b + 2])
        rows = np.tile(np.arange(m), 6)
        return scipy.sparse.csr_array((np.concatenate(columns), (rows, at)), shape=(m, 3 * model.count))

    kn, ks = (scipy.sparse.diags_array(k[pairs.kind]) for k in model.law.spring)
    normal, shear = stretch(-nx, -ny, 0 * nx, nx, ny, 0 * nx), stretch(ny, -nx, -la, -ny, nx, -lb)
    stiffness = normal.T @ kn @ normal + shear.T @ ks @ shear
    mass = np.column_stack([state.mass, state.mass, state.inertia])
    mass[: model.ring] = np.inf  # held
    scale = scipy.sparse.diags_array(mass.ravel() ** -0.5)
    return scipy.sparse.linalg.eigsh(scale @ stiffness @ scale, k=1, return_eigenvectors=False)[0]


def test_worst_single_contact():
    """Two discs with ks = kn that slide and roll on each other: omega^2 = 4 sf^2."""
    model, state = two_discs(shear=1.0)
    assert largest_omega2(model, state) == pytest.approx(4.0 * safety(model.law.damping) ** 2, rel=1e-9)


@pytest.mark.parametrize("corners", [SQUARE, OBLIQUE], ids=["square", "oblique"])
@pytest.mark.parametrize("shear", [0.4, 1.0])
@pytest.mark.parametrize("spread", [0.0, 0.25, 0.6])
def test_bonded_window(corners, shear, spread):
    model, state = packed(corners, soil_discs(spread=spread, shear=shear))
    neighbours.rebuild(model, state)
    omega2 = largest_omega2(model, state)
    sf2 = safety(model.law.damping) ** 2
    assert 1.5 * sf2 < omega2 < 4.0 * sf2  # neither wasteful nor beyond the worst single contact
    assert omega2 < 4.0 / 1.7
