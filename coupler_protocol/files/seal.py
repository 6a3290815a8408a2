"""A seal on a checkpoint: its first bytes give its length and a hash of all others, so that damage is found before it is read.

HDF5 must not see a damaged file: it may return other numbers without an error, or never return. So the hash is one of raw bytes.
The seal lies in what HDF5 calls a user block, which every reader of HDF5 skips: three lines of text, filled up with zero bytes.

    colluvium checkpoint, seal 1
    bytes 48240
    blake2b 8f1c..                       of all bytes after the seal, 32 bytes in hexadecimal digits
"""

import hashlib
import os
from functools import partial
from pathlib import Path

ROOM = 512  # bytes of the seal; HDF5 takes 512, 1024, 2048, ..
TITLE = b"colluvium checkpoint, seal 1\n"
HDF5 = b"\x89HDF\r\n\x1a\n"  # first bytes of a file of HDF5 without a user block
_hash = partial(hashlib.blake2b, digest_size=32)


def put_on(content: memoryview) -> None:
    """Seals the content of a file, whose first ROOM bytes are free."""
    content[:ROOM] = _text(len(content), _hash(content[ROOM:]).hexdigest())


def _text(length: int, digest: str) -> bytes:
    """The seal (ROOM bytes)."""
    return (TITLE + f"bytes {length}\nblake2b {digest}\n".encode()).ljust(ROOM, b"\0")


def fault(path: str | Path) -> str:
    """What is wrong with a sealed file; "" where it has the bytes that were sealed. Raises OSError where it cannot be read."""
    with open(path, "rb") as file:
        found, length = file.read(ROOM), os.fstat(file.fileno()).st_size
        if found == _text(length, hashlib.file_digest(file, _hash).hexdigest()):
            return ""
    if not found:
        return "the file is empty"
    if found.startswith(HDF5):
        return "it has no seal: another program or an earlier version wrote it"
    lines = found.rstrip(b"\0").split(b"\n")
    if not found.startswith(TITLE) or not lines[1].startswith(b"bytes ") or not lines[1][6:].isdigit():
        return "it does not begin with the seal of a checkpoint"
    sealed = int(lines[1][6:])
    if sealed != length:
        return f"it has {length} bytes, and had {sealed} when it was written"
    return "its bytes are not those that were written (the hash differs)"
