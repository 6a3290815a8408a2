"""The mesh: counts of the paper's slope, geometry, materials, and what is refused."""

import numpy as np
import pytest
from grid_cases import material, slope

from fdm_server.mesh.grid import areas, build_grid, centroids


@pytest.fixture(scope="module")
def paper():
    return build_grid(slope())


def test_paper_slope_has_1596_quads_and_24_triangles(paper):
    assert len(paper.zones) == 1620
    assert paper.triangular.sum() == 24
    assert (paper.column.max(), paper.row.max()) == (59, 35)


def test_zones_run_counter_clockwise_and_fill_the_slope(paper):
    area = areas(paper.xy, paper.zones)
    assert area.min() > 0
    assert area.sum() == pytest.approx(20 * 12 - 8 * 8 / 2 - 8 * 11 / 3, rel=1e-12)
    assert np.array_equal(np.unique(paper.zones), np.arange(len(paper.xy)))


def test_face_lies_on_the_profile(paper):
    ends = paper.xy[paper.zones[paper.triangular]]
    assert np.allclose(ends[:, 2, 1] - ends[:, 0, 1], ends[:, 2, 0] - ends[:, 0, 0])  # 45 degrees
    assert ends[:, :, 1].min() == pytest.approx(4.0)
    assert ends[:, :, 1].max() == pytest.approx(12.0)


@pytest.mark.parametrize(
    ("profile", "quads", "triangles"),
    [
        ([(0, 4), (2, 4), (4, 2), (6, 2)], 17, 2),
        ([(0, 2), (2, 2), (2, 4), (6, 4)], 20, 0),
        ([(0, 1), (3, 4), (6, 1)], 12, 6),
    ],
)
def test_faces_down_upright_and_roofs(profile, quads, triangles):
    grid = build_grid(slope(1.0, profile, length=6.0, height=4.0))
    assert ((~grid.triangular).sum(), grid.triangular.sum()) == (quads, triangles)
    assert areas(grid.xy, grid.zones).min() > 0


def test_zone_sizes_may_differ_in_x_and_y():
    grid = build_grid(slope([2.0, 1.0], [(0, 1), (2, 1), (6, 3), (8, 3)], length=8.0, height=3.0))
    assert grid.triangular.sum() == 2
    assert areas(grid.xy, grid.zones).sum() == pytest.approx(8 + 4 + 4)


def test_a_face_off_the_diagonals_is_refused_with_a_size_that_fits():
    profile = [(0, 4), (4, 4), (12, 8), (20, 8)]
    with pytest.raises(ValueError, match=r"neither sides nor diagonals.*for example \[2, 1\]") as refused:
        build_grid(slope(2.0, profile, height=8.0))
    assert "dy/dx = 0.5" in str(refused.value)
    assert build_grid(slope([2.0, 1.0], profile, height=8.0)).triangular.sum() == 4


@pytest.mark.parametrize(
    ("scene", "words"),
    [
        (slope(0.3), "not a whole multiple of the zone size"),
        (slope(1.0, [(0, 4), (8, 12), (19, 12)]), "must run from x = 0"),
        (slope(1.0, [(0, 4), (8, 12), (6, 12), (20, 12)]), "overhangs"),
        (slope(1.0, [(0, 0), (12, 12), (20, 12)]), "at least|between one zone"),
        (
            slope(
                1.0,
                materials=[material(region=[(0, 0), (5, 0), (5, 5), (0, 5)])],
                profile=[(0, 12), (20, 12)],
            ),
            "no material",
        ),
    ],
)
def test_what_cannot_be_meshed_is_refused(scene, words):
    with pytest.raises(ValueError, match=words):
        build_grid(scene)


def test_last_material_whose_region_holds_the_centre_wins():
    layer = material("rock", region=[(0, 0), (20, 0), (20, 3), (0, 3)])
    lens = material("lens", region=[(5, 1), (8, 1), (8, 2), (5, 2)])
    grid = build_grid(slope(1.0, [(0, 12), (20, 12)], materials=[material(), layer, lens]))
    x, y = centroids(grid.xy, grid.zones).T
    expected = np.where(y > 3, 0, np.where((x > 5) & (x < 8) & (y > 1) & (y < 2), 2, 1))
    assert np.array_equal(grid.material, expected)
