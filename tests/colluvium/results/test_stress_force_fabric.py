"""Force anisotropies and the stress-force-fabric identity against distributions that are known exactly."""

import numpy as np
import pytest

from colluvium.results.fabric import fit_fabric
from colluvium.results.stress_force_fabric import fitted
from tests.colluvium.results.test_fabric import angles

COUNT = 40_000


def synthetic(a, theta_a, a_n, theta_n, a_t, theta_t, f0=250.0):
    """Angles (C,), normal and tangential forces [N] of Eqs (1) to (3); angles in degrees."""
    theta = angles(a, np.radians(theta_a), COUNT)
    normal = f0 * (1.0 + a_n * np.cos(2.0 * (theta - np.radians(theta_n))))
    return theta, normal, -f0 * a_t * np.sin(2.0 * (theta - np.radians(theta_t)))


@pytest.mark.parametrize("case", [(0.2, 60.0, 0.4, 60.0, 0.15, 60.0), (0.15, 80.0, 0.35, 100.0, 0.12, 95.0)])
def test_known_distributions_are_found_and_explain_the_stress(case):
    """The sum over contacts of force times normal, which knows nothing of the fit, is what Eq (4) says."""
    found = fitted(*synthetic(*case))
    a, theta_a, a_n, theta_n, a_t, theta_t = case
    assert (found.fabric.a, found.fabric.theta_a) == pytest.approx((a, theta_a), rel=1e-3)
    assert (found.fabric.a_n, found.fabric.theta_n) == pytest.approx((a_n, theta_n), rel=1e-9)
    assert (found.a_t, found.theta_t) == pytest.approx((a_t, theta_t), rel=1e-9)
    vectors = sum(size * np.exp(2j * np.radians(angle)) for size, angle in ((a, theta_a), (a_n, theta_n), (a_t, theta_t)))
    sine = abs(vectors) / (2.0 + a * a_n * np.cos(2.0 * np.radians(theta_a - theta_n)))
    assert found.sine == pytest.approx(sine, rel=1e-4)
    assert abs(found.residual) < 1e-4 * sine
    assert found.theta == pytest.approx(np.degrees(np.angle(vectors)) / 2.0 % 180.0, abs=1e-2)
    assert min(found.fit_a, found.fit_n, found.fit_t) > 0.999


def test_with_one_direction_it_is_half_the_sum_over_the_product():
    found = fitted(*synthetic(0.2, 90.0, 0.4, 90.0, 0.15, 90.0))
    assert found.predicted == pytest.approx(0.5 * (0.2 + 0.4 + 0.15) / (1.0 + 0.5 * 0.2 * 0.4), rel=1e-4)


def test_forces_of_another_order_fit_badly():
    theta, normal, shear = synthetic(0.2, 60.0, 0.0, 0.0, 0.0, 0.0)
    found = fitted(theta, normal * (1.0 + 0.3 * np.cos(6.0 * theta)), shear + 50.0 * np.cos(6.0 * theta))
    assert found.fit_a > 0.999
    assert max(found.fit_n, found.fit_t) < 0.1


def test_the_interval_of_the_tangential_forces_covers_the_truth():
    """Independent contacts with noise: 95 % of 200 samples, give or take three standard deviations."""
    rng, covered = np.random.default_rng(4), 0
    for _ in range(200):
        theta = angles(0.2, 1.0, 500, rng.random(500))
        normal = rng.gamma(4.0, 25.0, 500) * (1.0 + 0.3 * np.cos(2.0 * (theta - 1.0)))
        shear = -100.0 * 0.2 * np.sin(2.0 * (theta - 1.0)) + rng.normal(0.0, 30.0, 500)
        low, high = fitted(theta, normal, shear).a_t_interval
        covered += low <= 0.2 <= high
    assert covered / 200 == pytest.approx(0.95, abs=0.047)


def test_branches_that_grow_with_the_force_are_seen_in_the_residual():
    """Long branches carry more along x: the stress is more anisotropic than the identity says."""
    theta, normal, shear = synthetic(0.1, 0.0, 0.2, 0.0, 0.1, 0.0)
    length = 1.0 + 0.2 * np.cos(2.0 * theta)
    branch = length[:, None] * np.column_stack((np.cos(theta), np.sin(theta)))
    found = fitted(theta, normal, shear, branch=branch)
    assert found.fabric == fit_fabric(theta, normal)
    assert found.residual > 0.05
