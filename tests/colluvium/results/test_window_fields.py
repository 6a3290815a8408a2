"""Stress and strain of a window against closed forms."""

import numpy as np
import pytest

from colluvium.results.run import open_run
from colluvium.results.window_fields import bins, mean_stress, shear_strain
from coupler_protocol.files.recorder import FrameInfo, Recorder


def test_bins_are_the_zones_that_were_removed(run_folder, slope):
    with open_run(run_folder) as run:
        grid = bins(run, -1)
        xy, zones = slope.grid()
        removed = xy[zones].mean(axis=1)[slope.in_window(xy[zones].mean(axis=1))]
        assert grid.shape == (4, 10)
        assert grid.used.all()
        assert np.allclose(np.sort(grid.rectangles.mean(axis=1), axis=0), np.sort(removed, axis=0))
        assert grid.area.sum() == pytest.approx(10.0, rel=1e-12)


def test_mean_stress_in_a_bin_is_that_of_the_field(run_folder, slope):
    """Bins inside the window; at its edge the lattice lacks the contacts between control discs."""
    with open_run(run_folder) as run:
        grid = bins(run, 2)
        middles = grid.rectangles.mean(axis=1)
        inside = (np.abs(middles - (12.0, 7.5)) < (0.75, 2.25)).all(axis=1)
        measured = mean_stress(run, 2, grid)[inside]
        expected = slope.stress_at(middles[inside])[:, [0, 1, 3]]
        assert inside.sum() == 16
        assert measured[:, 0] == pytest.approx(expected[:, 0], rel=0.03)
        assert measured[:, 1] == pytest.approx(expected[:, 1], rel=0.03)
        assert measured[:, 2] == pytest.approx(expected[:, 2], rel=0.05)


@pytest.fixture
def sheared_discs(tmp_path):
    """Discs alone, moved by u = G x and v = 2 u; one contact under compression and shear."""
    gradient = np.array([[0.01, 0.03], [-0.002, 0.004]])
    start = 2.0 * np.random.default_rng(2).random((400, 2))
    start[:2] = (1.0, 1.0), (1.1, 1.0)
    displacement = start @ gradient.T
    with Recorder(tmp_path / "dem.rank1.vtkhdf", "discrete") as recorder:
        recorder.frame(
            FrameInfo(0, 0.0, "shear", 1.0),
            points=start + displacement,
            cells=np.array([[0, 1]]),
            point_fields={
                "radius": np.full(400, 0.05),
                "displacement": displacement,
                "velocity": 2.0 * displacement,
            },
            cell_fields={"normal_force": np.array([30.0]), "shear_force": np.array([12.0])},
        )
    with open_run(tmp_path) as run:
        yield run, gradient


def test_a_linear_displacement_has_its_shear_strain_in_every_bin(sheared_discs):
    run, g = sheared_discs
    grid = bins(run, 0)
    exact = np.hypot(g[0, 0] - g[1, 1], g[0, 1] + g[1, 0])
    strain = shear_strain(run, 0, grid)
    assert np.isfinite(strain).all()
    assert strain == pytest.approx(exact, rel=1e-9)
    assert shear_strain(run, 0, grid, field="velocity") == pytest.approx(2.0 * exact, rel=1e-9)


def test_one_contact_gives_branch_times_force_over_area(sheared_discs):
    """Force on the second disc: 30 N along the branch (compression), 12 N to its left."""
    run, g = sheared_discs
    grid = bins(run, 0)
    total = np.nansum(mean_stress(run, 0, grid) * grid.area[:, None], axis=0)
    x, y = branch = (np.eye(2) + g) @ (0.1, 0.0)
    fx, fy = 30.0 * branch / np.hypot(x, y) + 12.0 * np.array([-y, x]) / np.hypot(x, y)
    assert total == pytest.approx([-x * fx, -y * fy, -0.5 * (x * fy + y * fx)], rel=1e-12)
