"""Files that were cut, by a power cut or half a copy: results are refused in words, or are those that are certain."""

import os
import shutil

import h5py
import pytest

from colluvium import open_run
from coupler_protocol.exits import EnvironmentFailed
from coupler_protocol.files import locks
from coupler_protocol.files.recorder import Recorder
from coupler_protocol.files.undo_log import UndoLog
from tests.commands import run_colluvium

GRID = "fdm.rank0.vtkhdf"


@pytest.fixture
def folder(run_folder, tmp_path):
    """A copy of the run, whose files can be spoiled."""
    return shutil.copytree(run_folder, tmp_path / "run")


def another_file(path):
    with h5py.File(path, "w") as file:
        file["a"] = 1


SPOILT = {
    "empty": lambda path: path.write_bytes(b""),
    "half": lambda path: os.truncate(path, path.stat().st_size // 2),
    "zeros": lambda path: path.write_bytes(bytes(path.stat().st_size)),
    "not of frames": another_file,
    "without frames": lambda path: h5py.File(path, "r+").pop("VTKHDF/Steps"),
}


@pytest.mark.parametrize("spoil", SPOILT.values(), ids=SPOILT)
def test_a_file_that_is_not_whole_is_named_with_the_remedy(folder, spoil):
    spoil(folder / GRID)
    with pytest.raises(EnvironmentFailed, match=r"run/fdm.rank0.vtkhdf is not a whole file of frames: .*move it away"):
        open_run(folder)
    (folder / GRID).unlink()
    with open_run(folder) as run:
        assert list(run.files) == [1]


def test_the_commands_say_so_too(folder):
    SPOILT["half"](folder / GRID)
    done = run_colluvium("report", folder)
    assert done.returncode == 4
    assert "is not a whole file of frames" in done.stderr
    assert "Traceback" not in done.stderr
    (folder / "run.json").write_bytes(b"")
    done = run_colluvium("status", folder)
    assert done.returncode == 4
    assert "run.json is damaged" in done.stderr


def test_a_folder_without_run_json_and_scene_has_its_frames(folder):
    for name in ("run.json", "scene.json"):
        (folder / name).unlink(missing_ok=True)
    with open_run(folder) as run:
        assert run.frames
        assert run.info == {}


def test_of_a_file_that_was_being_written_the_frames_that_are_certain_count(folder, monkeypatch):
    """Its machine stopped, or it was copied from another one; nothing is written."""
    path = folder / GRID
    with open_run(folder) as run:
        steps = [frame.step for frame in run.frames]
    certain = path.read_bytes()
    with monkeypatch.context() as then:
        then.setattr(locks, "boot_id", lambda: "another start")
        log = UndoLog(path)
        log.forget(len(certain))
        descriptor = os.open(path, os.O_RDWR)
        log.keep(descriptor, [(0, len(certain))])
        os.pwrite(descriptor, os.urandom(4096), 0)  # a page of the next commit, and none of the others
        os.pwrite(descriptor, b"later", len(certain))
        os.close(descriptor)
        log._file.close()
        as_it_is = path.read_bytes()
        with pytest.raises(EnvironmentFailed, match="is not a whole file"):
            open_run(folder)  # as long as the machine that writes it runs, it is taken as it is
    with open_run(folder) as run:
        assert [frame.step for frame in run.frames] == steps
        assert "fdm.rank0.vtkhdf was written" in run.cut
        assert "since the last checkpoint are left out" in run.cut
        assert len(run.zones(-1).stress)
    assert path.read_bytes() == as_it_is


def test_a_file_of_which_nothing_is_certain_has_no_frames(folder, monkeypatch):
    with monkeypatch.context() as then:
        then.setattr(locks, "boot_id", lambda: "another start")
        UndoLog(folder / GRID)._file.close()
    with pytest.raises(EnvironmentFailed, match=r"has no frame for certain: the machine stopped .*Continue the run"):
        open_run(folder)


def test_a_run_that_is_written_on_this_machine_is_read_as_it_is(tmp_path):
    """Frames that no checkpoint has made certain yet are there, too."""
    recorder = Recorder(tmp_path / GRID, "continuum")
    try:
        with open_run(tmp_path) as run:
            assert run.frames == []
            assert run.cut == ""
    finally:
        recorder.close()
