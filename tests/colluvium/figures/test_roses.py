"""Rose diagrams: bins against distributions of known anisotropy, and the contacts they count."""

import numpy as np
import pytest

from colluvium.figures import roses
from colluvium.results.run import open_run
from coupler_protocol.files.recorder import FrameInfo, Recorder

plt = pytest.importorskip("matplotlib.pyplot")
pytest.importorskip("cmcrameri")


def directions(a, theta_a, count):
    """Angles distributed as (1 + a cos 2(theta - theta_a)) / pi over half a turn, by inversion."""
    fine = np.linspace(0.0, np.pi, 20001)
    share = (fine + 0.5 * a * (np.sin(2.0 * (fine - theta_a)) + np.sin(2.0 * theta_a))) / np.pi
    return np.interp((np.arange(count) + 0.5) / count, share, fine)


def test_bins_hold_the_density_and_the_mean_force_of_their_directions():
    """Means over a bin of width w: the wave 2 theta is lower by sin(w)/w than in its middle."""
    a, a_n, axis = 0.26, 0.56, np.radians(62.0)
    theta = directions(a, axis, 200_000)
    theta[::2] += np.pi  # a contact points both ways
    found = roses.bin_directions(theta, 300.0 * (1.0 + a_n * np.cos(2.0 * (theta - axis))))
    width = np.pi / roses.BINS
    wave = np.sin(width) / width * np.cos(2.0 * (found.middles - axis))
    np.testing.assert_allclose(found.density, (1.0 + a * wave) / (2.0 * np.pi), atol=3e-5)  # 200,000 contacts are whole
    np.testing.assert_allclose(found.force, 300.0 * (1.0 + a_n * wave), rtol=0.003)  # bins are not evenly filled
    assert found.density.sum() * width == pytest.approx(1.0, rel=1e-12)
    assert len(found.middles) == 36
    assert (found.fabric.a, found.fabric.theta_a) == pytest.approx((a, 62.0), abs=2e-3)


def test_a_direction_without_contacts_has_no_force():
    found = roses.bin_directions(np.array([0.01, 0.02, 1.6, 1.61]), np.full(4, 7.0))
    assert sorted(set(found.force)) == [0.0, 7.0]
    assert np.count_nonzero(found.density) == 4


def test_the_contacts_are_those_of_the_fabric(run_folder):
    with open_run(run_folder) as run:
        for _, frame in roses.shown(run):
            assert roses.rose(run, frame).fabric == run.fabric(frame)


def test_contacts_inside_a_stone_are_left_out(tmp_path):
    """Six discs in a ring, the first three of them one stone: two of the six contacts are inside it."""
    around = np.arange(6) * np.pi / 3.0
    ends = np.column_stack((np.arange(6), (np.arange(6) + 1) % 6))
    with Recorder(tmp_path / "dem.rank1.vtkhdf", "discrete") as recorder:
        recorder.frame(
            FrameInfo(0, 0.0, "couple", 1.0),
            points=0.1 * np.column_stack((np.cos(around), np.sin(around))),
            cells=ends,
            point_fields={
                "id": np.arange(6),
                "radius": np.full(6, 0.05),
                "displacement": np.zeros((6, 2)),
                "stone": np.array([0, 0, 0, -1, -1, -1]),
            },
            cell_fields={"normal_force": np.arange(1.0, 7.0), "disc_a": ends[:, 0], "disc_b": ends[:, 1]},
        )
    with open_run(tmp_path) as run:
        assert roses.directions(run, 0)[1].tolist() == [3.0, 4.0, 5.0, 6.0]
        assert roses.rose(run, 0).fabric == run.fabric(0)
        assert roses.missing(run) == "fewer than 54 contacts under pressure"  # four contacts make no rose


def test_initial_coupled_state_and_the_frames_of_the_shear_strain(run_folder):
    with open_run(run_folder) as run:
        assert not roses.missing(run)
        assert [one.frame for one in roses.shown(run)] == [3, 4, 5]
        figure = roses.draw(run)
        titles = [axes.get_title(loc="left") for axes in figure.axes]
        fabric, last = run.fabric(3), run.fabric(5)
    assert len(titles) == 6
    assert titles[0].startswith("couple, step 3,000\n")
    assert f"a = {fabric.a:.3f}, 95 %:\n{fabric.a_interval[0]:.3f} to {fabric.a_interval[1]:.3f}" in titles[0]
    assert fabric.contacts_isotropic  # 1,794 contacts with a = 0.03
    assert titles[0].endswith("\nisotropic within 95 %")
    assert titles[5].endswith(f"$\\theta_n$ = {last.theta_n:.0f} ± {last.theta_n_error:.0f}°")
    assert f"a$_n$ = {fabric.a_n:.3f}, 95 %:\n{fabric.a_n_interval[0]:.3f} to {fabric.a_n_interval[1]:.3f}" in titles[3]
    bars = [bar.get_height() for bar in figure.axes[0].patches]
    np.testing.assert_allclose(np.sum(bars) * np.pi / roses.BINS, 1.0, rtol=1e-9)
    plt.close(figure)


def test_an_isotropic_packing_has_no_direction():
    assert roses._direction("a", 35.0, 90.0, True) == "isotropic within 95 %"
    assert roses._direction("n", 35.0, 8.4, False) == "$\\theta_n$ = 35 ± 8°"


def test_without_discs_there_is_no_rose(run_folder, tmp_path):
    (tmp_path / "fdm.rank0.vtkhdf").symlink_to(run_folder / "fdm.rank0.vtkhdf")
    with open_run(tmp_path) as run:
        assert roses.missing(run) == "no frame of discs"
