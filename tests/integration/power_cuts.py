"""What a disk can have after a power cut, at every file operation of a run that computes in this process.

Bytes are on the disk for certain once `fsync` of their file has returned, and names once `fsync` of their folder has. Everything
since then may be there, not be there, or be there in part. `Disk` notes, before every fsync, rename and removal in a folder, what
of each file is certain and what is there for processes; `states` makes of that what a machine can find when it starts again.
"""

import os
import random
import threading
from pathlib import Path
from typing import NamedTuple

import pytest

from coupler_protocol.files import locks, undo_log

PAGE = 4096  # bytes that reach the disk together


class Content:
    """Bytes of one file, whatever its name: certain ones (None: no fsync so far)."""

    def __init__(self):
        self.certain = None


class Cut(NamedTuple):
    """A moment before a file operation: files by name as processes see them, and as the disk has them for certain.

    Each file is (bytes now, certain bytes or None).
    """

    before: str
    names: dict
    certain_names: dict


class Disk:
    """Notes `cuts` of a folder of plain files while it is a context."""

    def __init__(self, folder):
        self.folder, self.cuts = Path(folder), []
        self._contents, self._names = {}, {}  # Content by inode, and by the names that are certain
        self._last = {}  # bytes that a removed file had, by its Content
        self._one_at_a_time = threading.RLock()
        self._patch = pytest.MonkeyPatch()

    def __enter__(self):
        """Notes from now on; the machine's start counts as an earlier one than that of later runs."""
        self._patch.setattr(locks, "boot_id", lambda: "an earlier start")
        fsync, replace, rename, unlink = os.fsync, os.replace, os.rename, os.unlink

        def noting_fsync(descriptor):
            path = Path(os.readlink(f"/proc/self/fd/{descriptor}"))
            with self._one_at_a_time:
                if path == self.folder:
                    self._note("fsync of the folder")
                    self._names = {name: self._content(name) for name in os.listdir(self.folder)}
                elif path.parent == self.folder:
                    self._note(f"fsync of {path.name}")
                    self._content(path.name).certain = path.read_bytes()
                fsync(descriptor)

        def noted(call, word):
            def noting(first, *more):
                path = Path(first)
                with self._one_at_a_time:
                    if path.parent == self.folder:
                        self._note(f"{word} of {path.name}")
                        for gone in more if word == "rename" else [first]:
                            self._forget(Path(gone).name)
                    return call(first, *more)

            return noting

        self._patch.setattr(os, "fsync", noting_fsync)
        self._patch.setattr(os, "replace", noted(replace, "rename"))
        self._patch.setattr(os, "rename", noted(rename, "rename"))
        self._patch.setattr(os, "unlink", noted(unlink, "removal"))
        return self

    def __exit__(self, *_):
        self._patch.undo()

    def _content(self, name):
        """The Content of a file in the folder."""
        return self._contents.setdefault(os.stat(self.folder / name).st_ino, Content())

    def _forget(self, name):
        """Notes the bytes of a file that loses its last name: the disk may still have it."""
        if (self.folder / name).exists():
            found = self._content(name)
            self._last[found] = (self.folder / name).read_bytes()
            del self._contents[os.stat(self.folder / name).st_ino]

    def _note(self, what):
        names, now = {}, {}
        for name in sorted(os.listdir(self.folder)):
            content = self._content(name)
            now[content] = (self.folder / name).read_bytes()
            names[name] = (now[content], content.certain)
        certain = {name: (now.get(c, self._last.get(c)), c.certain) for name, c in self._names.items()}
        self.cuts.append(Cut(what, names, certain))


def nothing_more(now, certain, chance):
    """Bytes of a file of which only the certain ones reached the disk."""
    return certain or b""


def zeros(now, certain, chance):
    """The same, but with the length of the file: what is not there reads as zeros."""
    certain = certain or b""
    return certain + bytes(max(0, len(now) - len(certain)))


def torn(now, certain, chance):
    """Pages of the bytes now, or of the certain ones."""
    pages = range(0, len(now), PAGE)
    old = zeros(now, certain, chance)
    return b"".join((now if chance.random() < 0.5 else old)[at : at + PAGE] for at in pages)[: len(now)]


def all_of_it(now, certain, chance):
    """The bytes now."""
    return now


KINDS = {  # whether the names are those of now, and what of the bytes is there
    "nothing since the last fsync": (False, nothing_more),
    "new names, old bytes": (True, zeros),
    "new names, torn bytes": (True, torn),
    "old names, new bytes": (False, all_of_it),
}


def states(cuts, seed=0, side=""):
    """Yields (what it is, {name: bytes}) of all different folders that a machine can find after the cuts.

    side: beginning of the names of the files of the machine that lost its power. The process of the other machine has ended and
    closed its files, which are as it saw them.
    """
    seen = set()
    for number, cut in enumerate(cuts):
        for kind, (named, bytes_of) in KINDS.items():
            chance = random.Random(f"{seed} {number} {kind}")
            there = cut.names if named else cut.certain_names
            state = {name: bytes_of(*file, chance) for name, file in there.items() if name.startswith(side)}
            state |= {name: now for name, (now, _) in cut.names.items() if not name.startswith(side) and _stays(name)}
            key = tuple(sorted((name, hash(data)) for name, data in state.items() if not name.endswith(locks.ENDING)))
            if key not in seen:
                seen.add(key)
                yield f"before {cut.before}: {kind}", state


def _stays(name):
    """Whether a file is still there after its process has ended."""
    return not name.endswith((locks.ENDING, undo_log.ENDING))


def found_after_start(folder, state):
    """Makes the folder as a machine that has just been started finds it."""
    folder.mkdir()
    for name, data in state.items():
        path = folder / name
        path.write_bytes(data)
        os.utime(path, (1e9, 1e9))
