"""Coupled stages in real time: one step for both sides, the same bits in one process, in two and after a restart."""

import copy
import tomllib

import numpy as np
import pytest

import colluvium
from coupler_protocol.exits import PhysicsFailed
from coupler_protocol.problems import SceneError
from coupler_protocol.scene.reader import build_scene
from tests.commands import run_colluvium
from tests.integration.short_runs import watched
from tests.same_bits import differing

SIDES = ("fdm.rank0", "dem.rank1")
REAL = ("sway", "go on")


@pytest.fixture(scope="module")
def tables(configs):
    """The quick scene: coupled in static mode, 1.2 g at once in real time, twice with other steps, and to rest again."""
    data = tomllib.loads((configs / "quick_slope.toml").read_text())
    data["record"] = {"every": 50, "history": 10, "energy": True}
    data["stage"][0]["until"] = {"steps": 400}
    data["stage"][2] |= {"handover": 100, "until": {"steps": 200}}
    undamped = {"kind": "overload", "time": "real", "damping": {"local": 0.0}}
    data["stage"][3:] = [
        {"name": "sway", "gravity_factor": 1.2, "until": {"steps": 150}} | undamped,
        {"name": "go on", "step_factor": 0.025, "until": {"time": 2e-3}} | undamped,
        {"name": "rest", "kind": "overload", "until": {"steps": 100}},
    ]
    return data


@pytest.fixture(scope="module")
def straight(tables, tmp_path_factory):
    """That scene in one process."""
    with colluvium.run(colluvium.Scene(**tables), tmp_path_factory.mktemp("real") / "run") as run:
        yield run


def steps_of(run, rank):
    """Steps between points of the histories of a side [s] in the stages in real time."""
    steps, time = run.history("time", rank)
    return np.diff(time) / np.diff(steps)


def test_both_sides_take_the_same_steps(straight):
    """Each stage has one step: of .05 of the discs' stable one (discs.time_step), then of the .025 that the stage says."""
    grid, discs = steps_of(straight, 0), steps_of(straight, 1)
    np.testing.assert_array_equal(straight.history("time", 0)[1], straight.history("time", 1)[1])
    first = grid[:10]
    np.testing.assert_allclose(first, first[0], rtol=1e-7)  # differences of times after 600 static steps
    np.testing.assert_allclose(discs[-9:], 0.5 * first[0], rtol=0.05)
    rows = {row["name"]: row for row in straight.info["stages"]}
    assert rows["sway"]["seconds_simulated"] == pytest.approx(150 * first[0], rel=1e-7)
    assert rows["go on"]["seconds_simulated"] == pytest.approx(2e-3, abs=first[0])
    assert rows["rest"]["seconds_simulated"] is None


def test_the_grid_keeps_its_energy_in_real_time(straight):
    """Masses do not change and nothing damps: work of weight, rim and plasticity against kinetic and strain energy.

    Each stage has a ledger of its own; the second one begins in motion, with other steps.
    """
    steps, error = straight.history("energy_error", 0)
    real = (steps > 600) & (steps < straight.history("time", 0)[0][-1])
    scale = straight.history("energy_kinetic", 0)[1][real].max()
    assert scale > 1e-3
    assert np.abs(error[real]).max() < 1e-8 * scale
    assert np.abs(straight.history("energy_damping", 0)[1][real]).max() < 1e-12 * scale


def test_velocities_begin_at_rest_and_discs_move_with_the_rim(straight):
    """1.2 g at once: after a step everything has moved downwards, nothing faster than .2 g t and what is set free."""
    rows = straight.frames
    frame = next(i for i, found in enumerate(rows) if found.stage == "sway")
    v = straight.discs(frame).velocity
    assert np.hypot(*v.T).max() < 0.5
    assert v[:, 1].mean() < 0.0


def test_two_processes_give_the_bits_of_one(straight, scene_file, tmp_path):
    done = run_colluvium("run", scene_file, "--out", tmp_path / "two", "--quiet")
    assert done.returncode == 0, done.stderr
    for side in SIDES:
        for stage in (*REAL, "rest"):
            assert differing(straight.folders[0] / f"{side}.{stage}.h5", tmp_path / "two" / f"{side}.{stage}.h5") == []


@pytest.mark.parametrize("stage", ["couple", "sway", "go on"])
def test_a_restart_gives_the_bits_of_the_straight_run(straight, scene_file, tmp_path, stage):
    """Into real time, from one step to another, and out of it."""
    options = ["--out", tmp_path / "run", "--from", f"{straight.folders[0]}@{stage}", "--in-process", "--quiet"]
    done = run_colluvium("run", scene_file, *options)
    assert done.returncode == 0, done.stderr
    for side in SIDES:
        assert differing(straight.folders[0] / f"{side}.rest.h5", tmp_path / "run" / f"{side}.rest.h5") == []


def test_a_disc_too_fast_for_the_agreed_step_ends_the_run(tables, tmp_path):
    data = copy.deepcopy(tables)
    data["stage"][3:] = [data["stage"][3] | {"gravity_factor": 1e7}]
    with pytest.raises(PhysicsFailed, match=r"tenth of the smallest radius|smaller step_factor"):
        colluvium.run(colluvium.Scene(**data), tmp_path / "run")


def test_what_a_real_time_stage_must_say_is_said_at_once(tables):
    data = copy.deepcopy(tables)
    data["stage"][5] |= {"until": {"time": 1.0}, "step_factor": 0.5}
    with pytest.raises(SceneError) as caught:
        build_scene(data)
    assert {problem.key for problem in caught.value.problems} == {"stage[5].until.time", "stage[5].step_factor"}


@pytest.fixture(scope="module")
def divided(straight, tables, tmp_path_factory):
    """Eight steps of the discs in each of the grid's, for as long a time."""
    data = copy.deepcopy(tables) | {"coupling": {"substeps": 8}}
    data["stage"][3]["until"] = {"time": straight.info["stages"][3]["seconds_simulated"]}
    with colluvium.run(colluvium.Scene(**data), tmp_path_factory.mktemp("divided") / "run") as run:
        yield run


def test_sub_steps_make_steps_of_the_grid_longer_and_change_little(straight, divided):
    """The discs' share of .05 becomes .4 of their stable step. The sway ends within such a step of the same time."""
    one, eight = ({row["name"]: row for row in run.info["stages"]}["sway"] for run in (straight, divided))
    assert eight["time_step"] == pytest.approx(8.0 * one["time_step"], rel=0.05)
    assert 0.0 <= eight["seconds_simulated"] - one["seconds_simulated"] < eight["time_step"]
    last = [run.last_frame("sway") for run in (straight, divided)]
    moved = [run.gridpoints(frame).displacement for run, frame in zip((straight, divided), last, strict=True)]
    assert 0.0 < np.abs(moved[1] - moved[0]).max() < 0.01 * np.abs(moved[0]).max()


def test_both_sides_see_the_same_power_in_sub_steps_too(divided):
    """Of the forces that were said in the velocities that followed, which the first sub-step has on the discs' side."""
    assert watched(divided.info) == []
    (steps, grid), (theirs, discs) = (divided.history("interface_power", rank) for rank in (0, 1))
    np.testing.assert_array_equal(steps, theirs)
    assert np.abs(grid - discs).max() < 1e-12 * np.abs(grid).max()


@pytest.mark.long
def test_sub_steps_have_the_same_bits_in_two_processes_and_after_a_restart(divided, tmp_path):
    scene = tmp_path / "scene.json"
    scene.write_text((divided.folders[0] / "scene.json").read_text())
    for out, how in ((tmp_path / "two", ()), (tmp_path / "again", ("--from", f"{divided.folders[0]}@sway", "--in-process"))):
        done = run_colluvium("run", scene, "--out", out, *how, "--quiet")
        assert done.returncode == 0, done.stderr
        for side in SIDES:
            assert differing(divided.folders[0] / f"{side}.rest.h5", out / f"{side}.rest.h5") == []


def test_sub_steps_need_a_coupled_stage_in_real_time(tables):
    data = copy.deepcopy(tables) | {"coupling": {"substeps": 8}}
    build_scene(data)
    data["stage"] = data["stage"][:3]
    with pytest.raises(SceneError) as caught:
        build_scene(data)
    assert [problem.key for problem in caught.value.problems] == ["coupling.substeps"]
