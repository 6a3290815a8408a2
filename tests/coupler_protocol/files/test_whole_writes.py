"""A file of HDF5 on a disk without room keeps the content of its last commit, whatever was being written."""

import errno
import os

import h5py
import numpy as np
import pytest

from coupler_protocol.exits import EnvironmentFailed
from coupler_protocol.files.whole_writes import WholeWrites


def opened(path):
    disk = WholeWrites(path)
    return disk, h5py.File(disk, "w", libver=("v108", "v114"))


def grow(file, number):
    """Change a file as frames do: rows that are added, rewritten chunks, a compressed block, an attribute."""
    if "rows" not in file:
        file.create_dataset("rows", (0, 2), "f8", maxshape=(None, 2), chunks=(64, 2))
        file.create_dataset("blocks", (0,), "f8", maxshape=(None,), chunks=(500,), compression="gzip")
    rows, blocks = file["rows"], file["blocks"]
    rows.resize(len(rows) + 5, axis=0)
    rows[-5:] = number
    blocks.resize(len(blocks) + 500, axis=0)
    blocks[-500:] = np.random.default_rng(number).standard_normal(500)
    file.attrs["number"] = number
    file[f"extra/{number}"] = np.full(number + 1, number)
    file.flush()


def content(path):
    """All arrays and attributes of a file."""
    found = {}
    with h5py.File(path) as file:
        file.visititems(lambda name, item: found.update({name: item[()]}) if isinstance(item, h5py.Dataset) else None)
        return found | dict(file.attrs)


def assert_holds(path, number):
    """The file is that of the commit with this number."""
    found = content(path)
    assert found["number"] == number
    np.testing.assert_array_equal(found["rows"], np.repeat(np.arange(number + 1.0), 5)[:, None] * [1, 1])
    assert len(found["blocks"]) == 500 * (number + 1)
    assert sorted(name for name in found if name.startswith("extra")) == sorted(f"extra/{k}" for k in range(number + 1))


def test_it_holds_what_hdf5_would_have_written_itself(tmp_path):
    disk, file = opened(tmp_path / "a.h5")
    for number in range(30):
        grow(file, number)
        disk.commit("rows")
        assert_holds(tmp_path / "a.h5", number)
    file.close()
    disk.commit("the end")
    disk.close()
    with h5py.File(tmp_path / "b.h5", "w", libver=("v108", "v114")) as plain:
        for number in range(30):
            grow(plain, number)
    one, two = content(tmp_path / "a.h5"), content(tmp_path / "b.h5")
    assert one.keys() == two.keys()
    for name, values in one.items():
        np.testing.assert_array_equal(values, two[name])


def test_pieces_that_follow_each_other_are_one_call_and_the_order_of_all_others_stays(tmp_path, monkeypatch):
    disk = WholeWrites(tmp_path / "a.h5")
    disk.write(bytes(100))
    disk.commit("the head")
    calls, pwrite = [], os.pwrite
    monkeypatch.setattr(os, "pwrite", lambda file, data, place: calls.append((place, bytes(data))) or pwrite(file, data, place))
    for place, piece in ((40, b"ab"), (42, b"cd"), (44, b"e"), (10, b"fg"), (90, b"h" * 20), (8, b"ij"), (42, b"kl")):
        disk.seek(place)
        disk.write(piece)
    disk.commit("a frame")
    disk.close()
    assert calls[1:] == [(40, b"ab"), (44, b"e"), (10, b"fg"), (90, b"h" * 10), (8, b"ij"), (42, b"kl")]
    assert calls[0] == (100, b"h" * 10)
    content = (tmp_path / "a.h5").read_bytes()
    assert (content[8:12], content[40:45], content[90:]) == (b"ijfg", b"abkle", b"h" * 20)


def test_pieces_that_follow_each_other_are_joined(tmp_path, monkeypatch):
    disk = WholeWrites(tmp_path / "a.h5")
    disk.write(bytes(100))
    disk.commit("the head")
    calls, pwrite = [], os.pwrite
    monkeypatch.setattr(os, "pwrite", lambda file, data, place: calls.append((place, bytes(data))) or pwrite(file, data, place))
    for place, piece in ((40, b"ab"), (42, b"cd"), (44, b"e"), (60, b"f"), (61, b"g"), (20, b"h")):
        disk.seek(place)
        disk.write(piece)
    disk.commit("a frame")
    disk.close()
    assert calls == [(40, b"abcde"), (60, b"fg"), (20, b"h")]


@pytest.mark.parametrize("short", [0, 1, 100, 4096])
def test_a_disk_that_becomes_full_at_any_write_keeps_the_last_commit(tmp_path, monkeypatch, short):
    """The k-th write to the disk has room for `short` bytes only; once there is room again, the same content goes through."""
    real = os.pwrite
    for k in range(60):
        path = tmp_path / f"{k}.h5"
        disk, file = opened(path)
        calls, failed = 0, 0

        def pwrite(descriptor, data, place, limit=k):
            nonlocal calls, failed
            calls += 1
            if calls == limit + 1 and short and len(data) > short:
                return real(descriptor, data[:short], place)
            if calls in (limit + 1, limit + 2) and not failed:
                failed = 1
                raise OSError(errno.ENOSPC, "No space left on device")
            return real(descriptor, data, place)

        monkeypatch.setattr(os, "pwrite", pwrite)
        for number in range(4):
            grow(file, number)
            before = failed
            try:
                disk.commit("rows")
            except EnvironmentFailed:
                assert failed > before
                if number:
                    assert_holds(path, number - 1)
                else:
                    assert not path.exists()
                disk.commit("rows")
            assert_holds(path, number)
        monkeypatch.undo()
        file.close()
        disk.close()
        assert_holds(path, 3)


def test_the_error_says_what_which_file_and_how_much(tmp_path, monkeypatch):
    disk, file = opened(tmp_path / "a.h5")
    grow(file, 0)

    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "pwrite", full)
    words = r"the frame of step 7 cannot be written to .*a\.h5: No space left on device; it needs 0\.0\d+ MB and .* are free"
    with pytest.raises(EnvironmentFailed, match=words):
        disk.commit("the frame of step 7")
    file.close()
    disk.close()
    assert list(tmp_path.iterdir()) == []


def test_a_fault_that_is_not_one_of_room_asks_for_none(tmp_path, monkeypatch):
    disk, file = opened(tmp_path / "a.h5")
    grow(file, 0)

    def broken(*_):
        raise OSError(errno.EIO, "Input/output error")

    monkeypatch.setattr(os, "pwrite", broken)
    with pytest.raises(EnvironmentFailed, match=r"Input/output error$"):
        disk.commit("rows")
    file.close()
    disk.close()


def test_a_folder_that_is_not_there_is_named(tmp_path):
    with pytest.raises(EnvironmentFailed, match=r"none.a\.h5"):
        WholeWrites(tmp_path / "none" / "a.h5")
