"""The watch of coupled stages: each fault by its name, in time and with both States saved; what only fails or bursts passes."""

import copy
import json
import tomllib

import h5py
import numpy as np
import pytest

import colluvium
from colluvium.running import threads
from coupler_protocol.exits import PHYSICS, PhysicsFailed
from coupler_protocol.files.restart import Origin
from coupler_protocol.process.plugin import from_functions
from dem_server.coupling.rim import Rim
from dem_server.effects.bond import BONDED, BROKEN_TENSION
from fdm_server.observe.energy_growth import EnergyWatch
from fdm_server.procedure import grid_side, restart
from tests.integration.short_runs import watched
from tests.window_scenes import RING, SECTOR, uniform


@pytest.fixture(scope="module")
def tables():
    """A curved window in stressed ground; after the discs have taken over, nothing happens by itself."""
    data = uniform(RING, SECTOR)
    data["record"] = {"every": 100_000, "history": 10}
    data["stage"].append({"name": "go", "kind": "overload", "until": {"steps": 600}})
    return data


def stopped(tables, out, on_step=lambda moment: None, origin=None):
    """The run of a scene that is spoilt, by on_step(moment) in its last stage or otherwise; it must end for physics.

    Returns its only warning, steps, and largest velocities by rank and step.
    """
    speeds = {0: {}, 1: {}}

    def seen(moment):
        state = moment.state
        speeds[moment.rank][moment.step] = float(np.abs(state.v if moment.rank else state.velocity).max())
        if moment.stage == "go":
            on_step(moment)

    out.mkdir(exist_ok=True)
    with pytest.raises(PhysicsFailed) as caught:
        threads.run(colluvium.Scene(**tables), out, origin=origin, plugin=from_functions(None, (1, seen)))
    info = json.loads((out / "run.json").read_text())
    assert info["exit_code"] == PHYSICS
    (warning,) = watched(info)
    assert warning["stage"] == "go"
    assert str(caught.value).startswith(f"{warning['name']}: ")
    for name in ("fdm.rank0", "dem.rank1"):
        with h5py.File(out / f"{name}.stopped.h5") as file:
            assert len(file)
    return warning, info["steps"], speeds


@pytest.fixture(scope="module")
def too_light(tables, tmp_path_factory):
    """Gridpoints lose nine tenths of their masses after the first step: the step of 1 is too long for them."""
    done = []

    def change(moment):
        if moment.rank == 0 and not done:
            done.append(moment.step)
            moment.model.mass[:] *= 0.1

    out = tmp_path_factory.mktemp("light") / "run"
    return out, stopped(tables, out, change)


def test_masses_too_light_stop_the_run_before_velocities_grow_tenfold(too_light):
    _, (warning, steps, speeds) = too_light
    assert warning["name"] == "growth"
    assert "window 'hole'" in warning["text"]
    assert 0 <= steps - warning["step"] <= 3
    at_warning, after = speeds[0][warning["step"]], [v for n, v in speeds[0].items() if n >= warning["step"]]
    assert max(after) < 10.0 * at_warning


def test_a_run_that_was_stopped_goes_on_from_the_last_stage_end(too_light):
    """Without what spoiled it."""
    with colluvium.resume(too_light[0]) as run:
        assert run.info["exit_code"] == 0
        assert watched(run.info) == []
        assert run.stages[-1] == "go"


def test_discs_that_tell_another_power_are_noticed(tables, too_light, tmp_path, monkeypatch):
    """The ring's velocities are half as large again as they should be."""
    real = Rim.power
    monkeypatch.setattr(Rim, "power", lambda rim, state: 1.5 * real(rim, state))
    warning, steps, _ = stopped(tables, tmp_path / "run", origin=Origin(too_light[0], "couple"))
    assert warning["name"] == "mismatch"
    assert steps - warning["step"] == 20  # two looks more


def test_motion_that_nobody_works_for_is_noticed(tables, too_light, tmp_path):
    """In real time, undamped, all velocities of the grid grow by a twentieth a step: waves go on as they would, but grow."""
    data = copy.deepcopy(tables)
    data["stage"][-1] |= {"time": "real", "damping": {"local": 0.0}}

    def change(moment):
        if moment.rank == 0:
            moment.state.velocity[:] *= 1.05

    warning, steps, speeds = stopped(data, tmp_path / "run", change, Origin(too_light[0], "couple"))
    assert warning["name"] == "drift"
    assert steps > warning["step"]
    assert max(speeds[0].values()) < 10.0 * speeds[0][warning["step"]]


def test_loads_that_a_function_adds_to_the_ring_are_no_mismatch(tables, too_light, tmp_path):
    """They do no work: the ring is moved by the grid."""

    def push(moment):
        if moment.rank == 1:
            moment.state.load[: moment.model.ring, 1] += 1e3

    out = tmp_path / "run"
    out.mkdir()
    threads.run(colluvium.Scene(**tables), out, origin=Origin(too_light[0], "couple"), plugin=from_functions(None, (1, push)))
    assert watched(json.loads((out / "run.json").read_text())) == []


@pytest.fixture(scope="module")
def violent(configs, tmp_path_factory):
    """The quick slope: all bonds break at once, in real time without damping; then it fails under 14 g."""
    data = tomllib.loads((configs / "quick_slope.toml").read_text())
    data["record"] = {"every": 200, "history": 10}
    data["stage"][3:] = [
        {"name": "burst", "kind": "overload", "time": "real", "damping": {"local": 0.0}, "until": {"steps": 1500}},
        {"name": "collapse", "kind": "overload", "gravity_factor": {"to": 14.0, "over": 300}, "until": {"steps": 2500}},
    ]
    broken = []

    def break_all(moment):
        if moment.rank == 1 and moment.stage == "couple":
            bonds = moment.state.bond_state
            broken.append(int(np.sum(bonds == BONDED)))
            bonds[bonds == BONDED] = BROKEN_TENSION

    with colluvium.run(colluvium.Scene(**data), tmp_path_factory.mktemp("violent") / "run", on_stage=break_all) as run:
        yield run, broken


def test_a_burst_and_a_collapse_pass(violent):
    run, broken = violent
    assert broken[0] > 500
    assert run.info["exit_code"] == 0
    assert watched(run.info) == []
    _, kinetic = run.history("kinetic_energy", 1)
    assert kinetic[-1] > 1e4 * kinetic[kinetic > 0.0].min()
    assert np.abs(run.gridpoints(-1).displacement).max() > 0.5


def test_the_paper_mapping_passes_where_it_is_damped(tables, tmp_path):
    data = copy.deepcopy(tables) | {"coupling": {"mapping": "paper"}}
    with colluvium.run(colluvium.Scene(**data), tmp_path / "run") as run:
        assert watched(run.info) == []


def test_the_watch_begins_after_a_restart_as_in_the_straight_run(tables, tmp_path, monkeypatch):
    """With the forces of the discs on the rim, and with the warnings that there were."""
    begun = []

    class Seen(EnergyWatch):
        def __init__(self, model, state, gravity, rims=(), warn=None):
            super().__init__(model, state, gravity, rims, warn)
            begun.append((self.given, self.balance.before.copy()))

    monkeypatch.setattr(grid_side, "EnergyWatch", Seen)
    scene, again = colluvium.Scene(**tables), tmp_path / "again"
    noticed = [{"stage": "couple", "step": 1, "name": "drift", "text": "seen before the end of the stage"}]
    with monkeypatch.context() as patch:
        real = restart.save
        patch.setattr(restart, "save", lambda side, *rest: (setattr(side, "warnings", noticed), real(side, *rest))[1])
        colluvium.run(scene, tmp_path / "straight").close()
    straight = begun[-1]
    again.mkdir()
    threads.run(scene, again, origin=Origin(tmp_path / "straight", "couple"))
    assert begun[-1][0] == straight[0]
    np.testing.assert_array_equal(begun[-1][1], straight[1])
    assert watched(json.loads((again / "run.json").read_text())) == noticed
