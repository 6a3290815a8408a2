"""What is said where a file cannot be written, how a disk without room is told from other faults, and names on the disk."""

import errno
import os
import shutil
from pathlib import Path

from coupler_protocol.exits import EnvironmentFailed

FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)  # no room on the disk, beyond a quota, beyond the largest file allowed


def not_written(path: str | Path, what: str, size: int, error: OSError) -> EnvironmentFailed:
    """The end of a run because `what`, of `size` bytes, cannot be written to the file at `path`."""
    text = f"{what} cannot be written to {path}: {error.strerror or error}"
    if error.errno in FULL:
        text += f"; it needs {megabytes(size)}"
        free = None if error.errno == errno.EFBIG else disk_free(Path(path).parent)
        text += "" if free is None else f" and {megabytes(free)} are free"
        text += ". Make room; the same command then continues from the last checkpoint"
    return EnvironmentFailed(text)


def megabytes(size: int) -> str:
    """A number of bytes in MB, or in GB."""
    return f"{size / 1e6:.3g} MB" if size < 1e9 else f"{size / 1e9:.3g} GB"


def disk_free(folder: str | Path) -> int | None:
    """Free bytes of the disk of a folder; None where nobody says."""
    try:
        return shutil.disk_usage(folder).free
    except OSError:
        return None


def to_disk(folder: str | Path) -> None:
    """Makes the operating system write the names in a folder to the disk."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
