"""The files of a run: what VTK reads is what was recorded, whatever happens to the process that wrote it."""

import os
import signal
import subprocess
import sys
import textwrap
import threading
import time

import h5py
import numpy as np
import pytest

from coupler_protocol.exits import EnvironmentFailed
from coupler_protocol.files.growing_datasets import Rows
from coupler_protocol.files.quantities import CRACKS
from coupler_protocol.files.recorder import FrameInfo, Recorder
from tests.commands import finished

GRIDPOINTS = np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [0.0, 1.0], [1.0, 1.0], [2.0, 1.0], [1.0, 2.0]])
ZONES = np.array([[0, 1, 4, 3], [1, 2, 5, 4], [3, 4, 6, 6]])
RNG = np.random.default_rng(7)


def info(number, stage="couple"):
    return FrameInfo(100 * number, 100.0 * number, stage, 1.0 + number)


def record_zones(recorder, number, zones=ZONES):
    displacement = RNG.standard_normal(GRIDPOINTS.shape)
    stress = RNG.standard_normal((len(zones), 4))
    recorder.frame(
        info(number),
        points=GRIDPOINTS,
        cells=zones,
        point_fields={"displacement": displacement},
        cell_fields={"stress": stress, "group": np.arange(len(zones))},
    )
    return displacement, stress


def record_discs(recorder, number, contacts):
    centres = RNG.random((5, 2))
    ends = RNG.permuted(np.tile(np.arange(5), (contacts, 1)), axis=1)[:, :2]
    force = RNG.standard_normal(contacts)
    recorder.frame(
        info(number),
        points=centres,
        cells=ends,
        point_fields={"radius": np.full(5, 0.1), "id": np.arange(5)},
        cell_fields={"normal_force": force, "bond_state": np.ones(contacts, int)},
    )
    return centres, ends, force


def vtk_frames(path):
    """What VTK's own reader makes of a file, frame by frame."""
    vtk_reader = pytest.importorskip("vtkmodules.vtkIOHDF").vtkHDFReader()
    vtk_reader.SetFileName(str(path))
    vtk_reader.UpdateInformation()
    for step in range(vtk_reader.GetNumberOfSteps()):
        vtk_reader.SetStep(step)
        vtk_reader.Update()
        yield vtk_reader.GetOutputDataObject(0)


def as_numpy(array):
    return pytest.importorskip("vtkmodules.util.numpy_support").vtk_to_numpy(array)


def test_vtk_reads_zones_also_after_the_hole_is_cut(tmp_path):
    path = tmp_path / "fdm.rank0.vtkhdf"
    hole = np.delete(ZONES, 1, axis=0)
    meshes = [ZONES, ZONES, hole, hole, ZONES]
    with Recorder(path, "continuum") as recorder:
        written = [record_zones(recorder, number, zones) for number, zones in enumerate(meshes)]
    read = 0
    for number, (grid, zones, (displacement, stress)) in enumerate(zip(vtk_frames(path), meshes, written, strict=True)):
        assert grid.GetClassName() == "vtkUnstructuredGrid"
        ids = as_numpy(grid.GetCells().GetConnectivityArray())
        ends = as_numpy(grid.GetCells().GetOffsetsArray())
        corners = [part.tolist() for part in np.split(ids, ends[1:-1])]
        assert corners == [list(dict.fromkeys(zone)) for zone in zones.tolist()]
        assert [grid.GetCellType(i) for i in range(len(zones))] == [9 if len(c) == 4 else 5 for c in corners]
        assert np.array_equal(as_numpy(grid.GetPoints().GetData())[:, :2], GRIDPOINTS)
        assert np.array_equal(as_numpy(grid.GetPointData().GetArray("displacement"))[:, :2], displacement)
        assert np.array_equal(as_numpy(grid.GetCellData().GetArray("stress")), stress)
        assert np.array_equal(as_numpy(grid.GetCellData().GetArray("group")), np.arange(len(zones)))
        assert as_numpy(grid.GetFieldData().GetArray("gravity_factor")) == [1.0 + number]
        assert as_numpy(grid.GetFieldData().GetArray("step")) == [100 * number]
        read += 1
    assert read == len(meshes)


def test_vtk_reads_discs_and_a_changing_number_of_contacts(tmp_path):
    path = tmp_path / "dem.rank1.vtkhdf"
    numbers = [0, 4, 7, 2, 0, 5]
    with Recorder(path, "discrete") as recorder:
        written = [record_discs(recorder, number, contacts) for number, contacts in enumerate(numbers)]
    for discs, (centres, ends, force) in zip(vtk_frames(path), written, strict=True):
        assert discs.GetClassName() == "vtkPolyData"
        assert (discs.GetNumberOfVerts(), discs.GetNumberOfLines()) == (5, len(ends))
        assert np.array_equal(as_numpy(discs.GetPoints().GetData())[:, :2], centres)
        stored = as_numpy(discs.GetCellData().GetArray("normal_force"))
        assert np.isnan(stored[:5]).all()  # VTK's rows of the discs themselves
        assert np.array_equal(stored[5:], force)
        if len(ends):
            lines = as_numpy(discs.GetLines().GetConnectivityArray())
            assert np.array_equal(lines.reshape(-1, 2), ends)


def test_what_does_not_change_is_stored_once(tmp_path):
    path = tmp_path / "fdm.rank0.vtkhdf"
    with Recorder(path, "continuum") as recorder:
        for number in range(10):
            record_zones(recorder, number)
    with h5py.File(path) as file:
        stored = {name: file[f"VTKHDF/{name}"].id.get_num_chunks() for name in ("Points", "Connectivity")}
        assert stored == {"Points": 1, "Connectivity": 1}
        assert file["VTKHDF/CellData/group"].id.get_num_chunks() == 1
        assert file["VTKHDF/CellData/stress"].id.get_num_chunks() == 10


def test_units_attributes_and_histories(tmp_path):
    path = tmp_path / "fdm.rank0.vtkhdf"
    with Recorder(path, "continuum", "a title", {"seed": 3}) as recorder:
        for step in range(5):
            recorder.history(step, unbalanced_ratio=1.0 / (step + 1), bonds_broken=step)
        record_zones(recorder, 1)
        recorder.history(5, unbalanced_ratio=0.125)
    with h5py.File(path) as file:
        assert (file.attrs["title"], file.attrs["seed"]) == ("a title", 3)
        assert file["VTKHDF"].attrs["Type"] == b"UnstructuredGrid"
        assert file["VTKHDF/CellData/stress"].attrs["unit"] == "Pa"
        assert file["VTKHDF/CellData/stress"].attrs["components"] == "xx yy zz xy"
        ratio = file["Histories/unbalanced_ratio"]
        assert ratio.attrs["long_name"] == "unbalanced force ratio"
        assert ratio["step"].tolist() == [0, 1, 2, 3, 4, 5]
        assert ratio["value"].tolist() == [1.0, 0.5, 1 / 3, 0.25, 0.2, 0.125]
        assert file["Histories/bonds_broken"]["value"].tolist() == [0, 1, 2, 3, 4]


def test_arrays_may_change_as_soon_as_they_are_recorded(tmp_path):
    path = tmp_path / "fdm.rank0.vtkhdf"
    displacement = np.ones_like(GRIDPOINTS)
    with Recorder(path, "continuum") as recorder:
        recorder.frame(
            info(0),
            points=GRIDPOINTS,
            cells=ZONES,
            point_fields={"displacement": displacement},
            cell_fields={},
        )
        displacement[:] = 2.0
    with h5py.File(path) as file:
        assert (file["VTKHDF/PointData/displacement"][:, :2] == 1.0).all()


def test_a_frame_nobody_could_read_is_refused(tmp_path):
    with Recorder(tmp_path / "fdm.rank0.vtkhdf", "continuum") as recorder:
        record_zones(recorder, 1)
        frame = {"points": GRIDPOINTS, "cells": ZONES}
        with pytest.raises(ValueError, match=r"no unit is known for 'colour'.*quantities\.py"):
            recorder.frame(info(2), **frame, point_fields={"colour": np.ones(7)}, cell_fields={})
        with pytest.raises(ValueError, match="'velocity' has 3 rows, but the frame has 7 points"):
            recorder.frame(info(2), **frame, point_fields={"velocity": np.ones((3, 2))}, cell_fields={})
        with pytest.raises(ValueError, match="added or missing: group, stress"):
            recorder.frame(info(2), **frame, point_fields={"displacement": GRIDPOINTS}, cell_fields={})
        with pytest.raises(ValueError, match="order of time"):
            record_zones(recorder, 0)
        with pytest.raises(ValueError, match="no unit is known for 'luck'"):
            recorder.history(1, luck=0.0)
    with pytest.raises(ValueError, match="closed"):
        record_zones(recorder, 3)
    with pytest.raises(ValueError, match="continuum, discrete"):
        Recorder(tmp_path / "x.vtkhdf", "gas")


def test_a_failure_of_the_writer_reaches_the_caller(tmp_path, monkeypatch):
    recorder = Recorder(tmp_path / "fdm.rank0.vtkhdf", "continuum")

    def full_disk(frame):
        raise OSError("no space left on device")

    monkeypatch.setattr(recorder._file, "append", full_disk)
    record_zones(recorder, 0)
    with pytest.raises(RuntimeError, match="no space left on device"):
        recorder.sync()
    with pytest.raises(RuntimeError, match="no space left on device"):
        record_zones(recorder, 1)
    with pytest.raises(RuntimeError, match="no space left on device"):
        recorder.close()


FULL = """
    import resource
    import sys
    import numpy as np
    from coupler_protocol.files.recorder import FrameInfo, Recorder

    resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[2]),) * 2)
    discs = np.random.default_rng(1).random((300, 2))
    with Recorder(sys.argv[1], "discrete") as recorder:
        for number in range(100):
            recorder.history(number, bonds_broken=float(number))
            recorder.frame(
                FrameInfo(number, float(number), "couple", 1.0),
                points=discs + number,
                cells=np.empty((0, 2), int),
                point_fields={"displacement": np.full_like(discs, number)},
                cell_fields={},
            )
"""


@pytest.mark.parametrize("size", [2_000, 60_000, 300_000, 420_000, 500_000])
def test_a_file_that_may_not_grow_keeps_its_frames_and_rows(tmp_path, size):
    """As on a full disk: every frame before the one without room can be read, with its histories."""
    path = tmp_path / "dem.rank1.vtkhdf"
    done = finished([sys.executable, "-c", textwrap.dedent(FULL), path, size])
    assert done.returncode == 1
    last = done.stderr.strip().splitlines()[-1]
    assert last.startswith("coupler_protocol.exits.EnvironmentFailed: the ")
    assert f"cannot be written to {path}: File too large; it needs " in last
    if not path.exists():
        assert size < 10_000
        assert list(tmp_path.iterdir()) == []
        return
    assert path.stat().st_size <= size
    with h5py.File(path) as file:
        frames = int(file["VTKHDF/Steps"].attrs["NSteps"])
        assert (frames > 2) == (size > 400_000)
        for name in ("Points", "PointData/displacement") if frames else ():
            for number in range(frames):
                start = file[f"VTKHDF/Steps/{'PointOffsets' if name == 'Points' else 'PointDataOffsets/displacement'}"][number]
                rows = file[f"VTKHDF/{name}"][start : start + 300, 0]
                assert ((rows >= number) & (rows < number + 1)).all()
        if frames:
            rows = file["Histories/bonds_broken"][:]
            assert len(rows) >= frames
            assert rows["step"].tolist() == list(range(len(rows)))
            assert rows["value"].tolist() == rows["step"].tolist()


def test_the_error_that_ends_a_run_is_not_hidden_by_a_full_disk(tmp_path, monkeypatch, caplog):
    def full_disk(what):
        raise EnvironmentFailed(f"{what}: no space left on device")

    caplog.set_level("INFO")

    def blow_up():
        with Recorder(tmp_path / "fdm.rank0.vtkhdf", "continuum") as recorder:
            monkeypatch.setattr(recorder._file._disk, "commit", full_disk)
            record_zones(recorder, 0)
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        blow_up()
    assert "the frame of step 0: no space left on device" in caplog.text


def test_the_caller_does_not_wait_for_the_disk(tmp_path, monkeypatch):
    recorder = Recorder(tmp_path / "fdm.rank0.vtkhdf", "continuum")
    disk = threading.Event()
    append = recorder._file.append
    monkeypatch.setattr(recorder._file, "append", lambda frame: disk.wait(10.0) and append(frame))
    record_zones(recorder, 0)
    record_zones(recorder, 1)  # both return while nothing has been written
    assert recorder.writer_seconds == 0.0
    disk.set()
    recorder.close()
    with h5py.File(tmp_path / "fdm.rank0.vtkhdf") as file:
        assert file["VTKHDF/Steps"].attrs["NSteps"] == 2


def test_breaks_of_many_looks_are_written_once_a_column_with_the_next_frame(tmp_path, monkeypatch):
    recorder, calls = Recorder(tmp_path / "dem.rank1.vtkhdf", "discrete"), []
    append = Rows.append
    monkeypatch.setattr(Rows, "append", lambda rows, *given: calls.append(rows._path) or append(rows, *given))
    looks = [cracks_of(number, count) for number, count in enumerate((2, 1, 3, 4, 1))]
    for look in looks[:3]:
        recorder.cracks(look)
    record_discs(recorder, 0, 3)
    recorder.sync()
    for look in looks[3:]:
        recorder.cracks(look)
    recorder.close()
    assert sorted(path for path in calls if path.startswith("Cracks/")) == sorted(2 * [f"Cracks/{name}" for name in CRACKS])
    with h5py.File(tmp_path / "dem.rank1.vtkhdf") as file:
        for name in CRACKS:
            found, given = file[f"Cracks/{name}"][:], [look[name] for look in looks]
            assert found.dtype == given[0].dtype
            np.testing.assert_array_equal(found, np.concatenate(given))


def cracks_of(step, count):
    """Columns of the breaks that a look has found."""
    whole = {name: RNG.integers(4, size=count).astype(np.int32) for name in CRACKS}
    plane = {name: RNG.random((count, 2)) for name in ("place", "normal")}
    return whole | plane | {"step": np.full(count, step), "time": np.full(count, 1.0 * step), "size": RNG.random(count)}


@pytest.mark.skipif(sys.platform != "linux", reason="threads have no priority of their own")
def test_the_thread_that_writes_has_a_lower_priority_than_the_loop(tmp_path, monkeypatch):
    recorder, found = Recorder(tmp_path / "fdm.rank0.vtkhdf", "continuum"), []
    append = recorder._file.append
    monkeypatch.setattr(recorder._file, "append", lambda frame: found.append(nice_value()) or append(frame))
    record_zones(recorder, 0)
    recorder.close()
    assert found == [min(nice_value() + 5, 19)]


def nice_value():
    """Of the present thread."""
    return os.getpriority(os.PRIO_PROCESS, threading.get_native_id())


WRITER = """
    import sys
    import numpy as np
    from coupler_protocol.files.recorder import FrameInfo, Recorder

    discs = np.random.default_rng(1).random((1500, 2))
    recorder = Recorder(sys.argv[1], "discrete")
    for number in range(100_000):
        contacts = np.column_stack((np.arange(1000 + number % 7), np.arange(1000 + number % 7) + 1))
        recorder.history(number, bonds_broken=float(len(contacts)))
        recorder.frame(
            FrameInfo(number, float(number), "couple", 1.0),
            points=discs + number,
            cells=contacts,
            point_fields={"displacement": np.full_like(discs, number)},
            cell_fields={"normal_force": np.full(len(contacts), float(number))},
        )
        recorder.sync()
        print(number, flush=True)
"""


@pytest.mark.parametrize("seconds", [0.0, 0.037, 0.111])
def test_no_acknowledged_frame_is_lost_when_the_writer_is_killed(tmp_path, seconds):
    path = tmp_path / "dem.rank1.vtkhdf"
    command = [sys.executable, "-c", textwrap.dedent(WRITER), str(path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as writer:
        for _ in range(5):
            acknowledged = int(writer.stdout.readline())
        time.sleep(seconds)
        os.kill(writer.pid, signal.SIGKILL)
        acknowledged = max([acknowledged, *(int(line) for line in writer.stdout if line.endswith("\n"))])
    frames = list(vtk_frames(path))
    assert len(frames) in (
        acknowledged + 1,
        acknowledged + 2,
    )  # the last may have been safe but not yet said so
    with h5py.File(path) as file:
        assert len(file["Histories/bonds_broken"]) >= len(frames)
        steps = file["VTKHDF/Steps"]
        assert len(steps["Values"]) <= len(frames)  # VTK reads all times into memory for NSteps of them
        for number in range(len(frames)):
            contacts = 1000 + number % 7
            start = steps["CellDataOffsets/normal_force"][number] + 1500
            assert (file["VTKHDF/CellData/normal_force"][start : start + contacts] == number).all()
            start = steps["PointDataOffsets/displacement"][number]
            assert (file["VTKHDF/PointData/displacement"][start : start + 1500, :2] == number).all()


def test_constants_are_stored_once_with_their_units(tmp_path):
    corners = np.array([[0.0, 1.0], [2.0, 3.0]])
    Recorder(tmp_path / "a.vtkhdf", "discrete", constants={"stone_corners": corners}).close()
    with h5py.File(tmp_path / "a.vtkhdf") as file:
        data = file["Constants/stone_corners"]
        assert data[:].tolist() == corners.tolist()
        assert data.attrs["unit"] == "m"
    with pytest.raises(ValueError, match="stone_corners"):
        Recorder(tmp_path / "b.vtkhdf", "discrete", constants={"stone_corner": corners})
