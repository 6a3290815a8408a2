"""Meshes and their series as VTK XML files (.vtu, .pvd).

Arrays are raw bytes at the end of the file, each deflated in one block with a head of four 64-bit numbers: number of blocks,
bytes of the block, of a shorter last block (0: there is none) and bytes deflated.
Source: Kitware, "VTK XML formats" (docs.vtk.org).
"""

import zlib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import NamedTuple
from xml.sax.saxutils import escape, quoteattr

import numpy as np

TYPES = {"f8": "Float64", "i4": "Int32", "i8": "Int64", "u1": "UInt8"}
VERTEX, LINE = 1, 3  # VTK's numbers of cell types, beside those of zones in coupler_protocol/files/vtk_cells.py
HEAD = '<VTKFile type="{}" version="1.0" byte_order="LittleEndian" header_type="UInt64"{}>'


class Field(NamedTuple):
    """Values (n,) or (n, components) of a field, its unit and the names of its components."""

    values: np.ndarray
    unit: str = ""
    components: tuple[str, ...] = ()


class Mesh(NamedTuple):
    """Points (n, 3) [m]; cells as points of all cells, the end of each cell among them and VTK types; fields by name."""

    points: np.ndarray
    connectivity: np.ndarray
    ends: np.ndarray
    types: np.ndarray
    point_fields: Mapping[str, Field]
    cell_fields: Mapping[str, Field]


def write_mesh(path: Path, mesh: Mesh, numbers: Mapping[str, float], texts: Mapping[str, str]) -> None:
    """Writes a mesh with numbers and texts of its frame (field data; `TimeValue` is the time of a file of a series)."""
    arrays = _Arrays()
    cells = {"connectivity": mesh.connectivity, "offsets": mesh.ends, "types": mesh.types}
    parts = [
        HEAD.format("UnstructuredGrid", ' compressor="vtkZLibDataCompressor"'),
        "<UnstructuredGrid>",
        "<FieldData>",
        *(arrays.element(name, Field(np.array([value])), 'NumberOfTuples="1" ') for name, value in numbers.items()),
        *(_text(name, value) for name, value in texts.items()),
        "</FieldData>",
        f'<Piece NumberOfPoints="{len(mesh.points)}" NumberOfCells="{len(mesh.types)}">',
        "<PointData>",
        *(arrays.element(name, field) for name, field in mesh.point_fields.items()),
        "</PointData>",
        "<CellData>",
        *(arrays.element(name, field) for name, field in mesh.cell_fields.items()),
        "</CellData>",
        "<Points>",
        arrays.element("Points", Field(mesh.points, "m")),
        "</Points>",
        "<Cells>",
        *(arrays.element(name, Field(values)) for name, values in cells.items()),
        "</Cells>",
        "</Piece>",
        "</UnstructuredGrid>",
    ]
    text = "\n".join([*parts, '<AppendedData encoding="raw">', "_"])
    path.write_bytes(text.encode() + b"".join(arrays.blocks) + b"\n</AppendedData>\n</VTKFile>\n")


def write_series(path: Path, files: Iterable[tuple[float, int, str, str]]) -> None:
    """Writes a .pvd file; files: time, number of the part, its name, and the file beside it."""
    rows = (
        f'<DataSet timestep="{time!r}" part="{part}" name={quoteattr(name)} file={quoteattr(file)}/>'
        for time, part, name, file in files
    )
    text = [HEAD.format("Collection", ""), "<Collection>", *rows, "</Collection>", "</VTKFile>"]
    path.write_text("\n".join(text) + "\n", encoding="utf-8")


class _Arrays:
    """Bytes of the arrays of a file, and the elements that name their places."""

    def __init__(self) -> None:
        self.blocks: list[bytes] = []
        self._size = 0

    def element(self, name: str, field: Field, more: str = "") -> str:
        """Adds the values of a field; returns its element."""
        values = np.ascontiguousarray(field.values)
        values = values.astype(values.dtype.newbyteorder("<"), copy=False)
        packed = zlib.compress(values.tobytes(), 1)
        sizes = [1, values.nbytes, 0, len(packed)] if values.nbytes else [0, 0, 0]
        block = np.array(sizes, "<u8").tobytes() + (packed if values.nbytes else b"")
        offset, self._size = self._size, self._size + len(block)
        self.blocks.append(block)
        count = values.shape[1] if values.ndim > 1 else 1
        names = "".join(f'ComponentName{k}="{component}" ' for k, component in enumerate(field.components))
        head = f'<DataArray type="{TYPES[values.dtype.str[1:]]}" Name={quoteattr(name)} NumberOfComponents="{count}" '
        unit = f'<InformationKey name="UNITS_LABEL" location="vtkDataArray">{escape(field.unit)}</InformationKey>'
        return f'{head}{more}{names}format="appended" offset="{offset}">{unit if field.unit else ""}</DataArray>'


def _text(name: str, value: str) -> str:
    letters = " ".join(map(str, [*value.encode(), 0]))
    return f'<Array type="String" Name={quoteattr(name)} NumberOfTuples="1" format="ascii">{letters}</Array>'
