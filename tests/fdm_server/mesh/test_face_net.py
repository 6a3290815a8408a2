"""Nets whose columns run along the faces of a slope."""

from types import SimpleNamespace

import numpy as np
import pytest

from coupler_protocol.scene.reader import read_scene
from fdm_server.mesh.face_net import along_face_mesh
from fdm_server.mesh.grid import areas, build_grid
from fdm_server.mesh.zone_sides import boundary_edges

PROFILES = {
    "slope": [(0, 5), (10, 5), (20, 15), (35, 15)],
    "falling": [(0, 15), (15, 15), (25, 5), (35, 5)],
    "bench": [(0, 5), (10, 5), (14, 9), (17, 9), (23, 15), (35, 15)],
    "dam": [(0, 2), (5, 2), (8, 6), (10, 6), (14, 2), (20, 2)],
    "wall": [(0, 2), (5, 2), (8, 6), (9, 6), (9, 9), (12, 9), (16, 4), (18, 4), (20, 2), (25, 2)],
    "odd angle": [(0, 4.1), (6.3, 4.1), (12.7, 13.2), (30, 13.2)],
}


def mesh(profile, size=(0.8, 0.5), levels=()):
    """The net of a profile."""
    length, height = profile[-1][0], max(y for _, y in profile)
    return along_face_mesh(SimpleNamespace(profile=profile, zone_size=size, length=length, height=height, origin=None), levels)


@pytest.mark.parametrize("name", PROFILES)
def test_zones_fill_the_ground_exactly(name):
    """Areas add up to the ground's, every gridpoint belongs to a zone, and the outer sides lie on the profile and the box."""
    profile = np.array(PROFILES[name], dtype=float)
    xy, zones, _, _ = mesh(PROFILES[name])
    area = areas(xy, zones)
    assert area.min() > 0.05
    assert area.sum() == pytest.approx(0.5 * np.sum((profile[1:, 1] + profile[:-1, 1]) * np.diff(profile[:, 0])), rel=1e-12)
    assert np.array_equal(np.unique(zones), np.arange(len(xy)))
    edges = boundary_edges(zones)
    outline = np.hypot(*(xy[edges[:, 1]] - xy[edges[:, 0]]).T).sum()
    ground = np.hypot(*np.diff(profile, axis=0).T).sum()
    assert outline == pytest.approx(ground + profile[-1, 0] + profile[0, 1] + profile[-1, 1], rel=1e-12)


@pytest.mark.parametrize("name", PROFILES)
def test_every_zone_has_four_corners_and_level_sides(name):
    xy, zones, column, row = mesh(PROFILES[name])
    y = xy[zones, 1]
    assert np.all(np.diff(np.sort(zones, axis=1), axis=1) > 0)
    assert np.allclose(y[:, 0], y[:, 1])
    assert np.allclose(y[:, 2], y[:, 3])
    assert len({*zip(column.tolist(), row.tolist(), strict=True)}) == len(zones)
    assert column.min() == row.min() == 0
    assert np.all(np.lexsort((column, row)) == np.arange(len(zones)))


def test_rows_follow_the_level_tops_of_materials():
    assert 7.3 in mesh(PROFILES["slope"], levels=[7.3])[0][:, 1]


def test_the_scene_asks_for_it(configs):
    """fit = "face" in a scene, with a material whose level top becomes a line of the net."""
    scene = read_scene(configs / "dawson_slope.toml")
    rock = scene.material[0].model_copy(update={"name": "rock", "top": [(0.0, 2.1)]})
    grid = build_grid(scene.model_copy(update={"material": [*scene.material, rock]}))
    assert not grid.triangular.any()
    assert np.any(np.isclose(grid.xy[:, 1], 2.1))
    assert areas(grid.xy, grid.zones)[grid.material == 1].sum() == pytest.approx(2.1 * 35.0)


@pytest.mark.parametrize(("profile", "words"), [
    ([(0, 5), (10, 5), (20, 15), (30, 5), (35, 5)], "top of the ground is a point"),
    ([(0, 15), (10, 5), (20, 15), (35, 15)], "rises, stays level and falls"),
    ([(0, 5), (10, 5), (90, 15), (100, 15)], "lean too much"),
    ([(0, 5), (10, 5), (8, 15), (35, 15)], "overhangs"),
    ([(0, 0), (10, 0), (20, 15), (35, 15)], "at least|between one zone"),
])  # fmt: skip
def test_ground_that_cannot_be_meshed(profile, words):
    with pytest.raises(ValueError, match=words):
        mesh(profile)
