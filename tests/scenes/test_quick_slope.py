"""configs/quick_slope.toml: what it must give."""

import json

import numpy as np
import pytest

from colluvium import open_run
from colluvium.results import failure
from tests.scenes.continuity import discs_that_move_with_gridpoints


@pytest.fixture(scope="module")
def run(quick_run):
    with open_run(quick_run[0]) as found:
        yield found


def stage(run, name):
    return next(row for row in run.info["stages"] if row["name"] == name)


def test_all_stages_end_as_they_should(run):
    assert run.info["exit_code"] == 0
    assert [row["name"] for row in run.info["stages"]] == ["equilibrium", "fill", "couple", "overload"]
    for name in ("equilibrium", "couple", "overload"):
        assert stage(run, name)["ended_by"].startswith("ratio"), name
    couple = stage(run, "couple")
    assert couple["ratio_continuum"] <= 1e-5
    assert max(couple["ratio_discrete"]) <= 1e-5
    assert stage(run, "overload")["gravity_factor"] == 3.0


def test_weight_of_the_slope_rests_on_its_bottom(run):
    """Under the crest, far from the face, the lowest zones carry rho g times the column above their middle, within 3 %."""
    zones = run.zones(run.last_frame("equilibrium"))
    lowest = (zones.xy[:, 1] < 0.67) & (zones.xy[:, 0] > 18.0)
    expected = -2700.0 * 9.81 * (12.0 - zones.xy[lowest, 1])
    np.testing.assert_allclose(zones.stress[lowest, 1], expected, rtol=0.03)


def test_discs_were_brought_to_the_stress_they_can_carry(run):
    window = run.info["windows"][0]
    assert window["error_yy"] < 0.08
    assert window["sine_discs"] > 0.9 * window["sine_zones"]  # 0.86 after the first twelve rounds
    assert window["rounds"] - window["further_rounds"] == 12 < window["rounds"]
    assert 0.15 < window["porosity"] < 0.165
    assert window["density_factor"] == pytest.approx(2700.0 / 2000.0 / (1.0 - window["porosity"]), rel=0.05)


def test_zones_next_to_the_window_keep_their_stress_when_it_is_coupled(run):
    before, after = (run.zones(run.last_frame(name)) for name in ("equilibrium", "couple"))
    near = np.abs(after.xy - [11.667, 7.667]).max(axis=1) < 3.5
    kept = np.array([np.argmin(np.hypot(*(before.xy - xy).T)) for xy in after.xy[near]])
    change = np.sqrt(np.mean((after.stress[near, 1] - before.stress[kept, 1]) ** 2))
    assert change < 0.1 * np.abs(before.stress[kept, 1]).mean()
    assert max(stage(run, "couple")["traction_difference"]) < 0.25
    assert sum(stage(run, "couple")["bonds_broken"]) < 30


def test_displacement_is_continuous_across_the_interface(run):
    """A control disc on a gridpoint moves with it, to round-off, through all coupled steps."""
    assert discs_that_move_with_gridpoints(run) == 20


def test_the_slope_has_not_failed_at_three_g(run):
    found = failure.levels(run)
    assert failure.failure(found) is None
    assert run.info["band"]["failed_at"] is None
    assert run.info["band"]["not_failed_at"] == 3.0
    assert 1e-5 < found[-1].through < failure.FAILED


def test_closing_table_and_resolved_scene(quick_run):
    out, done = quick_run
    for word in ("equilibrium", "couple", "overload", "P/l vs stress", "bonds broken", "discs", "exit code 0"):
        assert word in done.stdout
    scene = json.loads((out / "scene.json").read_text())
    assert scene["coupling"]["mapping"] == "work-consistent"


def test_progress_of_both_processes_was_shown(quick_run):
    assert "rank 0" in quick_run[1].stderr
    assert "rank 1" in quick_run[1].stderr
