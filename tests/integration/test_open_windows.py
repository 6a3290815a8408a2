"""Windows at the ground surface: at rest with the stress of the zones, the same bits after a kill and in two processes."""

import numpy as np
import pytest

from colluvium import open_run, resume
from colluvium.forecast import check
from colluvium.results.window_fields import outline_of
from colluvium.running import processes, threads
from coupler_protocol.exits import PHYSICS, RunEnded
from coupler_protocol.files import checkpoint
from coupler_protocol.geometry import polygon_area
from coupler_protocol.problems import SceneError
from coupler_protocol.process.plugin import from_functions
from coupler_protocol.scene.reader import build_scene, read_scene
from tests.integration.kills import goes_on, kill_at, killed_run
from tests.integration.same_runs import assert_same_runs

DENSITY, LENGTH, HEIGHT = 2000.0, 6.0, 3.5


def tables():
    """A box of ground under its weight; a window in the middle of its surface."""
    soil = {"density": 2000.0, "spring": {"normal": 5e7, "shear": 2e7}, "friction": {"coefficient": 0.55}}
    return {
        "format": 1,
        "seed": 1,
        "grid": {"kind": "box", "length": LENGTH, "height": HEIGHT, "zone_size": 0.5},
        "material": [{"name": "ground", "density": DENSITY, "elastic": {"bulk": 1e8, "shear": 5e7}}],
        "boundary": [{"on": "left", "fix": "x"}, {"on": "right", "fix": "x"}, {"on": "bottom", "fix": "xy"}],
        "damping": {"local": 0.8},
        "window": [{"name": "top", "polygon": [[2.0, 1.5], [4.0, 1.5], [4.0, 3.6], [2.0, 3.6]]}],
        "discs": {
            "radius": 0.085,
            "confinement": 2e4,
            "damping": {"local": 0.7},
            "soil": soil | {"bond": {"tension": 15e3, "shear": 35e3}},
        },
        "record": {"every": 500, "checkpoint_steps": 50, "checkpoint": 0.0},
        "stage": [
            {"name": "equilibrium", "gravity": 9.81, "until": {"ratio": 1e-5, "steps": 3000}},
            {"name": "fill"},
            {"name": "couple", "handover": 200, "until": {"ratio": 1e-4, "steps": 1500}},
        ],
    }


@pytest.fixture(scope="module")
def straight(tmp_path_factory):
    out = tmp_path_factory.mktemp("straight")
    threads.run(build_scene(tables()), out)
    return out


def test_grid_and_discs_rest_with_a_free_surface(straight):
    """The bottom carries the whole weight; the discs carry theirs within the granularity, and few of them rise or sink."""
    with open_run(straight) as run:
        couple, window = run.info["stages"][-1], run.info["windows"][0]
        assert couple["ended_by"].startswith("ratio")
        assert couple["reactions"]["bottom"]["y"] == pytest.approx(DENSITY * 9.81 * LENGTH * HEIGHT, rel=1e-3)
        assert window["control_nodes"] == 13
        assert window["error_yy"] < 0.15
        assert polygon_area(outline_of(run, len(run.frames) - 1)) == pytest.approx(4.0, rel=1e-3)
        discs = run.discs(-1)
        assert discs.xy[:, 1].max() < HEIGHT + 0.01
        assert np.abs(discs.displacement).max() < 0.02


def test_a_killed_run_goes_on_with_the_same_bits(tmp_path, straight):
    killed_run(build_scene(tables()), tmp_path / "run", kill_at(100))
    goes_on(build_scene(tables()), tmp_path / "run")
    assert_same_runs(straight, tmp_path / "run")


@pytest.mark.long
def test_two_processes_have_the_bits_of_one(tmp_path, straight):
    processes.run_scene(build_scene(tables()), tmp_path)
    assert_same_runs(straight, tmp_path)


PLACES = {
    "crest": [[9.9, 8.6], [13.4, 8.6], [13.4, 12.5], [11.2, 12.5], [9.9, 11.0]],
    "toe": [[2.0, 2.0], [5.4, 2.0], [5.4, 7.0], [4.0, 6.0], [2.0, 4.5]],
    "face": [[6.0, 4.6], [9.4, 4.6], [9.4, 11.0], [6.0, 8.0]],
}


@pytest.mark.long
@pytest.mark.parametrize("place", PLACES)
def test_a_slope_rests_with_a_window_where_its_surface_is_oblique(tmp_path, configs, place):
    """A surface with a corner, or at 45 degrees, whose ends stand at an angle to the rim: the bottom carries the same weight."""
    changes = ["discs.radius=0.1", "discs.soil.bond={tension=1e5,shear=1e5}", "stage.2.until={ratio=1e-4,steps=4000}"]
    changes.append(f"window.0={{name='w',polygon={PLACES[place]}}}")
    scene = read_scene(configs / "quick_slope.toml", changes)
    scene = scene.model_copy(update={"stage": scene.stage[:3]})
    threads.run(scene, tmp_path)
    with open_run(tmp_path) as run:
        alone, _, couple = run.info["stages"]
        assert couple["ended_by"].startswith("ratio")
        assert couple["bonds_broken"] == [0]
        assert couple["reactions"]["bottom"]["y"] == pytest.approx(alone["reactions"]["bottom"]["y"], rel=1e-3)
        assert np.abs(run.discs(-1).displacement).max() < 2e-3
        assert np.abs(run.gridpoints(-1).displacement).max() < 2e-3


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("polygon", [[2.0, 1.5], [2.4, 1.5], [2.4, 3.6], [3.6, 3.6], [3.6, 1.5], [4.0, 1.5], [4.0, 3.6], [2.0, 3.6]], "corner"),
        ("polygon", [[-1.0, 1.5], [3.0, 1.5], [3.0, 3.6], [-1.0, 3.6]], "touches the boundary"),
    ],
)
def test_other_windows_at_the_surface_are_refused_with_the_place(key, value, words):
    data = tables()
    data["window"][0][key] = value
    with pytest.raises(SceneError, match=words):
        build_scene(data)


def test_an_excavation_beside_the_window_leaves_a_zone():
    """Zones of its rim would lose their support."""
    data = tables()
    data["stage"].append(
        {"name": "dig", "kind": "excavate", "excavate": {"columns": [8, 9], "rows": [6, 6]}, "until": {"steps": 5}}
    )
    with pytest.raises(SceneError, match="'dig' touches a window"):
        build_scene(data)


@pytest.mark.parametrize(
    ("load", "words"),
    [
        ({"boundary": [{"on": "top", "x": [4.0, 5.0], "pressure": 1e4}]}, "at the end of the rim"),
        ({"boundary": [{"on": "top", "x": [0.5, 1.7], "shear": 1e3}]}, "at the end of the rim"),
        ({"kind": "surcharge", "surcharge": {"pressure": 1e4, "x": [4.0, 5.0]}}, "at the end of the rim"),
        ({"boundary": [{"on": "top", "x": [3.0, 5.0], "pressure": 1e4}]}, "open to its discs"),
    ],
    ids=["beside", "on a part of the zone beside", "surcharge", "on it"],
)
def test_loads_at_the_end_of_an_open_rim_are_refused(load, words):
    """The gridpoint there has the forces of the discs alone: it would carry no part of the load."""
    data = tables()
    data["stage"].append({"name": "load", "kind": "load", "until": {"steps": 5}} | load)
    with pytest.raises(SceneError, match=words) as found:
        build_scene(data)
    assert len(found.value.problems) == 1


@pytest.mark.long
def test_a_load_one_zone_beside_the_window_reaches_the_bottom(tmp_path):
    data = tables()
    load = {"on": "top", "x": [4.5, 5.5], "pressure": 1e4, "over": 100}
    data["stage"].append({"name": "load", "kind": "load", "boundary": [load], "until": {"ratio": 1e-4, "steps": 4000}})
    threads.run(build_scene(data), tmp_path)
    with open_run(tmp_path) as run:
        couple, loaded = run.info["stages"][-2:]
    assert loaded["ended_by"].startswith("ratio")
    more = loaded["reactions"]["bottom"]["y"] - couple["reactions"]["bottom"]["y"]
    assert more == pytest.approx(1e4, rel=2e-3)


@pytest.mark.parametrize(("gap", "refused"), [(0.0, True), (0.5, False)])
def test_windows_at_the_surface_leave_a_zone_between(gap, refused):
    data = tables()
    first = [[1.0, 1.5], [2.5, 1.5], [2.5, 3.6], [1.0, 3.6]]
    second = [[2.5 + gap, 1.5], [4.5, 1.5], [4.5, 3.6], [2.5 + gap, 3.6]]
    data["window"] = [{"name": "left", "polygon": first}, {"name": "right", "polygon": second}]
    if refused:
        with pytest.raises(SceneError, match=r"'right' touches window 'left' in 5 gridpoints.*\n.*leave at least one zone"):
            build_scene(data)
    else:
        build_scene(data)


def test_check_describes_a_window_at_the_surface(tmp_path):
    """Area, discs, stiffness beside that of the zones, and the doubt about one that is too soft."""
    found = check.describe(build_scene(tables()))
    (window,) = found["windows"]
    assert window["area"] == pytest.approx(4.0)
    assert window["segments"] == 12
    assert window["young"] < 0.5 * window["young_zones"]
    assert any("softer" in str(doubt) for doubt in found["doubts"])


@pytest.mark.long
def test_a_disc_that_leaves_over_the_surface_ends_the_run_and_the_last_good_state_goes_on(tmp_path, straight):
    """It flies over the end of the rim: no zone carries it there. Both sides say so and save; the stage before it is whole."""

    seen = []

    def throw(moment):
        if moment.rank == 1 and moment.stage == "couple":
            seen.append(moment.step)
            if len(seen) == 5:
                disc = moment.model.ring + int(moment.state.x[moment.model.ring :, 1].argmax())
                moment.state.x[disc] = [4.6, HEIGHT + 0.2]

    (tmp_path / "run").mkdir()
    with pytest.raises(RunEnded, match="crossed the ground surface beside the window, at") as caught:
        threads.run(build_scene(tables()), tmp_path / "run", plugin=from_functions(None, (20, throw)))
    assert caught.value.code == PHYSICS
    for side in ("fdm.rank0", "dem.rank1"):
        assert checkpoint.load(tmp_path / "run" / f"{side}.stopped.h5")
    resume(tmp_path / "run").close()
    assert_same_runs(straight, tmp_path / "run")
