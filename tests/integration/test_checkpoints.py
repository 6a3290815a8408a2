"""A run that is killed anywhere and started again with the same command has the bits of an undisturbed one."""

import pytest

from colluvium import Scene
from colluvium.running import threads
from coupler_protocol.exits import Interrupted, PeerLost
from coupler_protocol.files import checkpoint
from coupler_protocol.process.interrupt import StopRequest
from tests.integration.kills import ContinuumSide, DiscreteSide, DiscsAlone, Killed, goes_on, kill_at, kill_where, killed_run
from tests.integration.same_runs import assert_same_runs
from tests.integration.test_plain_steps import MEASURE, OTHER, SMALL, STONE, STONES
from tests.integration.test_plain_steps import scene as coupled_scene

SOFT = {"elastic": {"bulk": 2e7, "shear": 1e7}, "mohr_coulomb": {"cohesion": 4e3, "friction": 25.0, "dilation": 5.0}}
GROUND = {
    "format": 1,
    "seed": 1,
    "grid": {"kind": "box", "length": 6.0, "height": 3.0, "zone_size": 0.5},
    "material": [{"name": "clay", "density": 2000.0, **SOFT}],
    "boundary": [{"on": "left", "fix": "x"}, {"on": "right", "fix": "x"}, {"on": "bottom", "fix": "xy"}],
    "damping": {"local": 0.8},
}
EVERY = {"every": 40, "history": 10, "checkpoint_steps": 30, "checkpoint": 0.0}
PIT = {"columns": [4, 7], "rows": [5, 5], "over": 60, "ratio": 1e-3}
STRIP = {"x": [1.0, 2.0], "pressure": 4e3, "over": 50}
STAGES = [
    {"name": "rest", "kind": "equilibrium", "gravity": 9.81, "until": {"ratio": 1e-3, "steps": 130}},
    {"name": "try", "kind": "locate", "discard": True, "gravity_factor": {"to": 2.0, "over": 50}, "until": {"steps": 70}},
    {"name": "pit", "kind": "excavate", "excavate": PIT, "until": {"ratio": 1e-4, "steps": 170}},
    {
        "name": "strip",
        "kind": "surcharge",
        "surcharge": STRIP,
        "boundary": [{"on": "right", "velocity": {"x": -1e-5}, "over": 30}, {"on": "left", "pressure": 2e3, "over": 40}],
        "until": {"steps": 110},
    },
    {
        "name": "shake",
        "kind": "load",
        "time": "real",
        "damping": {"rayleigh": {"fraction": 0.05, "frequency": 10.0}},
        "boundary": [{"on": "bottom", "quiet": True}],
        "until": {"time": 0.2},
    },
]
GRIDS = {
    "small": {"stage": STAGES[:4], "record": EVERY | {"energy": True}},
    "real": {"stage": [*STAGES[:3], STAGES[4]], "record": EVERY},
    "large": {"stage": STAGES[:4], "record": EVERY, "grid": GROUND["grid"] | {"large_strain": True, "mixed": "nodal"}},
}


DISCS = {
    "format": 1,
    "seed": 2,
    "window": [{"name": "box", "polygon": [[0.0, 0.0], [2.0, 0.0], [2.0, 1.5], [0.0, 1.5]]}],
    "discs": {
        "radius": 0.08,
        "soil": {"density": 2000.0, "spring": {"normal": 5e7, "shear": 2e7}, "friction": {"coefficient": 0.5}},
        "damping": {"local": 0.5},
        "wall": [
            {"name": "floor", "ends": [[-0.5, 0.0], [2.5, 0.0]]},
            {"name": "left", "ends": [[0.0, 2.0], [0.0, -0.5]]},
            {"name": "right", "ends": [[2.0, -0.5], [2.0, 2.0]]},
        ],
    },
    "record": EVERY | {"measure": 25},
    "measure": [{"name": "corner", "centre": [0.6, 0.55], "radius": 0.5}],
    "stage": [
        {"name": "fill"},
        {"name": "settle", "kind": "discs", "gravity": 9.81, "until": {"ratio": 1e-6, "steps": 205}},
        {
            "name": "bond",
            "kind": "discs",
            "gravity_factor": {"to": 2.0, "over": 15},
            "discs": {"soil": {"friction": {"coefficient": 0.3}}},
            "until": {"steps": 90},
        },
        {"name": "fall", "kind": "discs", "time": "real", "until": {"time": 0.02}},
    ],
}
SQUEEZE = {"name": "right", "velocity": [-1e-6, 0.0]}
COUPLED = {
    "static": {"grid__large_strain": True, "stones": STONES, "discs__stone": STONE}
    | {
        "measure": MEASURE,
        "record__measure": 30,
    },
    "energies": {"record__energy": True},
    "real time": {
        "grid__large_strain": True,
        "stage__3__time": "real",
        "stage__3__damping": {"rayleigh": {"fraction": 0.05, "frequency": 20.0}},
        "coupling__substeps": 2,
    },
    "two windows, pauses": {
        "window": [{"name": "a", "polygon": SMALL}, {"name": "b", "polygon": OTHER}],
        "coupling__exchange_every": 4,
        "damping": {"combined": 0.8},
    },
}
LONG = [name for name in COUPLED if name not in ("static", "energies")]


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    """(scene, folder) of the undisturbed run of a scene; each is computed once."""
    found = {}

    def run(name, tables):
        if name not in found:
            found[name] = Scene(**tables), tmp_path_factory.mktemp(name)
            goes_on(*found[name])
        return found[name]

    return run


def coupled(name):
    """Tables of a coupled scene with checkpoints every few steps."""
    tables = coupled_scene(**COUPLED[name])
    tables["record"] |= {"checkpoint_steps": 25, "checkpoint": 0.0}
    return tables


@pytest.mark.parametrize("name", GRIDS)
@pytest.mark.parametrize("step", [95, 165, 262, 415])
def test_the_grid_alone_goes_on(tmp_path, undisturbed, name, step):
    scene, straight = undisturbed(name, GROUND | GRIDS[name])
    killed_run(scene, tmp_path / "run", kill_at(step))
    assert list((tmp_path / "run").glob("*@*.h5"))
    goes_on(scene, tmp_path / "run")
    assert_same_runs(straight, tmp_path / "run")


@pytest.mark.parametrize("step", [33, 120, 250])
def test_discs_alone_go_on(tmp_path, undisturbed, step):
    scene, straight = undisturbed("discs", DISCS)
    killed_run(scene, tmp_path / "run", kill_at(step, DiscsAlone))
    goes_on(scene, tmp_path / "run")
    assert_same_runs(straight, tmp_path / "run")


@pytest.mark.parametrize("killed", [ContinuumSide, DiscreteSide])
@pytest.mark.parametrize("step", [100, 205])
@pytest.mark.parametrize("name", ["static", "energies", *(pytest.param(name, marks=pytest.mark.long) for name in LONG)])
def test_a_coupled_run_goes_on(tmp_path, undisturbed, name, step, killed):
    scene, straight = undisturbed(name, coupled(name))
    killed_run(scene, tmp_path / "run", kill_at(step, killed))
    for side in ("fdm.rank0", "dem.rank1"):
        assert len(list((tmp_path / "run").glob(f"{side}.*@*.h5"))) in (1, 2)
    goes_on(scene, tmp_path / "run")
    assert_same_runs(straight, tmp_path / "run")


@pytest.mark.parametrize("killed", [ContinuumSide, DiscreteSide])
def test_the_newest_common_moment_counts_where_one_side_was_killed_before_its_write(tmp_path, undisturbed, killed):
    """The other side has a newer checkpoint, from which it must not continue."""
    scene, straight = undisturbed("static", coupled("static"))

    def second(side, *words):
        return words[1] == "inside of the stage" and side.steps > 180

    killed_run(scene, tmp_path / "run", kill_where(killed, "save", second))
    steps = {side: steps_of(tmp_path / "run", side) for side in ("fdm.rank0", "dem.rank1")}
    behind, ahead = sorted(steps.values(), key=max)
    assert max(behind) < max(ahead)
    assert max(behind) in ahead
    goes_on(scene, tmp_path / "run")
    assert_same_runs(straight, tmp_path / "run")


@pytest.mark.parametrize("name", ["fdm.rank0", "dem.rank1"])
def test_a_kill_in_the_middle_of_a_write_leaves_the_checkpoint_before_it(tmp_path, undisturbed, monkeypatch, name):
    scene, straight = undisturbed("static", coupled("static"))
    replace = checkpoint.os.replace

    def killing(partial, path):
        if path.name == f"{name}.more@195.h5":
            raise Killed
        replace(partial, path)

    with monkeypatch.context() as patch:
        patch.setattr(checkpoint.os, "replace", killing)
        killed_run(scene, tmp_path / "run", kill_at(100_000))
    assert (tmp_path / "run" / f"{name}.more@195.h5.partial").exists()
    assert max(steps_of(tmp_path / "run", name)) == 170
    goes_on(scene, tmp_path / "run")
    assert_same_runs(straight, tmp_path / "run")


@pytest.mark.parametrize("asked", [0, 1])
def test_a_request_to_stop_on_either_side_saves_both_and_loses_nothing(tmp_path, undisturbed, asked):
    """Each side has a request of its own, as on two machines."""
    scene, straight = undisturbed("static", coupled("static"))
    stops = {rank: StopRequest() for rank in (0, 1)}
    cls, seen = (ContinuumSide, DiscreteSide)[asked], []

    def stop_now(side, *words):
        if side.steps >= 207 and not seen:
            seen.append(side.steps)
            stops[asked].ask("enough")
        return False

    out = tmp_path / "run"
    out.mkdir()
    with kill_where(cls, "record", stop_now), pytest.raises((Interrupted, PeerLost), match="enough"):
        run_sides(scene, out, stops)
    steps = {name: max(steps_of(out, name)) for name in ("fdm.rank0", "dem.rank1")}
    assert len(set(steps.values())) == 1
    stretch = EVERY["history"]  # plain steps, if the cache has their loop, go on to the next point of the histories
    assert seen[0] <= steps["fdm.rank0"] <= seen[0] + stretch + 3
    assert not list(out.glob("*.stopped.h5")) or asked == 1
    goes_on(scene, out)
    assert_same_runs(straight, out)


def run_sides(scene, out, stops):
    """Computes a scene as colluvium.running.threads does, with a StopRequest for each rank."""
    real = threads.RunContext

    def context(folder, progress, stop, *more):
        return real(folder, progress, stops[progress.rank], *more)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(threads, "RunContext", context)
        threads.run(scene, out)


def test_a_run_that_was_killed_before_its_first_checkpoint_begins_again_and_keeps_its_files(tmp_path, undisturbed):
    scene, straight = undisturbed("static", coupled("static"))
    killed_run(scene, tmp_path / "run", kill_at(5))
    before = {path.name for path in (tmp_path / "run").iterdir()} - {"run.json.new"}  # room for run.json
    goes_on(scene, tmp_path / "run")
    assert before <= {path.name for path in (tmp_path / "run").iterdir()}
    assert (tmp_path / "run" / "fdm.rank0.part1.vtkhdf").exists()
    assert_same_runs(straight, tmp_path / "run")


def test_a_run_that_was_killed_at_its_end_writes_its_account(tmp_path, undisturbed):
    scene, straight = undisturbed("static", coupled("static"))
    killed_run(scene, tmp_path / "run", kill_where(ContinuumSide, "summary", lambda side: True))
    assert not (tmp_path / "run" / "run.json").exists()
    goes_on(scene, tmp_path / "run")
    assert_same_runs(straight, tmp_path / "run")


def steps_of(folder, side):
    """Steps of the checkpoints inside of stages of one side."""
    return [int(path.stem.rpartition("@")[2]) for path in folder.glob(f"{side}.*@*.h5")]
