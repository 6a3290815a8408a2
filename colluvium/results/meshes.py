"""`colluvium export --format vtu|pvd`: frames as VTK XML files, for programs that cannot read VTKHDF files with steps.

`grid.FRAME.vtu` has zones, at the positions of gridpoints before any displacement. `discs.rankN.FRAME.vtu` has discs as vertices,
`contacts.rankN.FRAME.vtu` contacts as lines between the centres of their discs, both at the positions of the frame. Every array
has the values of `open_run`, bit for bit. `run.pvd` lists the files of all frames on the axis that `clock.axis` names.
"""

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from colluvium.results import clock, vtk_xml
from colluvium.results.rank_file import Fields
from colluvium.results.run import Run
from colluvium.results.vtk_xml import Field, Mesh
from coupler_protocol.files.quantities import FIELDS
from coupler_protocol.files.vtk_cells import as_stored, cell_groups, zone_types

SERIES = "run.pvd"
OWN = ("corners", "ends", "xy")  # arrays of Fields that are geometry here


def write_frame(run: Run, frame: int, folder: Path) -> list[Path]:
    """Writes the files of a frame, counted from 0, into a folder; returns their paths."""
    return [folder / name for _, name in _write_frame(run, frame, folder)]


def write_series(run: Run, folder: Path) -> list[Path]:
    """Writes the files of all frames and their series into a folder, in place of an earlier series; returns their paths."""
    _remove_earlier(folder)
    parts: dict[str, int] = {}
    rows = []
    for frame in range(len(run.frames)):
        for part, name in _write_frame(run, frame, folder):
            rows.append((_time(run, frame), parts.setdefault(part, len(parts)), part, name))
    vtk_xml.write_series(folder / SERIES, rows)
    return [folder / SERIES, *(folder / name for *_, name in rows)]


def _remove_earlier(folder: Path) -> None:
    """Removes the files that an earlier series in this folder lists."""
    series = folder / SERIES
    if series.is_file():
        for name in re.findall(r'file="([^"/\\]+\.vtu)"', series.read_text(encoding="utf-8")):
            (folder / name).unlink(missing_ok=True)


def _write_frame(run: Run, frame: int, folder: Path) -> Iterator[tuple[str, str]]:
    """Writes the files of a frame; yields the name of each part and of its file."""
    info = run.frames[frame]
    numbers = {"TimeValue": _time(run, frame), "step": info.step, "time": info.time, "gravity_factor": info.gravity_factor}
    digits = len(str(len(run.frames) - 1))
    for part, mesh in _meshes(run, frame):
        name = f"{part}.{frame:0{digits}d}.vtu"
        vtk_xml.write_mesh(folder / name, mesh, numbers, {"stage": info.stage})
        yield part, name


def _time(run: Run, frame: int) -> float:
    """Time of a frame in ParaView, as in VTKHDF files: seconds if the whole run is in real time, otherwise steps."""
    return float(getattr(run.frames[frame], clock.axis(run)))


def _meshes(run: Run, frame: int) -> Iterator[tuple[str, Mesh]]:
    """Yields the parts of a frame: their names and meshes."""
    for rank in run.files:
        if run.has(frame, rank):
            if run.files[rank].kind == "continuum":
                yield "grid", _grid(run, frame, rank)
            else:
                yield f"discs.rank{rank}", _discs(run, frame, rank)
                yield f"contacts.rank{rank}", _contacts(run, frame, rank)


def _grid(run: Run, frame: int, rank: int) -> Mesh:
    gridpoints, zones = run.gridpoints(frame, rank), run.zones(frame, rank)
    points = _in_space(gridpoints.xy)
    connectivity, offsets = cell_groups("continuum", points, zones.corners)[""]
    fields = _fields(run, frame, gridpoints), _fields(run, frame, zones)
    return Mesh(points, connectivity, offsets[1:], zone_types(zones.corners), *fields)


def _discs(run: Run, frame: int, rank: int) -> Mesh:
    discs = run.discs(frame, rank)
    rows = np.arange(len(discs.xy))
    return Mesh(_in_space(discs.xy), rows, rows + 1, _types(rows, vtk_xml.VERTEX), _fields(run, frame, discs), {})


def _contacts(run: Run, frame: int, rank: int) -> Mesh:
    contacts = run.contacts(frame, rank)
    ends = np.arange(2, 2 * len(contacts.ends) + 1, 2)
    points = _in_space(run.discs(frame, rank).xy)
    return Mesh(points, contacts.ends.ravel(), ends, _types(ends, vtk_xml.LINE), {}, _fields(run, frame, contacts))


def _types(cells: np.ndarray, kind: int) -> np.ndarray:
    return np.full(len(cells), kind, np.uint8)


def _fields(run: Run, frame: int, bodies: Fields) -> dict[str, Field]:
    names = [name for name in bodies.names if name not in OWN]
    return {name: Field(as_stored(bodies[name]), run.units(name, frame), _components(name)) for name in names}


def _components(name: str) -> tuple[str, ...]:
    """Names of the components of a field; plane vectors have a third one, zero."""
    components = FIELDS[name].components if name in FIELDS else ()
    return (*components, "z") if len(components) == 2 else components


def _in_space(xy: np.ndarray) -> np.ndarray:
    return np.column_stack((xy, np.zeros(len(xy))))
