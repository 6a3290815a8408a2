"""A file that goes from one whole content to the next, for HDF5, which leaves on a full disk whatever still had room.

HDF5 writes into memory. `commit` brings that to the disk in two steps:

1. What lies beyond the end of the file goes there in one piece. Where the disk has no room for it, the file is cut to its
   length: nothing has happened.
2. What replaces earlier bytes needs no room. It goes there in the order in which HDF5 wrote it, data before what points to them.
   Where that fails, the earlier bytes are put back.

So an error leaves the content of the last commit, and HDF5 does not notice errors at all. A kill during step 2 leaves what HDF5
itself would leave after a kill (vtkhdf.py says why frames survive that). A power cut leaves what `to_disk` brought to the disk
(undo_log.py). The file has its name from the first commit on.
"""

import os
from collections.abc import Iterator
from pathlib import Path

from coupler_protocol.files.room import not_written, to_disk
from coupler_protocol.files.undo_log import UndoLog


class WholeWrites:
    """What h5py.File takes in place of a path: a file object, empty at first."""

    def __init__(self, path: Path) -> None:
        self._path, self._partial = path, path.with_name(path.name + ".partial")
        try:
            self._undo = UndoLog(path)
            self._file = open(self._partial, "w+b", buffering=0)  # noqa: SIM115 (closed by `close`)
        except OSError as error:
            raise not_written(path, "the file", 0, error) from error
        self._named = False  # whether it has its name
        self._on_disk = 0  # bytes that are there
        self._size = 0  # bytes as HDF5 sees it
        self._position = 0
        self._pieces: list[tuple[int, bytes]] = []  # what is not there yet, in the order of writing: where it begins, its bytes

    # -- called by h5py ------------------------------------------------------------------------------------------------

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        """Goes to a place."""
        self._position = offset + {os.SEEK_SET: 0, os.SEEK_CUR: self._position, os.SEEK_END: self._size}[whence]
        return self._position

    def tell(self) -> int:
        """The present place."""
        return self._position

    def readinto(self, buffer: memoryview) -> int:
        """Fills a buffer from the present place on; zeros beyond the end."""
        view = memoryview(buffer)
        start, end = self._position, self._position + len(view)
        there = os.pread(self._file.fileno(), len(view), start)
        view[: len(there)] = there
        view[len(there) :] = bytes(len(view) - len(there))
        for begin, piece in self._pieces:
            first, last = max(start, begin), min(end, begin + len(piece))
            if first < last:
                view[first - start : last - start] = piece[first - begin : last - begin]
        self._position = end
        return len(view)

    def read(self, size: int = -1) -> bytes:
        """Bytes from the present place on."""
        found = bytearray(max(0, self._size - self._position) if size < 0 else size)
        self.readinto(memoryview(found))
        return bytes(found)

    def write(self, data: memoryview) -> int:
        """Keeps bytes until the next commit."""
        piece = bytes(data)
        self._pieces.append((self._position, piece))
        self._position += len(piece)
        self._size = max(self._size, self._position)
        return len(piece)

    def truncate(self, size: int) -> int:
        """Sets the length."""
        self._size = size
        return size

    def flush(self) -> None:
        """Does nothing: HDF5 does not decide when its bytes make sense."""

    # -- called by the owner -------------------------------------------------------------------------------------------

    def commit(self, what: str) -> None:
        """Brings everything to the disk; `what`: the new content in words, for the EnvironmentFailed of a full disk."""
        grown, replaced = self._sorted()
        try:
            self._undo.keep(self._file.fileno(), [*replaced, (self._size, self._on_disk - self._size)])
            self._put(self._on_disk, grown)
            self._replace(replaced)
            if self._size < self._on_disk:
                os.ftruncate(self._file.fileno(), self._size)
            if not self._named:
                os.replace(self._partial, self._path)
        except OSError as error:
            os.ftruncate(self._file.fileno(), self._on_disk)
            raise not_written(self._path, what, len(grown), error) from error
        self._named, self._on_disk = True, self._size
        self._pieces.clear()

    def to_disk(self) -> None:
        """Waits until the content of the last commit is on the disk, with the name of the file."""
        os.fsync(self._file.fileno())
        self._undo.forget(self._on_disk)
        to_disk(self._path.parent)

    def close(self) -> None:
        """Closes the file as the last commit left it, and waits until that is on the disk; one without a commit is gone."""
        if self._named:
            self.to_disk()
        self._file.close()
        self._undo.close()
        if not self._named:
            self._partial.unlink(missing_ok=True)

    def _sorted(self) -> tuple[bytearray, dict[tuple[int, int], bytes]]:
        """What lies beyond the end on the disk, and what replaces bytes there by (place, length), in the order of writing."""
        grown = bytearray(max(0, self._size - self._on_disk))
        replaced: dict[tuple[int, int], bytes] = {}
        for begin, whole in self._pieces:
            piece = whole[: max(0, self._size - begin)]
            inside = piece[: max(0, self._on_disk - begin)]
            if inside:
                replaced.pop((begin, len(inside)), None)  # written again: the last time counts
                replaced[begin, len(inside)] = inside
            if len(inside) < len(piece):
                place = begin + len(inside) - self._on_disk
                grown[place : place + len(piece) - len(inside)] = piece[len(inside) :]
        return grown, replaced

    def _replace(self, replaced: dict[tuple[int, int], bytes]) -> None:
        """Overwrites bytes, or leaves them as they were."""
        earlier = []
        try:
            for begin, piece in _joined(replaced):
                earlier.append((begin, os.pread(self._file.fileno(), len(piece), begin)))
                self._put(begin, piece)
        except OSError:
            for begin, piece in reversed(earlier):
                self._put(begin, piece)
            raise

    def _put(self, begin: int, data: bytes | bytearray) -> None:
        """Write all bytes of `data` at a place."""
        view = memoryview(data)
        while view:
            done = os.pwrite(self._file.fileno(), view, begin)
            begin, view = begin + done, view[done:]


def _joined(replaced: dict[tuple[int, int], bytes]) -> Iterator[tuple[int, bytes]]:
    """Yields the pieces (place, bytes) in their order, those that follow each other in the file too as one."""
    run, parts, end = 0, list[bytes](), -1
    for (begin, length), piece in replaced.items():
        if begin != end and parts:
            yield run, b"".join(parts)
            parts = []
        if not parts:
            run = begin
        parts.append(piece)
        end = begin + length
    if parts:
        yield run, b"".join(parts)
