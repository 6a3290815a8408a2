"""The status file of a process: where it is, how fast, for whom it waits, how it ended."""

import json
import time
from types import SimpleNamespace

import pytest

from coupler_protocol import exits
from coupler_protocol.files import status_file
from coupler_protocol.process import status
from coupler_protocol.process.progress import Progress
from coupler_protocol.wire.clocks import Waiting


def stage(name, steps=None, seconds=None):
    return SimpleNamespace(name=name, until=SimpleNamespace(steps=steps, time=seconds))


FILL = SimpleNamespace(name="fill", until=None)
SCENE = SimpleNamespace(title="Slope", digest=lambda: "hash", stage=[stage("rest", 400), FILL, stage("couple", 1000)])


@pytest.fixture
def clock(monkeypatch):
    """A clock that tests move."""
    now = SimpleNamespace(at=100.0)
    monkeypatch.setattr(status.time, "monotonic", lambda: now.at)
    return now


def at(steps, seconds=0.0):
    progress, side = Progress(1, "none"), SimpleNamespace(steps=steps, time=seconds)
    progress.follow(side)
    return progress, side


def test_speed_and_times_left_are_those_of_the_last_half_minute(clock):
    progress, side = at(0)
    told = status.Status(progress, SCENE)
    progress.begin(SCENE.stage[0], 0)
    first = told.now()
    assert (first["steps_per_second"], first["stage_seconds_left"], first["stages"]) == (None, None, 3)
    for steps in (1, 101, 201):  # slow, then 10 steps a second
        clock.at, side.steps = clock.at + (100.0 if steps == 1 else 10.0), steps
        found = told.now()
    assert (found["step"], found["stage_step"], found["stage_steps"], found["stage_number"]) == (201, 201, 400, 1)
    assert found["steps_per_second"] == pytest.approx(10.0)
    assert found["stage_seconds_left"] == pytest.approx(19.9)
    assert found["run_seconds_left"] == pytest.approx(119.9)


def test_a_stage_that_continues_counts_its_earlier_steps_and_seconds(clock):
    progress, side = at(900, 2.5)
    told = status.Status(progress, SimpleNamespace(**vars(SCENE) | {"stage": [stage("shake", seconds=2.0)]}))
    progress.begin(stage("shake", seconds=2.0), 800, past=0.5)
    told.now()
    clock.at, side.steps, side.time = clock.at + 10.0, 1000, 3.0
    found = told.now()
    assert (found["stage_step"], found["stage_steps"]) == (200, None)
    assert found["stage_seconds_left"] == pytest.approx(20.0)


def test_a_run_whose_later_stages_are_not_bounded_has_no_time_left(clock):
    progress, side = at(0)
    told = status.Status(progress, SimpleNamespace(**vars(SCENE) | {"stage": [stage("rest", 400), stage("open")]}))
    progress.begin(stage("rest", 400), 0)
    told.now()
    clock.at, side.steps = clock.at + 10.0, 100
    found = told.now()
    assert found["stage_seconds_left"] == pytest.approx(30.0)
    assert found["run_seconds_left"] is None


def test_only_a_long_wait_counts_as_waiting():
    progress, _ = at(5)
    told = status.Status(progress, SCENE)
    wait = Waiting("the continuum", "steps", "VELOCITY or STOP", time.time() - 0.5, "")
    progress.wait = lambda: wait
    assert (told.now()["state"], told.now()["waiting"]) == (status_file.RUNNING, None)
    progress.wait = lambda: wait._replace(since=time.time() - 60.0)
    found = told.now()
    assert found["state"] == status_file.WAITING
    assert found["waiting"]["peer"] == "the continuum"


@pytest.mark.parametrize(
    ("error", "state", "code"),
    [
        (None, status_file.FINISHED, 0),
        (exits.Interrupted("interrupted by SIGINT"), status_file.STOPPED, 130),
        (exits.PeerLost("silence"), status_file.FAILED, 5),
        (KeyError("rim"), status_file.FAILED, 7),
    ],
)
def test_the_last_status_says_how_the_process_ended(tmp_path, error, state, code):
    def work():
        with status.shown(tmp_path, "dem.rank1", Progress(1, "none"), SCENE):
            if error is not None:
                raise error

    if error is None:
        work()
    else:
        with pytest.raises(type(error)):
            work()
    found = status_file.in_folder(tmp_path)["dem.rank1"]
    assert (found["state"], found["exit_code"]) == (state, code)
    assert found["reason"] == (str(error) if error else "all stages done")
    assert [path.name for path in tmp_path.iterdir()] == ["dem.rank1.now.json"]


def test_a_status_is_written_also_while_the_process_does_nothing(tmp_path, monkeypatch):
    monkeypatch.setattr(status, "EVERY", 0.01)
    with status.shown(tmp_path, "dem.rank1", Progress(1, "none"), SCENE):
        begin = time.monotonic()
        seen = set()
        while len(seen) < 3 and time.monotonic() < begin + 30.0:
            seen |= {status_file.in_folder(tmp_path).get("dem.rank1", {}).get("written")} - {None}
    assert len(seen) >= 3


def test_a_folder_that_cannot_be_written_ends_no_run(tmp_path):
    with status.shown(tmp_path / "gone", "dem.rank1", Progress(1, "none"), SCENE):
        pass
    (tmp_path / "dem.rank1.now.json").write_text("{half", encoding="utf-8")
    assert status_file.in_folder(tmp_path) == {"dem.rank1": {}}
    (tmp_path / "dem.rank1.now.json").write_text(json.dumps([1]), encoding="utf-8")
    assert status_file.in_folder(tmp_path) == {"dem.rank1": {}}
