"""Fabric parameters against distributions of known anisotropy."""

import numpy as np
import pytest

from colluvium.results.fabric import directions, fit_fabric
from colluvium.results.run import open_run


class Rows(dict):
    """Arrays by name, as of a frame."""

    __getattr__ = dict.__getitem__


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
    """Of isotropic samples, 5 % exceed the stated levels; only those have a direction and an interval that excludes 0."""
    rng = np.random.default_rng(5)
    fabrics = [fit_fabric(np.pi * rng.random(500), rng.gamma(2.0, 0.5, 500)) for _ in range(500)]
    assert np.mean([f.contacts_isotropic for f in fabrics]) == pytest.approx(0.95, abs=0.03)
    assert np.mean([f.forces_isotropic for f in fabrics]) == pytest.approx(0.95, abs=0.03)
    for f in fabrics:
        assert f.contacts_isotropic == (f.theta_a_error == 90.0) == (f.a_interval[0] == 0.0)
        assert f.forces_isotropic == (f.theta_n_error == 90.0) == (f.a_n_interval[0] == 0.0)


def covered(samples, truth):
    """Shares of the samples (theta, force, bodies) whose intervals contain the true a, theta_a, a_n, theta_n."""
    inside = []
    for sample in samples:
        f = fit_fabric(*sample)
        off = [(found - true + 90.0) % 180.0 - 90.0 for found, true in zip((f.theta_a, f.theta_n), truth[1::2], strict=True)]
        inside.append(
            [
                f.a_interval[0] <= truth[0] <= f.a_interval[1],
                abs(off[0]) <= f.theta_a_error,
                f.a_n_interval[0] <= truth[2] <= f.a_n_interval[1],
                abs(off[1]) <= f.theta_n_error,
            ]
        )
    return np.mean(inside, axis=0)


def in_patches(rng, spread):
    """400 contacts of a square in 100 patches; in a patch, directions and forces have a common part in which patches differ."""
    patch = np.repeat(np.arange(100), 4)
    corner = np.column_stack(np.divmod(patch, 10))
    centre = corner + rng.random((400, 2))
    bodies = np.stack((centre, centre + 0.02), axis=1)
    theta = angles(0.3, 1.0, 400, (rng.random(100)[patch] + spread * rng.random(400)) % 1.0)
    common = rng.gamma(4.0, 0.25, 100)[patch]
    return theta, common * (1.0 + 0.4 * np.cos(2.0 * (theta - 1.0))), bodies


def test_intervals_of_contacts_that_follow_each_other():
    """Contacts of a patch are alike: taken as independent, half of the intervals miss the truth."""
    rng = np.random.default_rng(11)
    samples = [in_patches(rng, 0.1) for _ in range(120)]
    truth = 0.3, np.degrees(1.0), 0.4, np.degrees(1.0)
    assert covered(samples, truth) == pytest.approx([0.95] * 4, abs=0.06)
    assert covered([sample[:2] for sample in samples], truth)[0] < 0.75


def test_intervals_of_contacts_that_exclude_each_other():
    """Each disc has three contacts 120 degrees apart, as in a dense packing: with all of them, a is 0 and so is its interval."""
    rng = np.random.default_rng(12)
    middle = np.column_stack(np.divmod(np.arange(225), 15)).astype(float)
    theta = (np.pi * rng.random(225)[:, None] + 2.0 * np.pi / 3.0 * np.arange(3)).ravel()
    centre = np.repeat(middle, 3, axis=0)
    ends = centre + 0.1 * np.column_stack((np.cos(theta), np.sin(theta)))
    whole = fit_fabric(theta, np.ones(675), np.stack((centre, ends), axis=1))
    assert whole.a < 1e-12
    assert whole.a_noise < 0.25 * fit_fabric(theta, np.ones(675)).a_noise


def test_bodies_on_a_line_have_blocks_along_it():
    rng = np.random.default_rng(13)
    x = np.arange(200.0)
    bodies = np.stack((np.column_stack((x, 0.0 * x)), np.column_stack((x + 1.0, 0.0 * x))), axis=1)
    found = fit_fabric(np.pi * rng.random(200), np.ones(200), bodies)
    assert 0.1 < found.a_noise < 1.0


def test_so_few_contacts_say_nothing():
    found = fit_fabric(np.array([0.1, 0.2, 0.3]), np.ones(3), np.zeros((3, 2, 2)) + np.array([[0.0, 0.0], [1.0, 1.0]]))
    assert found.contacts_isotropic
    assert found.a_interval[0] == 0.0
    assert found.a_interval[1] > 2.0


def test_contacts_of_a_stone_belong_to_its_centre():
    """Discs 0 and 1 are one stone, disc 2 is soil."""
    xy = np.array([[0.0, 0.0], [0.2, 0.0], [0.3, 0.0]])
    discs = Rows(xy=xy, stone=np.array([0, 0, -1]))
    contacts = Rows(ends=np.array([[0, 1], [1, 2]]), normal_force=np.ones(2))
    assert directions(discs, contacts).bodies.tolist() == [[[0.1, 0.0], [0.3, 0.0]]]


def test_contacts_of_the_ring_are_left_out(run_folder):
    with open_run(run_folder) as run:
        discs, contacts = run.discs(-1), run.contacts(-1)
        inner = (discs.control[contacts.ends] == 0).all(axis=1)
        assert 0 < inner.sum() < len(inner)
        assert run.fabric(-1).contacts == inner.sum()


def test_too_few_contacts_are_refused():
    with pytest.raises(ValueError, match="at least 3 contacts"):
        fit_fabric(np.zeros(2), np.ones(2))
