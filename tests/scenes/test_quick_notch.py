"""configs/quick_notch.toml, an L of discs along an oblique face: what it must give."""

import numpy as np
import pytest
import shapely

from colluvium import open_run
from colluvium.results.window_fields import bins, mean_stress, outline_of
from coupler_protocol.geometry import polygon_area
from tests.commands import run_colluvium
from tests.scenes.continuity import discs_that_move_with_gridpoints


@pytest.fixture(scope="module")
def run(tmp_path_factory, configs):
    out = tmp_path_factory.mktemp("notch") / "run"
    arguments = ["run", configs / "quick_notch.toml", "--out", out, "--in-process", "--quiet"]
    done = run_colluvium(*arguments)
    assert done.returncode == 0, done.stderr
    with open_run(out) as found:
        yield found


def test_the_window_is_the_zones_with_their_centre_in_the_polygon(run):
    window, coupled = run.info["windows"][0], run.last_frame("couple")
    assert len(run.zones(0).corners) - len(run.zones(coupled).corners) == 30
    assert window["control_nodes"] == 26
    area = polygon_area(outline_of(run, coupled))
    assert area == pytest.approx(15.7937, abs=1e-4)
    assert area == pytest.approx(shapely.Polygon(run.scene["window"][0]["polygon"]).area, rel=0.02)


def test_both_codes_come_to_rest_with_the_slopes_stress(run):
    couple, overload = (row for row in run.info["stages"] if row["name"] in ("couple", "overload"))
    assert couple["ratio_continuum"] <= 1e-5
    assert max(couple["ratio_discrete"]) <= 1e-5
    assert max(couple["traction_difference"]) < 0.12
    assert sum(couple["bonds_broken"]) < 20
    assert overload["ended_by"].startswith("ratio")
    window = run.info["windows"][0]
    assert window["error_yy"] < 0.06
    assert window["sine_discs"] > 0.95 * window["sine_zones"]  # without further rounds
    assert window["further_rounds"] == 0


def test_the_discs_carry_the_weight_above_them(run):
    """Mean vertical stress of the L's bins against that of the zones that were there, within 5 %."""
    frame = run.last_frame("couple")
    grid = bins(run, frame)
    before = run.zones(run.last_frame("equilibrium"))
    inside = shapely.contains_xy(shapely.Polygon(outline_of(run, frame)), *before.xy.T)
    assert inside.sum() == 30
    found = mean_stress(run, frame, grid)[:, 1]
    weight = np.where(grid.used, grid.area, 0.0)
    assert np.nansum(found * weight) / weight.sum() == pytest.approx(before.stress[inside, 1].mean(), rel=0.05)


def test_displacement_is_continuous_across_every_side_of_the_l(run):
    """A control disc on a gridpoint moves with it: 26 of them, on oblique and level sides."""
    assert discs_that_move_with_gridpoints(run) == 26
