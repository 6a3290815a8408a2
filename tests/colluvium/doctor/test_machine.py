"""What `colluvium doctor` says about the machine it runs on."""

import os

import pytest

from colluvium.doctor import machine
from colluvium.doctor.findings import LOOK, OK, WRONG
from coupler_protocol.files import locks


def levels(findings):
    return [finding.level for finding in findings]


def test_all_versions_are_told_and_a_missing_library_is_wrong(monkeypatch):
    (finding,) = machine.versions()
    for name in ("python", "numpy", "numba", "pyzmq", "libzmq", "h5py", "hdf5", "msgpack", "colluvium"):
        assert f"{name} " in finding.found
    monkeypatch.setattr(machine, "LIBRARIES", ("numpy", "no-such-library"))
    assert levels(machine.versions()) == [WRONG, OK]


@pytest.mark.parametrize(
    ("files", "limit"),
    [
        ({}, None),
        ({"cpu.max": "max 100000\n"}, None),
        ({"cpu.max": "150000 100000\n"}, 1.5),
        ({"cpu/cpu.cfs_quota_us": "50000\n", "cpu/cpu.cfs_period_us": "100000\n"}, 0.5),
        ({"cpu/cpu.cfs_quota_us": "-1\n", "cpu/cpu.cfs_period_us": "100000\n"}, None),
    ],
)
def test_the_limit_of_a_control_group_counts(tmp_path, files, limit):
    (tmp_path / "cpu").mkdir()
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    assert machine.cgroup_limit(tmp_path) == limit


def test_one_core_and_a_crowd_are_worth_a_look(monkeypatch):
    monkeypatch.setattr(os, "sched_getaffinity", lambda pid: {0})
    monkeypatch.setattr(os, "getloadavg", lambda: (7.5, 0.0, 0.0))
    first, second = machine.cores()
    assert (first.level, second.level) == (LOOK, LOOK)
    assert first.found.startswith("1 of ")
    assert second.found == "7.5 processes compete for them"


def test_kernels_are_counted_where_the_servers_look_for_them(monkeypatch, tmp_path):
    from coupler_protocol.compiled import jit

    monkeypatch.setattr(jit, "cache_folder", lambda package: str(tmp_path / package))
    assert levels(machine.kernels()) == [LOOK, LOOK]
    (tmp_path / "dem_server" / "step").mkdir(parents=True)
    (tmp_path / "dem_server" / "step" / "a.nbc").write_bytes(b"code")
    discs, _ = machine.kernels()
    assert discs.level == OK
    assert discs.found.startswith("1 of dem_server, ")


def test_a_disk_without_room_or_permission_is_wrong(monkeypatch, tmp_path):
    assert levels(machine.disk(tmp_path / "new" / "run")) == [OK]
    assert not (tmp_path / "new").exists()
    with locks.held(tmp_path, ["fdm.rank0"]):
        assert levels(machine.disk(tmp_path)) == [OK, LOOK]
    for size, level in ((machine.SMALL, LOOK), (machine.FULL, WRONG)):
        monkeypatch.setattr(machine, "FULL" if level == WRONG else "SMALL", 1e18)
        assert levels(machine.disk(tmp_path)) == [level], size
    (tmp_path / "file").touch()
    assert levels(machine.disk(tmp_path / "file" / "run")) == [WRONG]


def test_a_clock_of_the_past_and_a_name_without_address_are_worth_a_look(monkeypatch):
    assert levels(machine.clock()) == [OK]
    monkeypatch.setattr(machine.time, "time", lambda: 1e9)
    assert levels(machine.clock()) == [LOOK]
    monkeypatch.setattr(machine.socket, "gethostname", lambda: "nowhere.invalid")
    (finding,) = machine.names()
    assert finding.level == LOOK
    assert "has no address" in finding.found
