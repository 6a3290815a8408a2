"""Datasets of an HDF5 file that only grow and that remain readable if the writer is killed.

HDF5 stores a dataset in chunks and rewrites a chunk when rows are added to it. A compressed chunk that grows
moves to another place in the file. If the writer is killed before the index of the chunks is on disk, rows of
earlier frames are lost. So a chunk with rows of an earlier frame is either not compressed and is rewritten in
place with the same bytes (`Rows`), or is not changed again, because every block begins a new chunk (`Blocks`).

Chunks are compressed here and handed to HDF5 as they are to lie in the file. The filters are HDF5's own (shuffle, gzip), which
every reader of the format has, but ISA-L needs an eighth of the time of the zlib within HDF5, and the steps need these cores.
"""

from functools import lru_cache

import h5py
import numpy as np
from isal import isal_zlib

from coupler_protocol.files.quantities import PER_STEP, Quantity

ROWS_CHUNK = 1024
BLOCK_CHUNK = (512, 65536)  # fewest and most rows compressed together
LEVEL = 1  # of compression
SPARE = 1.1  # room in a chunk for blocks that are somewhat longer than the first


def same_bits(a: np.ndarray, b: np.ndarray) -> bool:
    """Whether two arrays are equal to the last bit (NaN equals NaN, 0.0 differs from -0.0)."""
    return a.shape == b.shape and a.dtype == b.dtype and a.tobytes() == b.tobytes()


class Rows:
    """A dataset of few bytes a frame, not compressed, created with its first rows."""

    def __init__(self, group: h5py.Group, path: str, about: Quantity | None = None) -> None:
        self._group, self._path, self._about = group, path, about
        self._data: h5py.h5d.DatasetID | None = None
        self._end = 0

    def append(self, rows: np.ndarray, start: int | None = None) -> int:
        """Stores rows after the others, or at row `start`; returns the row where they start."""
        if self._data is None:
            self._data = _create(self._group, self._path, rows, ROWS_CHUNK, self._about).id
            self._place = self._data.get_space()
            self._most = (h5py.h5s.UNLIMITED, *rows.shape[1:])
        start = self._end if start is None else start
        self._end = start + len(rows)
        self._write(start, rows)
        return start

    def _write(self, start: int, rows: np.ndarray) -> None:
        """Writes data[start:] = rows by low-level calls of HDF5: a frame has fifty of these, and slicing is slow."""
        assert self._data is not None
        length = (self._end, *rows.shape[1:])
        self._data.set_extent(length)
        if len(rows):
            self._place.set_extent_simple(length, self._most)
            self._place.select_hyperslab((start,) + (0,) * (rows.ndim - 1), rows.shape)
            self._data.write(_space_of(rows.shape), self._place, rows)


class Blocks:
    """A dataset of one compressed block a frame, created with its first block. Rows between blocks have no meaning."""

    def __init__(self, group: h5py.Group, path: str, about: Quantity | None = None) -> None:
        self._group, self._path, self._about = group, path, about
        self._data: h5py.Dataset | None = None
        self._last = np.empty(0)
        self._start = 0
        self._chunk = 0

    def append(self, block: np.ndarray) -> int:
        """Stores a block at the beginning of a new chunk; returns the row where it starts."""
        if self._data is None:
            fewest, most = BLOCK_CHUNK
            self._chunk = min(max(round(SPARE * len(block)), fewest), most)
            gzip = {"compression": "gzip", "compression_opts": LEVEL, "shuffle": True}
            self._data = _create(self._group, self._path, block, self._chunk, self._about, **gzip)
        if block.shape[1:] != self._data.shape[1:]:
            raise ValueError(f"{self._path}: rows of shape {block.shape[1:]}, before {self._data.shape[1:]}")
        self._start += -(-len(self._last) // self._chunk) * self._chunk
        self._last = block
        self._write(block)
        return self._start

    def _write(self, block: np.ndarray) -> None:
        """Stores a block in chunks of its own; the rows of the last one that are not of the block are zero."""
        assert self._data is not None
        row, data = block.shape[1:], self._data.id
        data.set_extent((self._start + len(block), *row))
        for first in range(0, len(block), self._chunk):
            rows = np.zeros((self._chunk, *row), block.dtype)
            part = block[first : first + self._chunk]
            rows[: len(part)] = part
            data.write_direct_chunk((self._start + first,) + (0,) * len(row), isal_zlib.compress(_shuffled(rows), LEVEL))

    def share(self, block: np.ndarray) -> int:
        """As `append`, but a block equal to the previous one is not stored: both start at the same row."""
        if self._data is not None and same_bits(block, self._last):
            return self._start
        return self.append(block)


def _shuffled(rows: np.ndarray) -> np.ndarray:
    """Bytes of the rows as HDF5's filter `shuffle` orders them: the first byte of every value, then the second, and so on."""
    return np.ascontiguousarray(rows.reshape(-1).view(np.uint8).reshape(-1, rows.dtype.itemsize).T)


def _create(
    group: h5py.Group, path: str, rows: np.ndarray, chunk: int, about: Quantity | None, **filters: object
) -> h5py.Dataset:
    row = rows.shape[1:]
    data = group.create_dataset(path, (0, *row), rows.dtype, maxshape=(None, *row), chunks=(chunk, *row), **filters)
    if about is not None:
        data.attrs["unit"] = about.unit
        data.attrs["long_name"] = about.long_name
        if about.unit in PER_STEP:
            data.attrs["unit_static"] = PER_STEP[about.unit]
        if about.components:
            data.attrs["components"] = " ".join(about.components)
    return data


@lru_cache(maxsize=64)
def _space_of(shape: tuple[int, ...]) -> h5py.h5s.SpaceID:
    """Dataspace of arrays of this shape in memory; most rows have one of a few shapes."""
    return h5py.h5s.create_simple(shape)
