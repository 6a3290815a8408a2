"""Stresses averaged at gridpoints lose the pressure mode, and nothing else that equilibrium determines."""

import numpy as np
import pytest

import colluvium
from colluvium.results.smoothed_stress import pressure_mode, smoothed


def square(n=6):
    """Gridpoints (N, 2) and zones (Z, 4) of n x n zones of 1 m; column and row (Z,) of each zone."""
    x, y = np.meshgrid(np.arange(n + 1.0), np.arange(n + 1.0))
    column, row = (axis.ravel() for axis in np.meshgrid(np.arange(n), np.arange(n)))
    first = row * (n + 1) + column
    return np.column_stack([x.ravel(), y.ravel()]), np.column_stack([first, first + 1, first + n + 2, first + n + 1]), column, row


def oblique(n=6):
    """The same, turned and shaken, with every seventh zone cut into two triangles."""
    xy, zones, *_ = square(n)
    turn = np.array([[0.8, -0.6], [0.6, 0.8]])
    xy = (xy + np.random.default_rng(3).uniform(-0.2, 0.2, xy.shape)) @ turn.T
    cut = np.arange(len(zones)) % 7 == 0
    low, high = zones[cut][:, [0, 1, 2, 2]], zones[cut][:, [0, 2, 3, 3]]
    return xy, np.concatenate([zones[~cut], low, high])


def areas(xy, zones):
    across, along = xy[zones[:, 2]] - xy[zones[:, 0]], xy[zones[:, 3]] - xy[zones[:, 1]]
    return 0.5 * (across[:, 0] * along[:, 1] - across[:, 1] * along[:, 0])


def one_material(zones):
    return np.zeros(len(zones), dtype=np.int64)


def smooth(xy, zones, values, material=None):
    """Smoothed values (Z,) of one quantity."""
    return smoothed(xy, zones, one_material(zones) if material is None else material, values[:, None])[:, 0]


def test_alternate_signs_vanish():
    """A quarter remains in the four zones at corners, whose gridpoint no other zone shares."""
    xy, zones, column, row = square()
    signs = np.where((column + row) % 2 == 0, 1.0, -1.0)
    ends = np.isin(column, (0, 5)) & np.isin(row, (0, 5))
    np.testing.assert_allclose(smooth(xy, zones, signs), np.where(ends, 0.25 * signs, 0.0), atol=1e-15)


def test_a_linear_field_stays_where_four_zones_meet_and_moves_by_a_quarter_zone_at_borders():
    xy, zones, column, row = square()
    smooth_field = smooth(xy, zones, 3.0 * column - 2.0 * row)
    shift = np.select([column == 0, column == 5], [0.25, -0.25])
    rise = np.select([row == 0, row == 5], [0.25, -0.25])
    np.testing.assert_allclose(smooth_field, 3.0 * (column + shift) - 2.0 * (row + rise), atol=1e-13)


def test_a_uniform_stress_and_the_mean_over_the_area_stay_on_any_mesh():
    xy, zones = oblique()
    assert (zones[:, 2] == zones[:, 3]).any()
    np.testing.assert_allclose(smooth(xy, zones, np.full(len(zones), 7.0)), 7.0, rtol=1e-14)
    values = np.random.default_rng(1).normal(size=len(zones))
    area = areas(xy, zones)
    assert area @ smooth(xy, zones, values) == pytest.approx(area @ values, rel=1e-12)
    assert np.std(smooth(xy, zones, values)) < 0.7 * np.std(values)


def test_every_column_is_averaged_alone_whatever_the_order_of_zones():
    xy, zones = oblique()
    values = np.random.default_rng(2).normal(size=(len(zones), 4))
    order = np.random.default_rng(4).permutation(len(zones))
    found = smoothed(xy, zones, one_material(zones), values)
    np.testing.assert_allclose(found[:, 2], smooth(xy, zones, values[:, 2]), rtol=1e-14)
    again = smoothed(xy, zones[order], one_material(zones), values[order])
    np.testing.assert_allclose(again, found[order], atol=1e-13)


def test_nothing_passes_from_one_material_to_another():
    """An oblique boundary of two materials, and a layer of one zone."""
    xy, zones, column, row = square()
    for layers in ((column + row > 5).astype(int), (row == 3).astype(int), 2 * (column > 2) + (row > 2)):
        stress = np.array([-1e5, -4e6, 3e4, 5.0])[layers]
        np.testing.assert_allclose(smooth(xy, zones, stress, layers), stress, rtol=1e-14)


def test_nothing_passes_over_removed_zones():
    """A slit of one zone, as after an excavation or under a window, separates what it touches; so does a common point alone."""
    xy, zones, column, row = square()
    slit = row == 3
    stress = np.where(row > 3, 1.0, -2.0)[~slit]
    np.testing.assert_allclose(smooth(xy, zones[~slit], stress), stress, rtol=1e-14)
    quarters = (column > 2) == (row > 2)  # two squares of three by three zones touch in one gridpoint
    stress = np.where(row > 2, 1.0, -2.0)[quarters]
    np.testing.assert_allclose(smooth(xy, zones[quarters], stress), stress, rtol=1e-14)


def test_around_a_window_zones_are_averaged_along_its_rim():
    """A ring of zones around a hole is one body: alternate signs around it vanish beside the hole too."""
    xy, zones, column, row = square(8)
    kept = ~((np.abs(column - 3.5) < 2) & (np.abs(row - 3.5) < 2))
    signs = np.where((column + row) % 2 == 0, 1.0, -1.0)[kept]
    ends = (np.isin(column, (0, 7)) & np.isin(row, (0, 7)))[kept]
    assert np.abs(smooth(xy, zones[kept], signs)[~ends]).max() <= 1.0 / 12.0 + 1e-15  # at the hole's corners three zones meet


def test_the_mode_is_measured_where_four_quadrilaterals_meet():
    xy, zones, column, row = square()
    signs = np.where((column + row) % 2 == 0, 1.0, -1.0)
    points, amplitude = pressure_mode(zones, 3.0 * signs + 2.0 * column - row)
    assert len(points) == 25
    assert set(xy[points].ravel()) == {1.0, 2.0, 3.0, 4.0, 5.0}
    np.testing.assert_allclose(np.abs(amplitude), 3.0, rtol=1e-14)
    xy, zones = oblique()
    points, amplitude = pressure_mode(zones, np.full(len(zones), 9.0))
    assert 0 < len(points) < 25
    assert np.abs(amplitude).max() < 1e-14


@pytest.fixture(scope="module")
def footing(tmp_path_factory, configs):
    """configs/footing.toml on coarser zones, until it flows: the folder of the run."""
    edits = ["grid.zone_size=0.25", "grid.graded={x=[0.0,2.0],y=[2.5,4.0],ratio=1.3}", "stage.0.until.steps=2000"]
    folder = tmp_path_factory.mktemp("footing") / "run"
    colluvium.run(colluvium.read_scene(configs / "footing.toml", edits), folder).close()
    return folder


def under_the_footing(run, stress):
    """Root mean square amplitude of alternate signs, and mean, of a stress (Z,) [Pa] below a footing of 1 m, down to 1 m."""
    points, amplitude = pressure_mode(run.zones(-1).corners, stress)
    xy = run.gridpoints(-1).xy[points]
    below = (xy[:, 0] < 1.0) & (xy[:, 1] > 3.0)
    centres = run.zones(-1).xy
    return np.sqrt(np.mean(amplitude[below] ** 2)), stress[(centres[:, 0] < 1.0) & (centres[:, 1] > 3.0)].mean()


def test_the_mode_under_a_footing_that_flows_is_in_the_mean_stress_of_zones_and_not_in_the_smoothed_one(footing):
    with colluvium.open_run(footing) as run:
        raw, smoothed_stress = run.zones(-1).stress, run.smoothed_stress(-1)
        of_mean, mean = under_the_footing(run, 0.5 * (raw[:, 0] + raw[:, 1]))
        of_deviator, _ = under_the_footing(run, 0.5 * (raw[:, 0] - raw[:, 1]))
        of_smoothed, same = under_the_footing(run, 0.5 * (smoothed_stress[:, 0] + smoothed_stress[:, 1]))
    assert -5.2e5 < mean < -3.5e5
    assert of_mean > 0.05 * -mean
    assert of_deviator < 0.01 * -mean
    assert of_smoothed < 0.01 * -mean
    assert same == pytest.approx(mean, rel=0.04)  # zones beside it count too


def test_the_picture_of_stress_has_the_smoothed_one_and_says_so(footing):
    plt = pytest.importorskip("matplotlib.pyplot")
    pytest.importorskip("cmcrameri")
    from colluvium.figures import stress

    with colluvium.open_run(footing) as run:
        expected = {"averaged at gridpoints": run.smoothed_stress(-1), "of each zone": run.zones(-1).stress}
        for words, figure in zip(expected, (stress.draw(run), stress.draw(run, by_zone=True)), strict=True):
            assert words in figure.get_suptitle()
            drawn = figure.axes[1].collections[0].get_array()
            np.testing.assert_allclose(drawn, 1e-3 * expected[words][:, 1], rtol=1e-12)
            assert any("syy [kPa]" in axes.get_ylabel() for axes in figure.axes)
            plt.close(figure)
