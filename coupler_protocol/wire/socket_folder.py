"""Folders of Unix sockets: one for each end of a link, which only its user can enter, removed when the end is closed.

A process that is killed leaves its folder behind. It holds a lock on the file `alive` in it, which the system gives up with the
process, whatever its number and whoever shares the folder for temporary files; the next end that is made removes such folders.
"""

import contextlib
import fcntl
import os
import shutil
import stat
import tempfile
import time
from pathlib import Path

PREFIX, ALIVE = "colluvium-link-", "alive"
YOUNG = 60.0  # [s] in which a folder may not have its lock yet


class SocketFolder:
    """A new folder (mode 0700) at `path`. Removes those of ends of this user that were killed."""

    def __init__(self) -> None:
        remove_abandoned()
        self.path = tempfile.mkdtemp(prefix=PREFIX)
        self._lock = os.open(f"{self.path}/{ALIVE}", os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
        fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)

    def remove(self) -> None:
        """Removes the folder; a second call does nothing."""
        if self._lock >= 0:
            shutil.rmtree(self.path, ignore_errors=True)
            os.close(self._lock)
            self._lock = -1


def remove_abandoned() -> None:
    """Removes the folders of this user whose process has gone; without the file `alive` only empty ones."""
    for folder in Path(tempfile.gettempdir()).glob(f"{PREFIX}*"):
        with contextlib.suppress(OSError):
            about = folder.lstat()
            if stat.S_ISDIR(about.st_mode) and about.st_uid == os.geteuid() and time.time() - about.st_mtime > YOUNG:
                _remove_unheld(folder)


def _remove_unheld(folder: Path) -> None:
    """Removes a folder unless a process holds its lock; raises OSError where it cannot be removed."""
    try:
        lock = os.open(folder / ALIVE, os.O_RDWR | os.O_NOFOLLOW | os.O_CLOEXEC)
    except FileNotFoundError:
        folder.rmdir()
        return
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)  # BlockingIOError: its process lives
        shutil.rmtree(folder)
    finally:
        os.close(lock)
