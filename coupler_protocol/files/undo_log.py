"""Bytes of a file as they were at its last fsync, kept beside it while a program overwrites them (a rollback journal).

After a power cut the disk has any of the pages written since the last fsync, and not the others: a file of HDF5 whose old pages
are overwritten in place is then neither what it was nor what it became. So a page goes to the log, with an fsync, before it is
overwritten for the first time since the last fsync of the file; later writes of the page need nothing. `roll_back` makes the
file what it was.

The log NAME.undo is a row of records: magic, the start of the machine, length of the file at its last fsync, where the page
begins, its length, CRC-32 of all this and the page, the page. A record that is not whole was being written: its page has not been
overwritten. Nothing is rolled back while the same start of the machine lasts: a kill of the process loses no page.
"""

import os
import struct
import zlib
from collections.abc import Iterable, Iterator
from pathlib import Path

from coupler_protocol.files import locks
from coupler_protocol.files.room import to_disk

ENDING, DAMAGED = ".undo", ".damaged"
PAGE = 4096
_HEAD = struct.Struct("<8s36sQQI")  # magic, start of the machine, length of the file, first byte of the page, its length
_CHECK = struct.Struct("<I")
_MAGIC = b"CLVMUNDO"


class UndoLog:
    """The log of a new file at `path`. Raises OSError where it cannot be written."""

    def __init__(self, path: Path) -> None:
        self._path = path.with_name(path.name + ENDING)
        self._certain = 0  # length of the file at its last fsync
        self._kept: set[int] = set()  # numbers of the pages in the log
        self._file = open(self._path, "w+b", buffering=0)  # noqa: SIM115 (closed by `close`)
        try:
            self._append(_record(0, 0, b""))
            to_disk(self._path.parent)
        except OSError:
            self.close()
            raise

    def keep(self, descriptor: int, ranges: Iterable[tuple[int, int]]) -> None:
        """Stores the pages of the open file that are about to change; ranges: first byte and number of bytes."""
        ends = [(begin, min(begin + length, self._certain)) for begin, length in ranges if length > 0]
        pages = {page for begin, end in ends for page in range(begin // PAGE, -(-end // PAGE))} - self._kept
        if pages:
            self._append(b"".join(self._page(descriptor, page * PAGE) for page in sorted(pages)))
            self._kept |= pages

    def _page(self, descriptor: int, begin: int) -> bytes:
        return _record(self._certain, begin, os.pread(descriptor, min(PAGE, self._certain - begin), begin))

    def _append(self, records: bytes) -> None:
        length = self._file.tell()
        try:
            view = memoryview(records)
            while view:
                view = view[self._file.write(view) :]
            os.fsync(self._file.fileno())
        except OSError:
            self._cut(length)  # what follows half of a record could not be read
            raise

    def _cut(self, length: int) -> None:
        self._file.seek(length)
        self._file.truncate()

    def forget(self, certain: int) -> None:
        """Notes an fsync of the file, whose length is `certain` bytes: its pages can be overwritten once more."""
        self._certain = certain
        self._kept.clear()
        self._cut(0)
        os.fsync(self._file.fileno())

    def close(self) -> None:
        """Removes the log: nothing more is written to the file, and all of it is on the disk."""
        self._file.close()
        self._path.unlink(missing_ok=True)


def _record(certain: int, begin: int, page: bytes) -> bytes:
    head = _HEAD.pack(_MAGIC, locks.boot_id().encode(), certain, begin, len(page))
    return head + _CHECK.pack(zlib.crc32(page, zlib.crc32(head))) + page


def _records(data: bytes) -> Iterator[tuple[bytes, int, int, bytes]]:
    """(start of the machine, length of the file, first byte of the page, page) of all whole records."""
    at = 0
    while len(data) - at >= _HEAD.size + _CHECK.size:
        head = data[at : at + _HEAD.size]
        magic, boot, certain, begin, length = _HEAD.unpack(head)
        at += _HEAD.size
        (check,) = _CHECK.unpack_from(data, at)
        page = data[at + _CHECK.size : at + _CHECK.size + length]
        at += _CHECK.size + length
        if magic != _MAGIC or len(page) < length or zlib.crc32(page, zlib.crc32(head)) != check:
            return
        yield boot.rstrip(b"\0"), certain, begin, page


def certain_content(path: Path) -> bytes | None:
    """What a file was at its last fsync, for who may not write; b"" without an fsync, None if it is whole as it is.

    It is not whole if it was being written on a machine that was started again since, or on another one.
    """
    records = _records_beside(path)
    if not records or records[0][0] == locks.boot_id().encode():
        return None
    content, length = bytearray(path.read_bytes()), records[0][1]
    for _, _, begin, page in records:
        content[begin : begin + len(page)] = page
    return bytes(content[:length])


def _records_beside(path: Path) -> list[tuple[bytes, int, int, bytes]]:
    """Whole records of the log of a file."""
    log = path.with_name(path.name + ENDING)
    return list(_records(log.read_bytes())) if log.exists() else []


def roll_back(path: Path) -> str:
    """Makes a file what it was at its last fsync if the machine was started again since; returns what was done in words, or "".

    A file without an fsync, of which anything may be missing, gets another name: the ending .damaged.
    """
    records, here = _records_beside(path), locks.boot_id().encode()
    if not records or not path.exists() or (here and records[0][0] == here):
        return ""
    length = records[0][1]
    if length:
        with open(path, "r+b") as file:
            for _, _, begin, page in records:
                file.seek(begin)
                file.write(page)
            file.truncate(length)
            file.flush()
            os.fsync(file.fileno())
        done = "is as its last checkpoint needs it; later frames are computed again"
    else:
        aside = path.with_name(path.name + DAMAGED)
        os.replace(path, aside)
        done = f"was not yet on the disk, is {aside.name} now and does not count; its frames are computed again"
    to_disk(path.parent)
    path.with_name(path.name + ENDING).unlink()
    return f"the machine stopped while {path.name} was written: it {done}"
