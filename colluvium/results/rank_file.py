"""Reader of the VTKHDF file of one rank: its frames, and the arrays of a frame by name.

Only rows of counted frames are read, so a file can be read while it is written, and after its writer was
killed.
"""

import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from colluvium.results.cracks import NONE, Cracks
from coupler_protocol.exits import EnvironmentFailed
from coupler_protocol.files import undo_log
from coupler_protocol.files.vtkhdf import FrameInfo


class NotRecordedError(LookupError):
    """Data that the files of a run do not contain; the message names those that they contain."""


class ClosedRunError(ValueError):
    """An array was asked of a run after `close()`, or after the end of its `with` block."""


class _Closed:
    """In the place of a file that was closed: any access says so."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __getitem__(self, name: str) -> Any:
        raise ClosedRunError(
            f"{self.path}: this run is closed; read its arrays before `close()` and inside `with`, or open it again"
        )

    def __getattr__(self, name: str) -> Any:
        return self[name]


class Fields:
    """Arrays of one kind of body in one frame, read on access: `zones.stress` or `zones["stress"]`."""

    def __init__(self, file: "RankFile", place: str, frame: int, rows: slice, **arrays: np.ndarray) -> None:
        self._file, self._place, self._frame, self._rows = file, place, frame, rows
        self._arrays = arrays

    @property
    def names(self) -> list[str]:
        """Names of all arrays."""
        return sorted({*self._arrays, *self._file.field_names(self._place)})

    def __contains__(self, name: str) -> bool:
        return name in self._arrays or name in self._file.field_names(self._place)

    def __getitem__(self, name: str) -> np.ndarray:
        if name not in self._arrays:
            if name not in self:
                raise NotRecordedError(f"{self._file.path.name} has no field {name!r} here; it has {', '.join(self.names)}")
            self._arrays[name] = self._file.read_field(self._place, name, self._frame, self._rows)
        return self._arrays[name]

    def __getattr__(self, name: str) -> np.ndarray:
        if name.startswith("_"):
            raise AttributeError(name)
        try:
            return self[name]
        except NotRecordedError as error:
            raise AttributeError(str(error)) from None

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self.names]


REMEDY = "Copy it again if it is a copy; move it away to open the run without its frames"


class RankFile:
    """The file of one rank. `kind` is "continuum" or "discrete"."""

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        self._file: Any = _Closed(self.path)
        self.cut = ""  # why frames that were written are left out
        try:
            self._open()
        except (FileNotFoundError, EnvironmentFailed):
            raise
        except (OSError, KeyError, RuntimeError, ValueError, TypeError) as error:
            self.close()
            raise EnvironmentFailed(f"{self.path} is not a whole file of frames: {error}. {REMEDY}") from None

    def _open(self) -> None:
        """Opens the file, and reads what is needed of it at once."""
        content = undo_log.certain_content(self.path)
        if content is not None:
            why = f"the machine stopped while {self.path.name} was written, or the file was copied while it was written"
            if not content:
                raise EnvironmentFailed(
                    f"{self.path} has no frame for certain: {why}. Continue the run, or copy the file after its first checkpoint"
                )
            self.cut = f"{why}: its frames since the last checkpoint are left out"
        self._file = h5py.File(self.path if content is None else io.BytesIO(content), "r", locking=False)
        self._vtk: Any = self._file["VTKHDF"]
        self._data: dict[str, Any] = {}  # datasets that were asked for
        self._rows: dict[str, np.ndarray] = {}  # small datasets, with a few numbers for each frame or part
        self.kind = str(self._file.attrs["kind"])
        self.run = str(self._file.attrs.get("run", ""))  # number of the run; "" before version 0.2
        self.scene = str(self._file.attrs.get("scene_identity", ""))  # hash of the scene
        self.written = self.path.stat().st_mtime
        kept = self._file.attrs.get("kept_stages")  # if the run continued another: names of stages that it did not compute
        self.kept_stages = None if kept is None else [str(name) for name in kept]
        step = self._file.attrs.get("kept_step")  # if it continued inside of a stage: the last step that it did not compute
        self.kept_step = None if step is None else int(step)
        self.frames = self._read_frames()

    def points(self, frame: int) -> Fields:
        """Gridpoints or discs of a frame: fields and `xy` (N, 2) [m]."""
        xy = self._dataset("Points")[self._point_rows(frame)][:, :2]
        return Fields(self, "PointData", frame, slice(0, len(xy)), xy=xy)

    def zones(self, frame: int) -> Fields:
        """Zones of a frame: fields, `corners` (Z, 4) gridpoints, `xy` (Z, 2) centres at the start [m]."""
        ids, ends = self._cells(frame, "", 0)
        counts = np.diff(ends, prepend=0)
        last = np.minimum(np.arange(4), counts[:, None] - 1)  # a triangle repeats its third gridpoint
        corners = ids[(ends - counts)[:, None] + last]
        weight = np.where(np.arange(4) < counts[:, None], 1.0 / counts[:, None], 0.0)
        middles = np.einsum("zc,zcd->zd", weight, self.points(frame).xy[corners])
        return Fields(self, "CellData", frame, slice(0, len(corners)), corners=corners, xy=middles)

    def contacts(self, frame: int) -> Fields:
        """Contacts of a frame: fields and `ends` (C, 2), the rows of the two discs in `points(frame)`."""
        ends = self._cells(frame, "Lines/", 1)[0].reshape(-1, 2)
        vertices = self._part(frame, "NumberOfPoints")  # VTK's cell rows start with the discs
        return Fields(self, "CellData", frame, slice(vertices, vertices + len(ends)), ends=ends)

    def field_names(self, place: str) -> list[str]:
        """Names of the recorded fields of points ("PointData") or cells ("CellData")."""
        return list(self._vtk.get(place, ()))

    def read_field(self, place: str, name: str, frame: int, rows: slice) -> np.ndarray:
        """Rows of one field in one frame; plane vectors have the shape (n, 2)."""
        start = int(self._small(f"Steps/{place}Offsets/{name}")[frame])
        values = self._dataset(f"{place}/{name}")[start + rows.start : start + rows.stop]
        return values[:, :2] if values.shape[1:] == (3,) else values

    def about(self, place: str, name: str) -> tuple[str, str]:
        """Unit and meaning of a field."""
        attributes = self._vtk[f"{place}/{name}"].attrs
        return str(attributes["unit"]), str(attributes["long_name"])

    def constant(self, name: str) -> np.ndarray | None:
        """Array for all frames, or None."""
        data = self._file.get(f"Constants/{name}")
        return None if data is None else data[:]

    def units(self) -> dict[str, str]:
        """Unit of every field and history of the file."""
        found = {}
        for place in (self._vtk.get("PointData"), self._vtk.get("CellData"), self._file.get("Histories")):
            found.update({name: str(data.attrs["unit"]) for name, data in (place or {}).items()})
        return found

    def history_names(self) -> list[str]:
        """Names of the histories of the file."""
        return list(self._file.get("Histories", ()))

    def history(self, name: str) -> tuple[np.ndarray, np.ndarray]:
        """Steps and values of a history."""
        rows = self._file[f"Histories/{name}"][:]
        return rows["step"], rows["value"]

    def cracks(self) -> Cracks:
        """All breaks of bonds in the file."""
        group = self._file.get("Cracks") or {}
        if any(name not in group for name in Cracks._fields):
            return NONE
        count = min(len(group[name]) for name in Cracks._fields)  # a writer that was killed left columns of two lengths
        return Cracks(*(group[name][:count] for name in Cracks._fields))

    def close(self) -> None:
        """Closes the file; arrays that were read remain valid."""
        if not isinstance(self._file, _Closed):
            self._file.close()
        self._data, self._rows = {}, {}
        self._file = self._vtk = _Closed(self.path)

    def _read_frames(self) -> Sequence[FrameInfo]:
        count = int(self._vtk["Steps"].attrs["NSteps"])
        if not count:
            return []
        columns = [self._file[f"Frames/{name}"][:count].tolist() for name in FrameInfo._fields]
        return [FrameInfo(step, time, stage.decode(), factor) for step, time, stage, factor in zip(*columns, strict=True)]

    def _dataset(self, name: str) -> Any:
        """A dataset below VTKHDF; finding one takes longer than reading a row of it."""
        if name not in self._data:
            self._data[name] = self._vtk[name]
        return self._data[name]

    def _small(self, name: str) -> np.ndarray:
        """All rows of a small dataset below VTKHDF, read once: those of the frames that were counted do not change."""
        if name not in self._rows:
            self._rows[name] = self._vtk[name][:]
        return self._rows[name]

    def _part(self, frame: int, name: str) -> int:
        return int(self._small(name)[int(self._small("Steps/PartOffsets")[frame])])

    def _point_rows(self, frame: int) -> slice:
        start = int(self._small("Steps/PointOffsets")[frame])
        return slice(start, start + self._part(frame, "NumberOfPoints"))

    def _cells(self, frame: int, group: str, column: int) -> tuple[np.ndarray, np.ndarray]:
        """Points of all cells of a group, one cell after the other, and the end of each cell among them."""
        part = int(self._small("Steps/PartOffsets")[frame])
        first_id = int(self._small("Steps/ConnectivityIdOffsets")[frame, column])
        first_offset = int(self._small("Steps/CellOffsets")[frame, column]) + part
        last_id = first_id + self._part(frame, group + "NumberOfConnectivityIds")
        count = self._part(frame, group + "NumberOfCells")
        ids = self._dataset(group + "Connectivity")[first_id:last_id]
        return ids, self._dataset(group + "Offsets")[first_offset + 1 : first_offset + 1 + count]
