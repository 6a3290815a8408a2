"""A file of HDF5 that is written while the power fails is what the last checkpoint needs, whatever reached the disk."""

import os

import h5py
import pytest

from coupler_protocol.exits import EnvironmentFailed
from coupler_protocol.files import checkpoint, locks, undo_log
from coupler_protocol.files.undo_log import DAMAGED, ENDING, PAGE, UndoLog, roll_back
from tests.coupler_protocol.files.test_whole_writes import assert_holds, grow, opened
from tests.integration.power_cuts import KINDS, Disk, found_after_start, states

COMMITS, EVERY = 9, 3  # commits of the file, commits from one checkpoint to the next


@pytest.fixture(scope="module")
def cuts(tmp_path_factory):
    """Power cuts while a file is written, with a checkpoint after every third commit."""
    folder = tmp_path_factory.mktemp("written")
    with Disk(folder) as disk:
        whole, file = opened(folder / "a.vtkhdf")
        for number in range(COMMITS):
            grow(file, number)
            whole.commit("rows")
            if (number + 1) % EVERY == 0:
                whole.to_disk()
                checkpoint.save(folder / f"{number}.h5", {"number": number})
        file.close()
        whole.commit("the end")
        whole.close()
    assert sorted(os.listdir(folder)) == ["2.h5", "5.h5", "8.h5", "a.vtkhdf"]
    return disk.cuts


@pytest.mark.parametrize("seed", [pytest.param(seed, marks=pytest.mark.long) if seed else seed for seed in range(10)])
def test_after_any_power_cut_the_file_has_the_rows_of_the_last_checkpoint(tmp_path, cuts, seed):
    found = list(states(cuts, seed))
    assert len(found) > 30
    rolled = 0
    for number, (what, state) in enumerate(found):
        folder = tmp_path / str(number)
        found_after_start(folder, state)
        path, saved = folder / "a.vtkhdf", [int(file.stem) for file in folder.glob("*.h5")]
        rolled += bool(roll_back(path))
        assert roll_back(path) == ""
        if not saved:  # no checkpoint needs it: there may be none, or one set aside
            assert not path.exists() or path.with_name(path.name + DAMAGED).exists() or holds(path, EVERY - 1), what
        else:
            assert holds(path, max(saved)) or holds(path, min(COMMITS - 1, max(saved) + EVERY)), what
    assert rolled > 10


def holds(path, number):
    try:
        assert_holds(path, number)
    except (AssertionError, OSError, KeyError, RuntimeError):
        return False
    return True


def test_without_the_log_power_cuts_do_damage(tmp_path, cuts):
    """That the trial can fail."""
    damaged = 0
    for number, (_, state) in enumerate(states(cuts)):
        if state.keys() >= {"2.h5", "a.vtkhdf"}:
            found_after_start(tmp_path / str(number), state)
            damaged += not any(holds(tmp_path / str(number) / "a.vtkhdf", n) for n in range(COMMITS))
    assert damaged


def written(path, monkeypatch, start):
    """A file with a synced commit and one after it, at a start of the machine."""
    monkeypatch.setattr(locks, "boot_id", lambda: start)
    whole, file = opened(path)
    for number in range(2):
        grow(file, number)
        whole.commit("rows")
        if number == 0:
            whole.to_disk()
    return whole, file


def test_a_kill_loses_nothing(tmp_path, monkeypatch):
    written(tmp_path / "a.vtkhdf", monkeypatch, "now")
    assert roll_back(tmp_path / "a.vtkhdf") == ""
    assert_holds(tmp_path / "a.vtkhdf", 1)
    monkeypatch.setattr(locks, "boot_id", lambda: "later")
    assert "is as its last checkpoint needs it" in roll_back(tmp_path / "a.vtkhdf")
    assert_holds(tmp_path / "a.vtkhdf", 0)
    assert [path.name for path in tmp_path.iterdir()] == ["a.vtkhdf"]


def test_a_file_that_was_never_on_the_disk_is_set_aside(tmp_path, monkeypatch):
    monkeypatch.setattr(locks, "boot_id", lambda: "earlier")
    whole, file = opened(tmp_path / "a.vtkhdf")
    grow(file, 0)
    whole.commit("rows")
    monkeypatch.setattr(locks, "boot_id", lambda: "now")
    assert "is a.vtkhdf.damaged now and does not count" in roll_back(tmp_path / "a.vtkhdf")
    assert [path.name for path in tmp_path.iterdir()] == ["a.vtkhdf.damaged"]


@pytest.mark.parametrize("cut", [1, 30, 70, PAGE, PAGE + 10])
def test_a_record_that_is_not_whole_does_not_count(tmp_path, monkeypatch, cut):
    """Its page has not been overwritten: the log is on the disk first."""
    path = tmp_path / "a"
    pages = [bytes([n]) * PAGE for n in range(3)]
    path.write_bytes(b"".join(pages))
    monkeypatch.setattr(locks, "boot_id", lambda: "earlier")
    log = UndoLog(path)
    log.forget(3 * PAGE)
    with open(path, "r+b", buffering=0) as file:
        log.keep(file.fileno(), [(10, 5)])
        log.keep(file.fileno(), [(2 * PAGE, 1), (12, 100)])
        file.write(b"x" * 100)
    whole = (tmp_path / f"a{ENDING}").read_bytes()
    (tmp_path / f"a{ENDING}").write_bytes(whole[:-cut])
    monkeypatch.setattr(locks, "boot_id", lambda: "now")
    assert roll_back(path)
    assert path.read_bytes() == b"".join(pages)


def test_a_full_disk_leaves_log_and_file_as_they_were(tmp_path, monkeypatch):
    whole, file = written(tmp_path / "a.vtkhdf", monkeypatch, "earlier")
    whole.to_disk()
    before = (tmp_path / f"a.vtkhdf{ENDING}").read_bytes()

    def full(descriptor):
        raise OSError(28, "No space left on device")

    grow(file, 2)
    with monkeypatch.context() as patch:
        patch.setattr(undo_log.os, "fsync", full)
        with pytest.raises(EnvironmentFailed, match="No space left on device"):
            whole.commit("rows")
    assert (tmp_path / f"a.vtkhdf{ENDING}").read_bytes() == before
    assert_holds(tmp_path / "a.vtkhdf", 1)
    whole.commit("rows")
    assert_holds(tmp_path / "a.vtkhdf", 2)
    with h5py.File(tmp_path / "a.vtkhdf"):
        pass


def test_states_of_a_power_cut_are_of_all_kinds(cuts):
    assert {what.rpartition(": ")[2] for what, _ in states(cuts)} == set(KINDS)
