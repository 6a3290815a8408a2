"""A VTKHDF file that grows by one frame at a time and that ParaView can open.

Layout: VTKHDF file format 2.0 of Kitware (docs.vtk.org, "VTKHDF file format"). All frames follow each other in
the same datasets; the group `Steps` holds the row where each frame starts. A file remains readable if its writer
is killed, for three reasons: rows of earlier frames are never moved (growing_datasets.py), every frame ends with
a flush, and `NSteps` counts a frame only after all its arrays are in the file. `libver` is fixed at a version
whose files have no "open for writing" mark, which a crash would leave behind. On a full disk the file keeps its
frames (whole_writes.py).
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import h5py
import numpy as np

from coupler_protocol.exits import EnvironmentFailed
from coupler_protocol.files.growing_datasets import Blocks, Rows, same_bits
from coupler_protocol.files.quantities import CONSTANTS, CRACKS, FIELDS, FRAME, HISTORIES, Quantity, quantity
from coupler_protocol.files.vtk_cells import TOPOLOGIES, cell_groups, cell_rows, zone_types
from coupler_protocol.files.whole_writes import WholeWrites

VERSION = (2, 0)
HISTORY_ROW = np.dtype([("step", "<i8"), ("value", "<f8")])
FRAME_TYPES = {"step": "<i8", "time": "<f8", "stage": "S64", "gravity_factor": "<f8"}
SHOWN_BY_VTK = ("step", "gravity_factor")  # as field data, for annotations in ParaView; VTK cannot read texts


class FrameInfo(NamedTuple):
    """Step, time, stage and gravity factor of a frame."""

    step: int
    time: float
    stage: str
    gravity_factor: float


class Frame(NamedTuple):
    """Points (N, 3), cells (gridpoints of zones or rows of discs in contact), fields by name."""

    info: FrameInfo
    points: np.ndarray
    cells: np.ndarray
    point_fields: Mapping[str, np.ndarray]
    cell_fields: Mapping[str, np.ndarray]


class VtkHdfFile:
    """Frames of a continuum (quads and triangles) or of discs (vertices) and their contacts (lines)."""

    def __init__(
        self, path: Path, kind: str, attributes: Mapping[str, Any], constants: Mapping[str, np.ndarray], axis: str = "time"
    ) -> None:
        self._kind, self._axis = kind, axis
        self._disk = WholeWrites(path)
        self._file = h5py.File(self._disk, "w", libver=("v108", "v114"))
        self._file.attrs.update({**attributes, "kind": kind})
        self._vtk = self._file.create_group("VTKHDF")
        self._vtk.attrs["Version"] = VERSION
        self._vtk.attrs["Type"] = np.bytes_(TOPOLOGIES[kind])  # of fixed length, as older readers need it
        self._steps = self._vtk.create_group("Steps")
        self._steps.attrs["NSteps"] = 0
        for name, values in constants.items():
            data = self._file.create_dataset(f"Constants/{name}", data=values)
            about = quantity(CONSTANTS, name)
            data.attrs.update({"unit": about.unit, "long_name": about.long_name})
        self._columns: dict[str, Rows | Blocks] = {}
        self._frames = 0
        self._parts = 0
        self._shape: tuple[np.ndarray, np.ndarray] | None = None  # points and cells of the last frame
        self._shape_starts: dict[str, Any] = {}
        try:
            self.flush("the head of the file")
        except EnvironmentFailed:
            self.abandon()
            raise

    def append(self, frame: Frame) -> None:
        """Stores a frame; when this returns, the operating system has the data even if this process ends.

        Raises EnvironmentFailed if the disk is full; the file then has the frames before.
        """
        what = f"the frame of step {frame.info.step}"
        starts = self._store_shape(frame.points, frame.cells)
        cell_fields = cell_rows(self._kind, frame.points, frame.cell_fields)
        for place, fields in (("PointData", frame.point_fields), ("CellData", cell_fields)):
            for name, values in fields.items():
                blocks = self._column(Blocks, f"VTKHDF/{place}/{name}", FIELDS[name])
                starts[f"{place}Offsets/{name}"] = blocks.share(values)
        for name, value in frame.info._asdict().items():
            row = np.array([value.encode() if name == "stage" else value], FRAME_TYPES[name])
            self._column(Rows, f"Frames/{name}", FRAME[name]).append(row)
        for name in SHOWN_BY_VTK:
            if not self._frames:
                self._vtk[f"FieldData/{name}"] = self._file[f"Frames/{name}"]  # the same under a second name
            starts[f"FieldDataOffsets/{name}"] = self._frames
        for name, start in starts.items():
            self._append_one(f"Steps/{name}", start)
        self.flush(what)
        self._frames += 1
        self._steps.attrs.modify("NSteps", self._frames)  # in place, unlike an assignment
        self.flush(what)
        now = float(getattr(frame.info, self._axis))
        self._append_one("Steps/Values", now)  # more times than NSteps would overrun VTK's memory
        self.flush(what)

    def append_history(self, name: str, steps: list[int], values: list[float]) -> None:
        """Adds rows to a history; they are in the file after the next `append` or `flush`."""
        rows = np.empty(len(steps), HISTORY_ROW)
        rows["step"], rows["value"] = steps, values
        self._column(Rows, f"Histories/{name}", quantity(HISTORIES, name)).append(rows)

    def append_cracks(self, columns: Mapping[str, np.ndarray]) -> None:
        """Adds rows to the list of cracks, as `append_history` does; columns: of all names in quantities.CRACKS."""
        for name, about in CRACKS.items():
            self._column(Rows, f"Cracks/{name}", about).append(columns[name])

    def flush(self, what: str = "histories") -> None:
        """Passes all data to the operating system; `what`: the data in words, for the EnvironmentFailed of a full disk."""
        self._file.flush()
        self._disk.commit(what)

    def to_disk(self) -> None:
        """Passes all data to the operating system and waits until they are on the disk."""
        self.flush()
        self._disk.to_disk()

    def close(self) -> None:
        """Passes all data to the operating system and closes the file."""
        self._file.close()
        try:
            self._disk.commit("histories")
        finally:
            self._disk.close()

    def abandon(self) -> None:
        """Closes the file as the last successful flush left it."""
        self._file.close()
        self._disk.close()

    def _store_shape(self, points: np.ndarray, cells: np.ndarray) -> dict[str, Any]:
        """Stores points and cells of a frame unless they equal those of the last one; returns the rows where they start."""
        if self._shape is None or not all(map(same_bits, (points, cells), self._shape)):
            self._shape_starts = self._store_part(points, cells)
            self._shape = (points, cells)
        return dict(self._shape_starts)

    def _store_part(self, points: np.ndarray, cells: np.ndarray) -> dict[str, Any]:
        """Stores points and cells as a new part, VTK's term for a piece of a mesh (here the whole mesh)."""
        first_cells, first_ids = [], []
        for prefix, (ids, offsets) in cell_groups(self._kind, points, cells).items():
            first_ids.append(self._column(Blocks, f"VTKHDF/{prefix}Connectivity").share(ids))
            # readers expect the offsets of part p at row (first cell + p): a part has one offset more than cells
            first = self._column(Blocks, f"VTKHDF/{prefix}Offsets").append(offsets) - self._parts
            first_cells.append(first)
            self._append_one(f"{prefix}NumberOfCells", len(offsets) - 1)
            self._append_one(f"{prefix}NumberOfConnectivityIds", len(ids))
        if self._kind == "continuum":
            self._column(Rows, "VTKHDF/Types").append(zone_types(cells), first_cells[0])
        first_point = self._column(Blocks, "VTKHDF/Points").share(points)
        self._append_one("NumberOfPoints", len(points))
        self._parts += 1
        return {
            "PartOffsets": self._parts - 1,
            "NumberOfParts": 1,
            "PointOffsets": first_point,
            "CellOffsets": first_cells,
            "ConnectivityIdOffsets": first_ids,
        }

    def _append_one(self, path: str, value: Any) -> None:
        """Adds one row, a number or a list of numbers, to a small dataset."""
        self._column(Rows, f"VTKHDF/{path}").append(np.array([value]))

    def _column(self, kind: type, path: str, about: Quantity | None = None) -> Any:
        if path not in self._columns:
            self._columns[path] = kind(self._file, path, about)
        return self._columns[path]
