"""Fabric parameters against distributions of known anisotropy."""

import numpy as np
import pytest

from colluvium.results.fabric import fit_fabric
from colluvium.results.run import open_run


def angles(a, theta_a, count, uniform=None):
    """Angles [rad] distributed as (1 + a cos 2(theta - theta_a)) / pi over half a turn, by inversion."""
    fine = np.linspace(0.0, np.pi, 20001)
    share = (fine + 0.5 * a * (np.sin(2 * (fine - theta_a)) + np.sin(2 * theta_a))) / np.pi
    uniform = (np.arange(count) + 0.5) / count if uniform is None else uniform
    return np.interp(uniform, share, fine)


@pytest.mark.parametrize(("a", "degrees"), [(0.02, 10.0), (0.26, 62.0), (0.4, 175.0)])
def test_a_and_its_direction(a, degrees):
    fabric = fit_fabric(angles(a, np.radians(degrees), 100_000), np.ones(100_000))
    assert fabric.a == pytest.approx(a, abs=1e-6)
    assert fabric.theta_a == pytest.approx(degrees, abs=2e-3)
    assert fabric.a_n == pytest.approx(0.0, abs=1e-12)


def test_forces_are_fitted_contact_by_contact():
    """The moment of the forces would give a_n = .76 here: the normals themselves are anisotropic."""
    theta = angles(0.3, np.radians(60.0), 20_000)
    fabric = fit_fabric(theta, 250.0 * (1.0 + 0.56 * np.cos(2.0 * (theta - np.radians(60.0)))))
    assert (fabric.f0, fabric.a_n, fabric.theta_n) == pytest.approx((250.0, 0.56, 60.0), rel=1e-12)


def test_the_interval_covers_the_truth():
    """95 % of samples, give or take what 400 samples scatter by (three standard deviations: .033)."""
    rng = np.random.default_rng(3)
    covered = 0
    for _ in range(400):
        low, high = fit_fabric(angles(0.26, 1.0, 600, rng.random(600)), np.ones(600)).a_interval
        covered += low <= 0.26 <= high
    assert covered / 400 == pytest.approx(0.95, abs=0.033)


def test_the_noise_of_isotropic_samples():
    """Of isotropic samples, 5 % exceed the stated level (sqrt(4 ln 20 / N) for N independent contacts)."""
    rng = np.random.default_rng(5)
    fabrics = [fit_fabric(np.pi * rng.random(500), np.ones(500)) for _ in range(1000)]
    assert np.mean([f.a > f.a_noise for f in fabrics]) == pytest.approx(0.05, abs=0.021)


def test_contacts_of_the_ring_are_left_out(run_folder):
    with open_run(run_folder) as run:
        discs, contacts = run.discs(-1), run.contacts(-1)
        inner = (discs.control[contacts.ends] == 0).all(axis=1)
        assert 0 < inner.sum() < len(inner)
        assert run.fabric(-1).contacts == inner.sum()


def test_too_few_contacts_are_refused():
    with pytest.raises(ValueError, match="at least 3 contacts"):
        fit_fabric(np.zeros(2), np.ones(2))
