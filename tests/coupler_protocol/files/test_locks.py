"""A run directory has one writer of every file: who it is, whether it lives, and what becomes of the locks of the dead."""

import json
import os
import platform
import subprocess
import sys
import time

import pytest

from coupler_protocol.exits import EnvironmentFailed
from coupler_protocol.files import locks

LINUX = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="reads /proc")


def planted(folder, silent=0.0, **more):
    """A lock in the folder that another process has left, with its last heartbeat `silent` seconds ago."""
    path = folder / "run.lock"
    path.write_text(json.dumps({"host": platform.node(), "boot": locks.boot_id(), "pid": os.getpid(), "since": "noon"} | more))
    then = time.time() - silent
    os.utime(path, (then, then))
    return path


def is_free(folder):
    """Whether the lock can be taken; afterwards it is gone."""
    try:
        with locks.held(folder, ["run"]):
            assert json.loads((folder / "run.lock").read_text())["pid"] == os.getpid()
    except EnvironmentFailed:
        return False
    assert list(folder.iterdir()) == []
    return True


def test_a_second_run_is_refused_in_plain_words(tmp_path):
    with locks.held(tmp_path, ["run", "other"]):
        with pytest.raises(EnvironmentFailed) as found, locks.held(tmp_path, ["run"]):
            pass
        with pytest.raises(EnvironmentFailed):
            locks.refuse_all(tmp_path)
        locks.refuse_all(tmp_path, ["run", "other"])
        assert sorted(path.name for path in tmp_path.iterdir()) == ["other.lock", "run.lock"]
    said = str(found.value)
    assert said.startswith(f"{tmp_path} is being written: run is computed there by process {os.getpid()} on {platform.node()}")
    assert "stop it (Ctrl-C, or kill" in said
    assert "choose another --out" in said
    assert is_free(tmp_path)


@LINUX
def test_the_lock_of_a_process_that_was_killed_is_stale(tmp_path):
    code = "import sys, time; from coupler_protocol.files import locks\n"
    code += f"with locks.held({str(tmp_path)!r}, ['run']): print('held', flush=True); time.sleep(60)"
    holder = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)
    try:
        assert holder.stdout.readline() == "held\n"
        assert not is_free(tmp_path)
    finally:
        holder.kill()
    deadline = time.monotonic() + 10.0  # its parent has not waited for it: it is a zombie
    while not (free := is_free(tmp_path)) and time.monotonic() < deadline:
        time.sleep(0.05)
    holder.communicate()
    assert free


@LINUX
def test_a_number_that_another_process_has_now_does_not_keep_a_lock_alive(tmp_path):
    planted(tmp_path, began="1")
    assert is_free(tmp_path)
    planted(tmp_path, began=locks.began(os.getpid()))
    assert not is_free(tmp_path)


@LINUX
def test_the_locks_of_before_a_reboot_are_stale(tmp_path):
    planted(tmp_path, boot="another")
    assert is_free(tmp_path)


def test_a_process_of_another_machine_lives_as_long_as_its_heart_beats(tmp_path):
    planted(tmp_path, silent=locks.SILENT - 60.0, host="elsewhere", pid=1)
    assert not is_free(tmp_path)
    planted(tmp_path, silent=locks.SILENT + 60.0, host="elsewhere", pid=1)
    assert is_free(tmp_path)


def test_a_lock_without_content_is_one_that_is_being_written_for_a_moment_only(tmp_path):
    path = tmp_path / "run.lock"
    path.touch()
    assert not is_free(tmp_path)
    os.utime(path, (1.0, 1.0))
    assert is_free(tmp_path)


def test_the_heart_beats(tmp_path, monkeypatch):
    monkeypatch.setattr(locks, "BEAT", 0.02)
    with locks.held(tmp_path, ["run"]):
        path = tmp_path / "run.lock"
        os.utime(path, (1.0, 1.0))
        deadline = time.monotonic() + 10.0
        while path.stat().st_mtime < 2.0:
            assert time.monotonic() < deadline
            time.sleep(0.01)


def test_a_lock_that_another_process_has_replaced_is_left_to_it(tmp_path):
    with locks.held(tmp_path, ["run"]):
        (tmp_path / "run.lock").write_text("of another one")
    assert (tmp_path / "run.lock").read_text() == "of another one"
