"""`colluvium status`: running, waiting, finished, stopped and crashed processes, in the folder of either side."""

import json
import os
import time

import pytest

from colluvium import status
from coupler_protocol.exits import EnvironmentFailed
from coupler_protocol.files import locks, status_file
from tests.commands import run_colluvium

NOW = {
    "title": "Quick slope", "host": "office", "pid": 77, "rank": 1, "run": "3f2a9c1e77b0", "state": "running",
    "stage": "couple", "stage_number": 3, "stages": 4, "step": 1250, "stage_step": 850, "stage_steps": 6000, "ratio": 3.2e-3,
    "gravity_factor": 1.0, "doing": "", "steps_per_second": 50.0, "stage_seconds_left": 103.0, "run_seconds_left": 7200.0,
    "waiting": None,
}  # fmt: skip
WAIT = {"peer": "the continuum", "phase": "field", "message": "FIELD", "since": time.time() - 60.0, "word": "step 200"}


def written(folder, **more):
    status_file.write(folder, "dem.rank1", NOW | {"written": time.time()} | more)
    return "\n".join(status.lines(folder, status.of_folder(folder)))


def test_a_process_that_lives_says_where_it_is_how_fast_and_how_long(tmp_path):
    (tmp_path / "dem.rank1.fill.h5").touch()
    with locks.held(tmp_path, ["dem.rank1"]):
        before = sorted(os.listdir(tmp_path))
        text = written(tmp_path)
        assert sorted(os.listdir(tmp_path)) == sorted([*before, "dem.rank1.now.json"])
        assert not status.is_over(status.of_folder(tmp_path))
    assert text.splitlines() == [
        "run 3f2a9c1e77b0: Quick slope",
        "dem.rank1 on office: running",
        "    stage couple (3 of 4), step 1,250 of the run, 850 of at most 6,000 of the stage, ratio 3.20e-03, 1.00 g",
        "    50 steps/s; at this speed at most 2 min of the stage are left, of the run 2.0 h",
        "    last checkpoint dem.rank1.fill.h5, 0 s ago",
    ]


def test_a_process_that_waits_says_for_whom_since_when_and_what_it_last_heard(tmp_path):
    since = time.strftime("%H:%M:%S", time.localtime(WAIT["since"]))
    with locks.held(tmp_path, ["dem.rank1"]):
        text = written(tmp_path, state="waiting", waiting=WAIT)
    assert f"waiting for the continuum since {since} (phase field, FIELD; its last word: step 200)" in text


@pytest.mark.parametrize("state", ["running", "waiting"])
def test_a_process_that_is_gone_without_a_word_has_crashed(tmp_path, state):
    text = written(tmp_path, state=state)
    assert "crashed, its process 77 is gone and said nothing of an end: start the same command again" in text
    assert "steps/s" not in text
    assert status.is_over(status.of_folder(tmp_path))


def test_a_process_that_lives_and_says_nothing_is_silent(tmp_path):
    with locks.held(tmp_path, ["dem.rank1"]):
        text = written(tmp_path, written=time.time() - 60.0)
    assert "silent, alive but without a word for 60 s" in text


def test_an_ended_process_says_why_also_if_another_one_has_its_lock(tmp_path):
    text = written(tmp_path, state="failed", exit_code=5, reason="the continuum was lost")
    assert "dem.rank1 on office: failed (the continuum was lost); exit code 5" in text


def test_a_damaged_status_file_is_no_reason_to_fail(tmp_path):
    (tmp_path / "dem.rank1.now.json").write_text("{", encoding="utf-8")
    assert "dem.rank1 on ?: crashed" in "\n".join(status.lines(tmp_path, status.of_folder(tmp_path)))


def test_a_folder_without_a_run_is_refused_in_words(tmp_path):
    for folder, words in ((tmp_path / "none", "is not a folder"), (tmp_path, "has no files of a run")):
        with pytest.raises(EnvironmentFailed, match=words):
            status.of_folder(folder)
        done = run_colluvium("status", folder)
        assert done.returncode == 4
        assert words in done.stderr


@pytest.mark.parametrize(("seconds", "text"), [(8.4, "8 s"), (120.0, "2 min"), (7200.0, "2.0 h"), (180_000.0, "2.1 d")])
def test_spans_of_time_have_one_unit(seconds, text):
    assert status.duration(seconds) == text


def test_the_status_of_a_finished_run_has_its_tables_and_its_processes(short_run):
    done = run_colluvium("status", short_run, "--watch")
    assert done.returncode == 0, done.stderr
    assert "fdm.rank0 on " in done.stdout
    assert done.stdout.count(": finished (all stages done); exit code 0") == 2
    assert "grid\ncomputes" in done.stdout or "overload" in done.stdout
    found = json.loads(run_colluvium("status", short_run, "--json").stdout)
    assert found["exit_code"] == 0
    assert [row["process"] for row in found["processes"]] == ["fdm.rank0", "dem.rank1"]
    assert {row["run"] for row in found["processes"]} == {found["run"]}
    assert [row["step"] for row in found["processes"]] == [750, 750]
