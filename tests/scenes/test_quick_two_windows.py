"""configs/quick_two_windows.toml, two windows with their own discs and stones in one slope: what it must give."""

import numpy as np
import pytest
import shapely

from colluvium import open_run
from colluvium.results.window_fields import bins, mean_stress, outline_of
from tests.commands import run_colluvium
from tests.scenes.continuity import discs_that_move_with_gridpoints


@pytest.fixture(scope="module")
def run(tmp_path_factory, configs):
    out = tmp_path_factory.mktemp("windows") / "run"
    done = run_colluvium("run", configs / "quick_two_windows.toml", "--out", out, "--in-process", "--quiet")
    assert done.returncode == 0, done.stderr
    with open_run(out) as found:
        yield found


def test_both_windows_come_to_rest_with_the_grid(run):
    couple, overload = (row for row in run.info["stages"] if row["name"] in ("couple", "overload"))
    for row in (couple, overload):
        assert row["ended_by"].startswith("ratio"), row["name"]
        assert max(row["ratio_continuum"], *row["ratio_discrete"]) <= 1e-4
    assert len(couple["ratio_discrete"]) == 2
    assert max(couple["traction_difference"]) < 0.2


def test_each_window_has_its_own_discs_and_stones(run):
    slope, toe = run.info["windows"]
    assert [run.name_of(rank) for rank in run.windows] == ["slope", "toe"]
    means = [run.discs(-1, rank).radius[run.discs(-1, rank).control == 0].mean() for rank in run.windows]
    np.testing.assert_allclose(means, [0.065, 0.05], rtol=0.05)
    assert "stone_content" not in slope
    assert toe["stone_content"] == pytest.approx(0.25, rel=1e-12)
    assert ["bond_state" in run.contacts(-1, rank) for rank in run.windows] == [True, False]


@pytest.mark.parametrize("rank", [1, 2])
def test_the_discs_carry_the_weight_above_them(run, rank):
    """Mean vertical stress of the bins of a window against that of the zones that were there, within 5 %."""
    frame = run.last_frame("couple")
    grid = bins(run, frame, rank)
    before = run.zones(run.last_frame("equilibrium"))
    inside = shapely.contains_xy(shapely.Polygon(outline_of(run, frame, rank)), *before.xy.T)
    assert inside.sum() == {1: 18, 2: 15}[rank]
    found = mean_stress(run, frame, grid, rank)[:, 1]
    weight = np.where(grid.used, grid.area, 0.0)
    assert np.nansum(found * weight) / weight.sum() == pytest.approx(before.stress[inside, 1].mean(), rel=0.05)


def test_displacement_is_continuous_across_both_rims(run):
    """A control disc on a gridpoint moves with it: 18 at the slope's window, 16 at the toe's."""
    assert [discs_that_move_with_gridpoints(run, rank) for rank in run.windows] == [18, 16]
