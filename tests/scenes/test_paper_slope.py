"""configs/paper_slope.toml up to the coupled state and the first steps of the overload."""

import numpy as np
import pytest
import shapely

from colluvium import open_run
from tests.commands import run_colluvium


@pytest.fixture(scope="module")
def run(tmp_path_factory, configs):
    out = tmp_path_factory.mktemp("paper")
    words = ["run", configs / "paper_slope.toml", "--out", out, "--force", "--quiet", "--set", "stage.overload.until.steps=1500"]
    done = run_colluvium(*words, "--in-process")
    assert done.returncode == 0, done.stderr
    with open_run(out) as found:
        yield found


def test_mesh_is_the_papers(run):
    corners = run.zones(0).corners
    triangles = corners[:, 2] == corners[:, 3]
    assert (~triangles).sum() == 1596
    assert triangles.sum() == 24
    window = run.info["windows"][0]
    assert window["control_nodes"] == 46
    assert window["control_discs"] == 276
    assert len(run.zones(-1).corners) == 1596 + 24 - 6 * 17


def test_the_band_of_the_grid_alone_crosses_the_window(run):
    """Where a trial implementation had it: its middle within a zone, in at y 8.5, out between 10.2 and 10.6 on the right."""
    found = run.info["locate"]
    reference = shapely.points([(5.8, 5.2), (7.8, 6.2), (9.8, 7.5), (11.8, 9.2), (12.8, 10.5), (13.8, 11.2)])
    assert shapely.distance(shapely.LineString(found["line"]), reference).max() < 0.36
    window = found["windows"][0]
    assert window["crosses"]
    assert window["level_around"] < 0.1 * found["level"]
    assert window["enters"] == pytest.approx([11.0, 8.5], abs=0.2)
    assert window["leaves"] == pytest.approx([13.0, 10.4], abs=0.2)


def test_both_codes_are_at_rest_when_coupled(run):
    couple = next(row for row in run.info["stages"] if row["name"] == "couple")
    assert couple["ratio_continuum"] <= 1e-5
    assert max(couple["ratio_discrete"]) <= 1e-5
    assert sum(couple["bonds_broken"]) < 60
    assert max(couple["traction_difference"]) < 0.2


def test_packing_is_dense_and_carries_the_slopes_stress(run):
    window = run.info["windows"][0]
    assert 3000 < window["discs"] < 3600
    assert 0.15 < window["porosity"] < 0.162
    assert window["error_yy"] < 0.05  # over circles of .25 m, stones by their means
    assert window["projected"] < 0.05  # share of the slope's stress beyond the estimated strength of the bonded discs
    assert window["sine_discs"] > 0.95 * window["sine_zones"]


def test_stones_are_there_rigid_and_weigh_what_they_should(run):
    window = run.info["windows"][0]
    assert window["stone_content"] == pytest.approx(0.45, rel=1e-12)
    assert window["stone_content_discs"] == pytest.approx(0.45, abs=0.03)
    assert window["stones"] == len(run.stones()) > 60
    first, last = run.discs(run.last_frame("fill")), run.discs(-1)
    assert set(last.material) == {0, 1, 2}
    assert ((last.stone >= 0) == (last.material == 2)).all()
    for k in range(window["stones"]):
        own = last.stone == k
        start, now = first.xy[own], last.xy[own]
        apart = [np.hypot(*(xy - xy[:1]).T) for xy in (start, now)]
        np.testing.assert_allclose(*apart, atol=1e-13)
    kinds = [run.fabric(-1, kind=kind).contacts for kind in ("soil-soil", "soil-stone")]
    assert sum(kinds) <= run.fabric(-1).contacts < 1.1 * sum(kinds)


def test_gravity_grows_and_the_window_follows(run):
    overload = next(row for row in run.info["stages"] if row["name"] == "overload")
    assert overload["gravity_factor"] == pytest.approx(1.0 + 11.0 * 1500 / 40000)
    last = run.discs(-1)
    assert np.isfinite(last.xy).all()
    assert last.displacement[:, 1].min() < 0.0
