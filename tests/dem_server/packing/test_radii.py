"""Discs have the sizes that were asked for: lognormal ones by number, a grading curve by area."""

import tomllib

import numpy as np
import pytest
import scipy.stats
from pydantic import ValidationError

from coupler_protocol.problems import SceneError
from coupler_protocol.scene.reader import build_scene
from coupler_protocol.scene.tables.grading import Grading, Uniform
from dem_server.packing.radii import radii

LOGNORMAL = Grading(lognormal={"mean": 0.06, "sigma": 0.3, "min": 0.035, "max": 0.12})
CURVE = Grading(curve=[[0.02, 0.0], [0.04, 0.15], [0.05, 0.15], [0.08, 0.7], [0.2, 1.0]])  # nothing between 40 and 50 mm


def truncated(d):
    """Share by number not larger than d of the lognormal grading, by scipy."""
    size = LOGNORMAL.lognormal
    whole = scipy.stats.lognorm(size.sigma, scale=size.mean * np.exp(-0.5 * size.sigma**2)).cdf
    return (whole(d) - whole(size.min)) / (whole(size.max) - whole(size.min))


@pytest.mark.parametrize("seed", range(5))
def test_lognormal_diameters_in_every_seed(seed):
    """The largest distance of distributions (Kolmogorov-Smirnov) is at most 1/n; of independent ones 1.36/sqrt(n)."""
    number = 300
    d = 2.0 * radii(number, LOGNORMAL, np.random.default_rng(seed))
    assert scipy.stats.kstest(d, truncated).statistic <= 1.0 / number + 1e-12
    assert (np.diff(d) > 0.0).sum() == pytest.approx(number / 2, abs=40)  # in random order


def test_a_curve_by_area():
    """Area of all discs up to a diameter over the area of all, between and at the points of the curve."""
    d = np.sort(2.0 * radii(40_000, CURVE, np.random.default_rng(1)))
    passing = np.cumsum(d**2) / (d**2).sum()
    points = np.array(CURVE.curve)
    asked = np.geomspace(0.0201, 0.1999, 60)
    expected = np.interp(np.log(asked), np.log(points[:, 0]), points[:, 1])
    found = np.interp(asked, d, passing)
    away = (asked < 0.04) | (asked > 0.05)  # there interpolation between the two discs next to the gap means nothing
    np.testing.assert_allclose(found[away], expected[away], atol=2e-3)
    assert not ((d > 0.04 + 1e-9) & (d < 0.05 - 1e-9)).any()


@pytest.mark.parametrize("grading", [LOGNORMAL, CURVE])
def test_moments_are_those_of_the_discs(grading):
    r = radii(100_000, grading, np.random.default_rng(2))
    assert r.mean() == pytest.approx(grading.mean_radius, rel=1e-4)
    assert ((2.0 * r) ** 2).mean() == pytest.approx(grading.moment(2), rel=1e-3)
    assert grading.smallest <= r.min() < 1.01 * grading.smallest
    assert 0.98 * grading.largest < r.max() <= grading.largest


def test_uniform_moments():
    uniform = Uniform(0.03, 0.25)
    assert uniform.moment(1) == pytest.approx(0.06, rel=1e-14)
    assert uniform.moment(2) == pytest.approx(4.0 * 0.03**2 * (1.0 + 0.25**2 / 3.0), rel=1e-14)


@pytest.mark.parametrize(
    ("table", "why"),
    [
        ({}, "one of them"),
        ({"curve": [[0.1, 0.0], [0.2, 1.0]], "lognormal": {"mean": 0.1, "sigma": 0.2, "min": 0.05, "max": 0.2}}, "one of them"),
        ({"curve": [[0.1, 0.0], [0.1, 1.0]]}, "must grow"),
        ({"curve": [[0.1, 0.0], [0.2, 0.6], [0.3, 0.5]]}, "must not fall"),
        ({"curve": [[0.1, 0.1], [0.2, 1.0]]}, "first share must be 0"),
        ({"lognormal": {"mean": 0.1, "sigma": 0.2, "min": 0.2, "max": 0.3}}, "increasing order"),
    ],
)
def test_gradings_that_are_none(table, why):
    with pytest.raises(ValidationError, match=why):
        Grading(**table)


def scene_with(**discs):
    soil = {"density": 2000.0, "spring": {"normal": 5e7, "shear": 2e7}}
    stage = {"name": "go", "kind": "discs", "until": {"steps": 1}}
    window = {"name": "w", "polygon": [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]]}
    return {"format": 1, "seed": 1, "window": [window], "discs": discs | {"soil": soil}, "stage": [{"name": "fill"}, stage]}


def test_the_radius_of_a_scene_is_that_of_its_grading():
    grading = {"curve": [[0.02, 0.0], [0.08, 1.0]]}
    scene = build_scene(scene_with(grading=grading))
    assert scene.discs.radius == scene.discs.grading.mean_radius == pytest.approx(0.016, rel=1e-12)  # d0 d1 / (d0 + d1)
    assert build_scene(scene.resolved()) == scene
    with pytest.raises(SceneError, match="must grow") as found:
        build_scene(scene_with(grading={"curve": [[0.2, 0.0], [0.08, 1.0]]}))
    assert len(found.value.problems) == 1


def test_discs_larger_than_the_window_are_refused():
    with pytest.raises(SceneError, match="1 m across: too small for its largest discs"):
        build_scene(scene_with(grading={"curve": [[0.02, 0.0], [0.4, 1.0]]}))


def test_discs_larger_than_the_window_of_a_grid_are_refused(configs):
    data = tomllib.loads((configs / "quick_slope.toml").read_text())
    del data["discs"]["radius"]
    data["discs"]["grading"] = {"curve": [[0.05, 0.0], [0.4, 1.0]]}
    assert build_scene(data).discs.radius == pytest.approx(0.02 / 0.45, rel=1e-12)
    data["discs"]["grading"]["curve"][1][0] = 0.6
    with pytest.raises(SceneError, match=r"2 m across: too small for its largest discs, of 0.6 m"):
        build_scene(data)
