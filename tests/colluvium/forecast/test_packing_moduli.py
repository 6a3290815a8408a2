"""Estimated moduli: exact for a hexagonal packing strained in any direction; the same shear modulus in the plane and in 3-D."""

from types import SimpleNamespace

import numpy as np
import pytest
from disc_cases import KN, KS, loose_discs

from colluvium.forecast.packing_moduli import Estimate, estimate, solid_of_plane
from dem_server.effects.spring import Spring
from dem_server.insitu.contact_stress import contact_moments
from dem_server.pairs import contacts
from dem_server.step.contact_pass import contact_forces

R, N = 0.05, 12


def hexagonal_stress(strain):
    """Mean stress xx, yy, xy (3,) [Pa] inside a hexagonal packing whose contacts are strained by `strain` xx, yy, xy."""
    i, j = np.meshgrid(np.arange(N), np.arange(N))
    xy = 2.0 * R * np.column_stack([(i + 0.5 * (j % 2)).ravel(), 0.5 * np.sqrt(3.0) * j.ravel()])
    model, state = loose_discs(xy, np.full(len(xy), 1.001 * R), friction=None)
    contact_forces(model, state)
    pairs = contacts(state)
    inside = ((i > 2) & (i < N - 3) & (j > 2) & (j < N - 3)).ravel()
    normal, d = pairs.normal, np.hypot(*pairs.branch.T)
    xx, yy, xy = strain
    stretch = xx * normal[:, 0] ** 2 + yy * normal[:, 1] ** 2 + 2.0 * xy * normal[:, 0] * normal[:, 1]
    slide = (yy - xx) * normal[:, 0] * normal[:, 1] + xy * (normal[:, 0] ** 2 - normal[:, 1] ** 2)
    strained = pairs._replace(normal_force=-KN * d * stretch, shear_force=-KS * d * slide)
    share = 0.5 * (inside[pairs.disc_a].astype(float) + inside[pairs.disc_b])
    area = inside.sum() * 2.0 * np.sqrt(3.0) * R * R
    return (contact_moments(strained) * share[:, None]).sum(axis=0) / area


def test_a_hexagonal_packing_has_the_estimated_moduli():
    hexagonal = SimpleNamespace(
        radius=R, porosity=1.0 - np.pi / (2.0 * np.sqrt(3.0)), stiffness="contact", pair=[],
        soil=SimpleNamespace(spring=Spring(normal=KN, shear=KS), friction=None, bond=None),
    )  # fmt: skip
    found = estimate(hexagonal)
    scale = 6.0 / 4.2  # contacts a disc
    bulk, shear = scale * found.bulk, scale * found.shear
    assert bulk == pytest.approx(0.5 * np.sqrt(3.0) * KN, rel=1e-9)
    assert hexagonal_stress((1e-4, 1e-4, 0.0)) == pytest.approx([2e-4 * bulk, 2e-4 * bulk, 0.0], rel=1e-9, abs=1e-6)
    assert hexagonal_stress((1e-4, -1e-4, 0.0)) == pytest.approx([2e-4 * shear, -2e-4 * shear, 0.0], rel=1e-9, abs=1e-6)
    assert hexagonal_stress((0.0, 0.0, 1e-4))[2] == pytest.approx(2e-4 * shear, rel=1e-9)


def test_moduli_in_the_plane_and_in_three_dimensions():
    """Table 1 of the paper: K 0.5, G 0.15 GPa are E 409 MPa and nu 0.364 in 3-D; E2 471 MPa, nu2 0.571 in the plane."""
    plane = Estimate(550e6, 150e6, 0.5, 0.0)
    assert plane.young_plane == pytest.approx(471e6, rel=1e-3)
    young, poisson = solid_of_plane(plane.young_plane, 0.5714)
    assert young == pytest.approx(409e6, rel=1e-3)
    assert poisson == pytest.approx(0.364, abs=1e-3)


def test_strength_at_a_pressure():
    """Without tension q / (q + 2 p) is the sine."""
    found = Estimate(1e7, 1e7, 0.5, 0.0)
    assert found.strength(1e5) / (found.strength(1e5) + 2e5) == pytest.approx(0.5)
