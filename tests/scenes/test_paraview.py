"""The files of a real coupled run, opened by the reader ParaView uses."""

import numpy as np
import pytest

vtk = pytest.importorskip("vtk", reason="the vtk wheel is not installed")
from vtk.util.numpy_support import vtk_to_numpy  # noqa: E402


def reader_of(path):
    reader = vtk.vtkHDFReader()
    assert reader.CanReadFile(str(path))
    reader.SetFileName(str(path))
    reader.UpdateInformation()
    return reader


def at_step(reader, step):
    reader.SetStep(step)
    reader.Update()
    return reader.GetOutput()


def test_continuum_file(quick_run):
    reader = reader_of(quick_run[0] / "fdm.rank0.vtkhdf")
    steps = reader.GetNumberOfSteps()
    assert steps >= 8
    first, last = (at_step(reader, i).GetNumberOfCells() for i in (0, steps - 1))
    assert first - last == 3 * 7  # the window's zones are gone
    data = at_step(reader, steps - 1)
    stress = vtk_to_numpy(data.GetCellData().GetArray("stress"))
    assert stress.shape == (last, 4)
    assert np.isfinite(stress).all()
    assert stress[:, 1].min() < -3 * 2700 * 9.81 * 10.0  # three g at depth
    assert data.GetPointData().GetArray("displacement").GetNumberOfComponents() == 3


def test_discrete_file(quick_run):
    reader = reader_of(quick_run[0] / "dem.rank1.vtkhdf")
    steps = reader.GetNumberOfSteps()
    assert steps >= 8
    data = at_step(reader, steps - 1)
    discs, contacts = data.GetNumberOfVerts(), data.GetNumberOfLines()
    assert discs == data.GetNumberOfPoints()
    assert 600 < discs < 1200
    assert contacts > discs
    assert vtk_to_numpy(data.GetPointData().GetArray("radius")).min() > 0.0
    force = vtk_to_numpy(data.GetCellData().GetArray("normal_force"))
    assert np.nanmax(force) > 0.0  # discs come first among the cells and carry no contact force


def test_units_stand_beside_the_fields(quick_run):
    from colluvium import open_run

    with open_run(quick_run[0]) as run:
        assert run.units("stress") == "Pa"
        assert run.units("normal_force") == "N"
        assert run.units("displacement") == "m"
