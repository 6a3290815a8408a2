"""A point whose run fails, is stopped or is known, without computing one."""

import json

import pytest

from colluvium.ensemble import answer, cluster, plan, point, study
from colluvium.ensemble.scenes import Scenes
from colluvium.running import processes
from coupler_protocol import exits
from coupler_protocol.files import locks, run_json


@pytest.fixture
def sweep(tmp_path, configs):
    """A sweep of three seeds; the first one is where the others branch off."""
    points = plan.grid([], [1, 2, 3])
    return study.Sweep(points, Scenes(configs / "quick_slope.toml", ()).checked(points), ("max_displacement",), tmp_path)


def run_that_ends(monkeypatch, code, reason):
    """Puts a run that ends at once in place of the processes; returns the options of each call."""
    calls = []

    def run_files(scene_path, out, n_windows, options=(), picture=None, asked=None):
        calls.append(list(options))
        run_json.write(out, {"exit_code": code, "reason": reason, "stages": []})
        return code

    monkeypatch.setattr(processes, "run_files", run_files)
    return calls


def test_a_run_that_fails_is_tried_once_more_and_named(sweep, monkeypatch):
    calls = run_that_ends(monkeypatch, exits.PHYSICS, "NaN in stage overload")
    told = point.compute(sweep._jobs[0])
    assert len(calls) == 2
    assert (told["tries"], told["failed"], told["code"]) == (2, "NaN in stage overload", exits.PHYSICS)
    assert sweep.done_before() == {}  # the next sweep tries again
    point.compute(sweep._jobs[0])
    assert len(calls) == 4


def test_a_factor_needs_a_search_and_no_run(sweep, monkeypatch):
    """The factor of grid and discs where there are discs, with half its bracket."""
    runs, searches = run_that_ends(monkeypatch, exits.PHYSICS, ""), []

    def ended(scene, out, asked):
        searches.append(out)
        out.mkdir(parents=True, exist_ok=True)
        meshes = [{"value": 1.5, "low": 1.4, "high": 1.6, "zone_size": 1.0, "trials": []}]
        found = {"quantity": "factor of safety", "meshes": meshes, "coupled": {"value": 1.3, "low": 1.29, "high": 1.31}}
        run_json.write_json(out / "fos.json", found)
        return exits.DONE if len(searches) > 1 else exits.PEER

    monkeypatch.setattr(point.searches, "run", ended)
    told = point.compute(sweep._jobs[0]._replace(quantities=("fos",)))
    assert told["values"]["fos"] == pytest.approx([1.3, 0.01])
    assert (runs, told["failed"], told["tries"]) == ([], "", 2)
    assert searches == [sweep.folder(0) / "fos"] * 2


def test_a_stopped_sweep_ends_its_points(sweep, monkeypatch):
    run_that_ends(monkeypatch, exits.INTERRUPTED, "stopped")
    with pytest.raises(exits.Interrupted):
        point.compute(sweep._jobs[0])
    assert not (sweep.folder(0) / point.RESULT).exists()


def test_a_point_branches_off_only_a_run_that_has_saved_the_stage(sweep, monkeypatch):
    calls = run_that_ends(monkeypatch, exits.PHYSICS, "")
    job = sweep._jobs[1]._replace(origin=f"{sweep.folder(0)}@equilibrium")
    point.compute(job)
    assert calls[0] == ["--quiet", "--force"]
    sweep.folder(0).mkdir(parents=True, exist_ok=True)
    (sweep.folder(0) / "fdm.rank0.equilibrium.h5").touch()
    point.compute(job)
    assert calls[-1] == ["--quiet", "--force", f"--from={sweep.folder(0)}@equilibrium"]


def test_a_point_is_known_by_its_scene_and_its_quantities(sweep):
    digest, folder = sweep._digests[0], sweep.folder(0)
    folder.mkdir(parents=True)
    told = {"scene": digest, "values": {"max_displacement": [1.0, 0.0]}, "lacking": {}, "failed": ""}
    (folder / point.RESULT).write_text(json.dumps(told))
    assert sweep.done_before() == {0: told}
    assert point.finished(folder, "another", ("max_displacement",)) is None
    assert point.finished(folder, digest, ("max_displacement", "failure_gravity")) is None
    (folder / point.RESULT).write_text("{")
    assert sweep.done_before() == {}


def test_a_point_waits_for_processes_of_a_killed_worker(tmp_path):
    """They save their State and end: until then their lock is there."""
    waited = []
    with locks.held(tmp_path, ["fdm.rank0"]) as _:

        def sleep(seconds):
            waited.append(seconds)
            if len(waited) == 3:
                (tmp_path / "fdm.rank0.lock").unlink()

        point._wait_until_free(tmp_path, sleep)
    assert len(waited) == 3


def test_a_worker_of_another_version_computes_nothing(sweep):
    with pytest.raises(point.OtherVersionError, match=r"the sweep 9\.9: install the same"):
        point.compute(sweep._jobs[0]._replace(version="9.9"))


def test_workers_of_other_versions_are_named_before_anything_is_computed():
    class Client:
        def run(self, function, on_error):
            return {"tcp://10.0.0.2:4": function(), "tcp://10.0.0.3:4": "0.1.0", "tcp://10.0.0.4:4": ModuleNotFoundError("h5py")}

    with pytest.raises(exits.EnvironmentFailed, match=r"tcp://10\.0\.0\.3:4 has 0\.1\.0, tcp://10\.0\.0\.4:4 has Module"):
        cluster._refuse_other_versions(Client())


@pytest.mark.parametrize(("where", "words"), [("no/such/file", "there is no such file"), ("tcp://127.0.0.1:9", "no scheduler")])
def test_a_cluster_that_is_not_there_is_named(where, words, monkeypatch):
    monkeypatch.setattr(cluster, "ARRIVAL", 0.3)
    with pytest.raises(exits.EnvironmentFailed, match=words), cluster.client_of(where, 1):
        pass


def test_a_run_that_ends_after_the_slope_has_failed_has_its_failure_gravity(sweep, monkeypatch):
    """It is not tried again; how it ended is kept. Other quantities need the end of the run."""
    calls, job = run_that_ends(monkeypatch, exits.PHYSICS, "1 disc has left the ring"), sweep._jobs[0]
    monkeypatch.setattr(point, "_failure", lambda folder: (8.25, 0.05))
    with_hash(monkeypatch, sweep._digests[0])
    told = point.compute(job._replace(quantities=(point.FAILURE,)))
    assert len(calls) == 1
    assert (told["values"], told["failed"], told["ended"]) == ({point.FAILURE: [8.25, 0.05]}, "", "1 disc has left the ring")
    (found,) = [study.Found(sweep.points[0], sweep.folder(0), told)]
    assert "a run ended by a fault after the slope had failed" in answer.ended_early([found])[0]
    both = point.compute(job._replace(quantities=(point.FAILURE, "max_displacement")))
    assert both["failed"] == "1 disc has left the ring"
    assert both["tries"] == 2


def test_a_run_that_ends_before_the_slope_has_failed_has_no_failure_gravity(sweep, monkeypatch):
    calls, job = run_that_ends(monkeypatch, exits.PHYSICS, "1 disc has left the ring"), sweep._jobs[0]
    with_hash(monkeypatch, sweep._digests[0])

    def none(folder):
        raise LookupError("not failed up to 5 g")

    monkeypatch.setattr(point, "_failure", none)
    told = point.compute(job._replace(quantities=(point.FAILURE,)))
    assert len(calls) == 2
    assert (told["values"], told["failed"]) == ({}, "1 disc has left the ring")


def with_hash(monkeypatch, digest):
    """run.json of the runs above says that they are of this scene."""
    read = run_json.read
    monkeypatch.setattr(run_json, "read", lambda path: read(path) | {"scene_hash": digest})
