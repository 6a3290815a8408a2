"""`colluvium export`: files for other programs have the values of open_run, bit for bit, with their units."""

import csv
import re
from types import SimpleNamespace

import numpy as np
import pytest

from colluvium import cli
from colluvium.results import clock, export
from colluvium.results.run import open_run
from coupler_protocol.files.recorder import FrameInfo, Recorder
from coupler_protocol.process import command_line

vtk = pytest.importorskip("vtk", reason="the vtk wheel is not installed")
from vtk.util.numpy_support import vtk_to_numpy  # noqa: E402


@pytest.fixture(scope="module")
def run(stony_folder):
    with open_run(stony_folder) as run:
        yield run


@pytest.fixture(scope="module")
def series(stony_folder, tmp_path_factory):
    """Rows of run.pvd and their folder."""
    folder = tmp_path_factory.mktemp("series")
    assert export.write_folder(stony_folder, "pvd", out=folder)[0] == folder / "run.pvd"
    return SimpleNamespace(folder=folder, rows=rows_of(folder / "run.pvd"))


def rows_of(path):
    pattern = r'<DataSet timestep="(.*?)" part="(\d+)" name="(.*?)" file="(.*?)"/>'
    return [(float(time), int(part), name, file) for time, part, name, file in re.findall(pattern, path.read_text())]


def read(path):
    """A mesh as ParaView's reader gives it."""
    reader = vtk.vtkXMLUnstructuredGridReader()
    assert reader.CanReadFile(str(path))
    reader.SetFileName(str(path))
    reader.Update()
    assert reader.GetErrorCode() == 0
    return reader.GetOutput()


def agree(data, bodies, run, frame, planes):
    """Whether a mesh has every field with the same bits, and its unit and components."""
    names = [name for name in bodies.names if name not in ("xy", "corners", "ends")]
    assert sorted(data.GetArrayName(k) for k in range(data.GetNumberOfArrays())) == names
    for name in names:
        array, recorded = data.GetArray(name), bodies[name]
        values = vtk_to_numpy(array)
        assert values.dtype == recorded.dtype
        same_bits(values[:, :2] if name in planes else values, recorded)
        assert array.GetInformation().Get(vtk.vtkDataArray.UNITS_LABEL()) == run.units(name, frame)
        assert name not in planes or not values[:, 2].any()


def same_bits(values, recorded):
    assert values.shape == recorded.shape
    assert np.ascontiguousarray(values).tobytes() == np.ascontiguousarray(recorded).tobytes()


def test_a_series_has_all_frames_on_one_axis(run, series):
    expected = []
    for frame, info in enumerate(run.frames):
        names = ["grid", "discs.rank1", "contacts.rank1"][: 3 if run.has(frame, 1) else 1]
        expected += [(float(info.step), part, name, f"{name}.{frame}.vtu") for part, name in enumerate(names)]
    assert series.rows == expected
    assert sorted(path.name for path in series.folder.iterdir()) == sorted(["run.pvd", *(file for *_, file in expected)])


@pytest.mark.parametrize("frame", [0, 5])
def test_zones_and_gridpoints_come_back(run, series, frame):
    mesh, gridpoints, zones = read(series.folder / f"grid.{frame}.vtu"), run.gridpoints(frame), run.zones(frame)
    points = vtk_to_numpy(mesh.GetPoints().GetData())
    same_bits(points[:, :2], gridpoints.xy)
    assert not points[:, 2].any()
    agree(mesh.GetPointData(), gridpoints, run, frame, ("displacement", "velocity"))
    agree(mesh.GetCellData(), zones, run, frame, ())
    assert [mesh.GetCellData().GetArray("stress").GetComponentName(k) for k in range(4)] == ["xx", "yy", "zz", "xy"]
    assert mesh.GetNumberOfCells() == len(zones.corners)
    kinds = set()
    for zone, corners in enumerate(zones.corners):
        cell = mesh.GetCell(zone)
        triangle = corners[2] == corners[3]
        kinds.add(cell.GetCellType())
        assert cell.GetCellType() == (vtk.VTK_TRIANGLE if triangle else vtk.VTK_QUAD)
        assert [cell.GetPointId(k) for k in range(cell.GetNumberOfPoints())] == corners[: 3 if triangle else 4].tolist()
    assert kinds == {vtk.VTK_TRIANGLE, vtk.VTK_QUAD}


@pytest.mark.parametrize("frame", [2, 5])
def test_discs_and_contacts_come_back(run, series, frame):
    discs, contacts = run.discs(frame), run.contacts(frame)
    mesh = read(series.folder / f"discs.rank1.{frame}.vtu")
    same_bits(vtk_to_numpy(mesh.GetPoints().GetData())[:, :2], discs.xy)
    agree(mesh.GetPointData(), discs, run, frame, ("displacement", "velocity"))
    assert mesh.GetNumberOfCells() == len(discs.xy)
    assert {mesh.GetCellType(k) for k in range(mesh.GetNumberOfCells())} == {vtk.VTK_VERTEX}
    mesh = read(series.folder / f"contacts.rank1.{frame}.vtu")
    same_bits(vtk_to_numpy(mesh.GetPoints().GetData())[:, :2], discs.xy)
    agree(mesh.GetCellData(), contacts, run, frame, ())
    ends = [[mesh.GetCell(k).GetPointId(side) for side in (0, 1)] for k in range(mesh.GetNumberOfCells())]
    assert ends == contacts.ends.tolist()


def test_a_mesh_knows_its_moment(run, series):
    data = read(series.folder / "discs.rank1.4.vtu").GetFieldData()
    info = run.frames[4]
    numbers = {"TimeValue": info.step, "step": info.step, "time": info.time, "gravity_factor": info.gravity_factor}
    assert {name: data.GetArray(name).GetValue(0) for name in numbers} == numbers
    assert data.GetAbstractArray("stage").GetValue(0) == "overload"


def record_discs(folder, modes):
    """Two discs with a frame at the end of each stage of 100 steps."""
    time = 0.0
    with Recorder(folder / "dem.rank1.vtkhdf", "discrete", axis="time" if all(modes) else "step") as recorder:
        for number, real in enumerate(modes):
            time += 0.5 if real else 100.0
            step = 100 * (number + 1)
            recorder.history(step - 50, kinetic_energy=0.1 * number, interface_power=1.0)
            recorder.history(step, kinetic_energy=1 / 3, unbalanced_ratio=np.nan)
            recorder.frame(
                FrameInfo(step, time, f"s{number}", 1.0),
                points=np.array([[0.0, 0.0], [0.2, 0.1 + number]]),
                cells=np.empty((0, 2), int),
                point_fields={"id": np.array([7, 9]), "radius": np.full(2, 0.1), "velocity": np.ones((2, 2))},
                cell_fields={"disc_a": np.empty(0, int), "disc_b": np.empty(0, int), "normal_force": np.empty(0)},
            )
    stages = [{"name": f"s{number}", "kind": "discs", "time": "real" if real else "static"} for number, real in enumerate(modes)]
    (folder / "scene.json").write_text(str({"stage": stages}).replace("'", '"'))
    return folder


def test_a_shorter_series_leaves_no_file_of_the_longer_one(tmp_path):
    for name, modes in (("long", (True, True, True)), ("short", (True,))):
        (tmp_path / name).mkdir()
        record_discs(tmp_path / name, modes)
    out = tmp_path / "out"
    assert len(export.write_folder(tmp_path / "long", "pvd", out=out)) == 7
    (out / "grid.mine.vtu").write_text("of the user")
    written = export.write_folder(tmp_path / "short", "pvd", out=out)
    assert [path.name for path in written] == ["run.pvd", "discs.rank1.0.vtu", "contacts.rank1.0.vtu"]
    assert {path.name for path in out.iterdir()} == {"grid.mine.vtu", *(path.name for path in written)}


@pytest.mark.parametrize(
    ("modes", "times"),
    [((True, True), [0.5, 1.0]), ((False, False), [100.0, 200.0]), ((False, True, False), [100.0, 200.0, 300.0])],
)
def test_the_axis_has_seconds_or_steps_never_their_sum(tmp_path, modes, times):
    """In a run of both kinds the axis counts steps, also in the VTKHDF file that ParaView reads."""
    record_discs(tmp_path, modes)
    assert export.write_folder(tmp_path, "pvd")[0] == tmp_path / "export" / "run.pvd"
    assert [time for time, part, *_ in rows_of(tmp_path / "export" / "run.pvd") if part == 0] == times
    reader = vtk.vtkHDFReader()
    reader.SetFileName(str(tmp_path / "dem.rank1.vtkhdf"))
    reader.UpdateInformation()
    key = vtk.vtkStreamingDemandDrivenPipeline.TIME_STEPS()
    assert list(reader.GetOutputInformation(0).Get(key)) == times
    with open_run(tmp_path) as run:
        assert reader.GetNumberOfSteps() == len(run.frames) == len(times)
        assert clock.axis(run) == ("time" if all(modes) else "step")


def test_no_contact_is_an_empty_mesh(tmp_path):
    export.write_folder(record_discs(tmp_path, (True,)), "vtu")
    mesh = read(tmp_path / "export" / "contacts.rank1.0.vtu")
    assert (mesh.GetNumberOfPoints(), mesh.GetNumberOfCells()) == (2, 0)


def table(path):
    """Columns of a CSV file by head."""
    with open(path, encoding="utf-8", newline="") as file:
        head, *rows = csv.reader(file)
    return dict(zip(head, zip(*rows, strict=True), strict=True))


def test_tables_have_units_and_the_same_bits(run, stony_folder, tmp_path):
    names = {path.name for path in export.write_folder(stony_folder, "csv", stage="couple", out=tmp_path)}
    bodies = {f"{name}.3.csv" for name in ("zones", "gridpoints", "discs.rank1", "contacts.rank1")}
    assert names == bodies | {"frames.csv", "histories.rank0.csv", "histories.rank1.csv", "cracks.rank1.csv"}
    zones, discs = table(tmp_path / "zones.3.csv"), table(tmp_path / "discs.rank1.3.csv")
    assert list(zones)[:8] == ["zone [-]", *(f"gridpoint_{k} [-]" for k in (1, 2, 3, 4)), "x [m]", "y [m]", "group [-]"]
    assert "shear_strain_rate [1 per step]" in zones
    assert list(discs)[:3] == ["id [-]", "x [m]", "y [m]"]
    same_bits(np.array(zones["stress_xy [Pa]"], float), run.zones(3).stress[:, 3])
    same_bits(np.array(discs["velocity_y [m per step]"], float), run.discs(3).velocity[:, 1])
    same_bits(np.array(discs["x [m]"], float), run.discs(3).xy[:, 0])
    gridpoints = table(tmp_path / "gridpoints.3.csv")
    same_bits(np.array(gridpoints["displacement_x [m]"], float), run.gridpoints(3).displacement[:, 0])
    assert np.array(zones["gridpoint_3 [-]"], int).tolist() == run.zones(3).corners[:, 2].tolist()
    contacts = table(tmp_path / "contacts.rank1.3.csv")
    same_bits(np.array(contacts["normal_force [N]"], float), run.contacts(3).normal_force)
    frames = table(tmp_path / "frames.csv")
    assert frames["stage"] == tuple(info.stage for info in run.frames)
    assert np.array(frames["time [steps]"], float).tolist() == [info.time for info in run.frames]
    histories = table(tmp_path / "histories.rank0.csv")
    steps, ratio = run.history("unbalanced_ratio", 0)
    assert np.array(histories["step [-]"], int).tolist() == steps.tolist()
    same_bits(np.array(histories["unbalanced_ratio [-]"], float), ratio)


def test_histories_at_different_steps_share_a_table(tmp_path):
    """An empty entry was not recorded, nan was; rates over both kinds of stages have both units."""
    export.write_folder(record_discs(tmp_path, (False, True)), "csv", out=tmp_path)
    found = table(tmp_path / "histories.rank1.csv")
    assert found["step [-]"] == ("50", "100", "150", "200")
    assert found["kinetic_energy [J]"] == ("0.0", repr(1 / 3), "0.1", repr(1 / 3))
    assert found["unbalanced_ratio [-]"] == ("", "nan", "", "nan")
    assert found["interface_power [W, static stages: J per step]"] == ("1.0", "", "1.0", "")
    assert list(table(tmp_path / "frames.csv"))[2] == "time [s, static stages: steps]"
    assert table(tmp_path / "discs.rank1.1.csv")["velocity_x [m/s]"] == ("1.0", "1.0")


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["--format", "pvd", "--frame", "2"], "pvd has all frames; for one frame use --format vtu"),
        (["--format", "csv", "--rank", "1"], "--rank belongs to --format scene"),
    ],
)
def test_options_that_a_format_does_not_have(stony_folder, capsys, words, told):
    with pytest.raises(SystemExit) as ended:
        cli.main(["export", str(stony_folder), *words])
    assert ended.value.code == 2
    assert told in capsys.readouterr().err


def test_the_command_and_a_frame_that_is_not_there(stony_folder, tmp_path, capsys):
    assert cli.main(["export", str(stony_folder), "--format", "vtu", "--frame", "-1", "--out", str(tmp_path)]) == 0
    assert "3 files in" in capsys.readouterr().err
    assert {path.name for path in tmp_path.iterdir()} == {"grid.5.vtu", "discs.rank1.5.vtu", "contacts.rank1.5.vtu"}
    assert cli.main(["export", str(stony_folder), "--format", "csv", "--frame", "9", "--out", str(tmp_path)]) == 4
    assert "there is no frame 9: " in capsys.readouterr().err


def test_a_run_that_is_computed_again_loses_its_export(tmp_path):
    folder = record_discs(tmp_path, (True,))
    export.write_folder(folder, "pvd")
    export.write_folder(folder, "csv")
    (folder / "export" / "notes.txt").write_text("of the user")
    command_line.prepare_folder(folder, [], force=True)
    assert [path.name for path in (folder / "export").iterdir()] == ["notes.txt"]
