"""Guards: blow-up found by energy, doubts about a scene, rules between laws, stages and time."""

import copy
import json
import tomllib

import numpy as np
import pytest
from grid_cases import ELASTIC, TENSION, MohrCoulomb, material, slope

from colluvium import open_run
from coupler_protocol.problems import SceneError
from coupler_protocol.scene.reader import build_scene, read_scene
from coupler_protocol.scene.rules.between_tables import doubts
from fdm_server.effects.damping import Damping
from fdm_server.effects.elastic import poisson_ratio
from fdm_server.mesh.grid import build_grid
from fdm_server.model import build_model, new_state
from fdm_server.observe.energy_growth import EnergyWatch
from fdm_server.step import clock
from fdm_server.step.gridpoint_pass import update_velocities
from fdm_server.step.present_shape import begin_large_strain
from fdm_server.step.safety import Unstable
from fdm_server.step.zone_pass import advance
from tests.commands import run_colluvium

BENCH = [(0, 4), (4, 4), (12, 12), (20, 12)]


def watched(model, state, gravity, steps, every=10, change=None):
    """Take steps with a look every so many; change(n) after each of them."""
    watch = EnergyWatch(model, state, gravity)
    for n in range(steps):
        update_velocities(model, state, gravity)
        if n % every == 0:
            watch.check(model, state, gravity)
        advance(model, state)
        if change:
            change(n)


def soil_slope(damping=0.8, zone_size=1.0, **laws):
    scene = slope(zone_size, BENCH, materials=[material(**laws)])
    scene.damping = Damping(local=damping)
    model = build_model(scene, build_grid(scene))
    return model, new_state(model)


@pytest.mark.parametrize("lighter", [0.13, 0.1])
@pytest.mark.parametrize("damping", [0.0, 0.8])
def test_masses_too_light_are_noticed_long_before_numbers_overflow(lighter, damping):
    """The step of 1 is too long for them; velocities grow by up to three times a step, looks are ten steps apart."""
    model, state = soil_slope(damping, mohr_coulomb=None, tension=None)
    model.mass[:] *= lighter
    with pytest.raises(Unstable, match=r"grows by itself\. The fastest gridpoint is at \(.*\), in zone \d+"):
        watched(model, state, 9.81, 3000)
    assert np.abs(state.displacement).max() < 1e8


@pytest.mark.parametrize("damping", [0.0, 0.8])
def test_a_stiff_spring_on_a_gridpoint_is_noticed(damping):
    """What discs do where their added mass is missing."""
    model, state = soil_slope(damping)
    top = np.argmax(model.grid.xy[:, 1])

    def spring(_):
        state.applied[top] = -4.0 * model.mass[top] * state.displacement[top]

    with pytest.raises(Unstable, match="grows by itself"):
        watched(model, state, 9.81, 3000, change=spring)
    assert np.abs(state.displacement).max() < 1e3


@pytest.mark.parametrize("large", [False, True])
@pytest.mark.parametrize("damping", [0.0, 0.8])
def test_a_slope_that_fails_and_runs_away_is_not_taken_for_one(damping, large):
    """Mud without strength to speak of, 40 g: metres of motion, until zones are inverted."""
    model, state = soil_slope(damping, mohr_coulomb=MohrCoulomb(friction=2, cohesion=100), tension=TENSION)
    if large:
        begin_large_strain(model, state)
        with pytest.raises(Unstable, match="inverted"):
            watched(model, state, 400.0, 5000)
    else:
        watched(model, state, 400.0, 3000)
    assert np.abs(state.displacement).max() > 0.5


def test_vibration_in_real_time_is_not_taken_for_one():
    model, state = soil_slope(0.0, mohr_coulomb=None, tension=None)
    model = clock.begin(model, state, Damping(local=0.0), 1.0)
    watched(model, state, 9.81, 4000, every=7)


def test_sudden_loads_and_their_removal_are_not_taken_for_one():
    model, state = soil_slope(0.0)
    top = np.flatnonzero(model.grid.xy[:, 1] == 12.0)

    def load(n):
        state.applied[top, 1] = -1e5 if (n // 137) % 2 else 0.0

    watched(model, state, 0.0, 3000, change=load)


def test_driven_gridpoints_do_work():
    """A plate that is pushed steadily gives the energy, though nothing is applied."""
    model, state = soil_slope(0.0)
    top = np.flatnonzero(model.grid.xy[:, 1] == 12.0)
    model.fixed[top, 1] = True
    watch = EnergyWatch(model, state, 0.0)
    for n in range(2000):
        update_velocities(model, state, 0.0)
        state.velocity[top, 1] = -1e-4
        if n % 10 == 0:
            watch.check(model, state, 0.0)
        advance(model, state)
    assert watch.most > 1e4


# -- scenes --------------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def quick(configs):
    return tomllib.loads((configs / "quick_slope.toml").read_text(encoding="utf-8"))


@pytest.fixture
def alone(quick):
    """The quick slope without discs: equilibrium and overload."""
    data = copy.deepcopy(quick)
    del data["window"], data["discs"]
    data["stage"] = [stage for stage in data["stage"] if stage["name"] in ("equilibrium", "overload")]
    return data


def said(data):
    return " | ".join(what for _, what, _ in doubts(build_scene(data)))


def test_shipped_scenes_raise_no_doubts(configs):
    for path in configs.glob("*.toml"):
        assert doubts(read_scene(path)) == [], path


def test_doubts_name_the_case_and_the_remedy(alone):
    alone["material"][0]["elastic"] = {"bulk": 1e9, "shear": 1e6}
    (_, what, remedy) = doubts(build_scene(alone))[0]
    assert "0.4995" in what
    low, high = (float(text) for text in remedy.split("of ")[1].split(" Pa")[0].split(" .. "))
    for bulk, nu in ((low, 0.0), (high, 0.49)):
        assert poisson_ratio(ELASTIC.model_copy(update={"bulk": bulk, "shear": 1e6})) == pytest.approx(nu, abs=1e-4)


def test_overlapping_regions_are_said_to_overlap(alone):
    second = copy.deepcopy(alone["material"][0]) | {"name": "clay", "region": [[0, 0], [20, 0], [20, 2], [0, 2]]}
    third = copy.deepcopy(alone["material"][0]) | {"name": "sand", "region": [[5, 1], [9, 1], [9, 3], [5, 3]]}
    alone["material"] += [second, third]
    assert "'clay' and 'sand' overlap by 4 m2, where the later one, 'sand', applies" in said(alone)
    third["region"] = [[5, 2], [9, 2], [9, 3], [5, 3]]
    assert "overlap" not in said(alone)


def test_thin_zones_and_missing_supports_are_doubted(alone):
    alone["grid"] = {"kind": "box", "length": 12.0, "height": 1.0, "zone_size": [1.2, 0.1]}
    assert "120 times" not in said(alone)
    assert "100 zones are more than 5 times as long as wide" in said(alone)
    alone["boundary"] = [{"on": "left", "fix": "x"}]
    assert "the grid has no support" in said(alone)


def test_discs_larger_than_the_zones_of_a_rim_are_doubted(quick):
    """Largest diameter 2 R (1 + spread) against the shortest side of the rim: silent just below, named just above."""
    data = copy.deepcopy(quick)
    data["grid"] = {"kind": "box", "length": 30.0, "height": 20.0, "zone_size": [1.0, 0.5]}
    data["window"] = [{"name": "wide", "polygon": [[4.2, 3.0], [20.0, 5.0], [18.0, 16.0], [6.0, 15.0]]}]
    data["discs"] |= {"radius": 0.2, "spread": 0.2}
    assert "larger than" not in said(data)
    data["discs"]["radius"] = 0.22
    found = next((path, what, remedy) for path, what, remedy in doubts(build_scene(data)) if "larger than" in what)
    assert found[0] == ("window", 0)
    assert "discs of up to 0.528 m are larger than zones on the rim of 'wide': one side of it, at (" in found[1]
    assert "is 0.5 m long" in found[1]
    assert "discs of at most 0.5 m" in found[2]


def test_rest_without_damping_is_doubted(alone):
    alone["damping"] = {"local": 0.0}
    assert "'equilibrium' waits for rest without damping" in said(alone)


def broken(data):
    with pytest.raises(SceneError) as caught:
        build_scene(data)
    return [(problem.key, problem.reason) for problem in caught.value.problems]


@pytest.mark.parametrize(
    ("softening", "without", "key"),
    [
        ({"strain": [0.1], "friction": [10.0]}, "", "dilation"),
        ({"strain": [0.1], "cohesion": [0.0]}, "mohr_coulomb", ""),
        ({"strain": [0.1], "tension": [0.0]}, "tension", "tension"),
    ],
)
def test_softening_that_does_not_fit_is_refused(alone, softening, without, key):
    soil = alone["material"][0]
    soil["softening"] = softening
    soil["mohr_coulomb"]["dilation"] = 12.0
    soil.pop(without, None)
    ((found, _),) = broken(alone)
    assert found == "material[0].softening" + (f".{key}" if key else "")


@pytest.mark.parametrize(
    ("stage", "key"),
    [
        ({"until": {"time": 1.0}}, "until.time"),
        ({"step_factor": 0.4}, "step_factor"),
        ({"damping": {"rayleigh": {"fraction": 0.05, "frequency": 2.0}}}, "damping"),
    ],
)
def test_seconds_belong_to_real_time(alone, stage, key):
    alone["stage"][1] |= stage
    ((found, _),) = broken(alone)
    assert found == f"stage[1].{key}"
    alone["stage"][1]["time"] = "real"
    build_scene(alone)


@pytest.mark.parametrize("damping", [{"local": 0.5, "combined": 0.5}, {"combined": 1.0}, {"rayleigh": {"fraction": 0.05}}])
def test_kinds_of_damping_exclude_each_other(alone, damping):
    alone["damping"] = damping
    broken(alone)


def test_a_stage_in_real_time_runs_to_its_second_and_says_so(alone, tmp_path):
    """Through the command: seconds in frames, histories and run.json; static steps count one each."""
    alone["stage"][0]["until"] = {"steps": 100}
    later = {"time": "real", "until": {"time": 0.05}, "damping": {"combined": 0.3}, "gravity_factor": 1.5}
    alone["stage"][1] = {"name": "overload"} | later
    alone["record"] = {"every": 40, "history": 10, "energy": True}
    path = tmp_path / "scene.json"
    path.write_text(json.dumps(alone), encoding="utf-8")
    done = run_colluvium("run", path, "--out", tmp_path / "out", "--in-process", "--quiet")
    assert done.returncode == 0, done.stderr
    about = json.loads((tmp_path / "out" / "run.json").read_text(encoding="utf-8"))
    stage = about["stages"][1]
    dt = stage["seconds_simulated"] / stage["steps"]
    assert stage["seconds_simulated"] == pytest.approx(0.05, abs=dt)
    assert dt == pytest.approx(0.5 * (2 / 3) / 2**1.5 / 509.2, rel=1e-4)
    with open_run(tmp_path / "out") as run:
        steps, seconds = run.history("time")
        assert seconds[0] == pytest.approx(100 + dt * (steps[0] - 100), rel=1e-12)
        assert np.diff(seconds) == pytest.approx(10 * dt, rel=1e-9)
        assert run.frames[-1].time == pytest.approx(100.0 + stage["seconds_simulated"], rel=1e-12)
        steps, error = run.history("energy_error")
        work = run.history("energy_gravity")[1]
    assert steps[0] == 0
    assert np.abs(error).max() < 1e-9 * np.abs(work).max()


def test_the_ledger_may_be_asked_for_in_small_and_in_large_strain(alone):
    alone["record"]["energy"] = True
    build_scene(alone)
    alone["grid"]["large_strain"] = True
    build_scene(alone)
