"""Locks on a run directory: while a process writes the files of a name there, no other process may.

`NAME.lock` says in JSON which process that is: host, number, when it began, and which start of the machine. Its time of
modification is the heartbeat. A lock is stale if its process is gone: on this machine if there is no process with that number and
that beginning, on another one if the heartbeat is older than SILENT seconds, by the clock of the file system. A stale lock is
replaced.
"""

import json
import os
import platform
import secrets
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any

from coupler_protocol.exits import EnvironmentFailed
from coupler_protocol.files.room import not_written

BEAT, SILENT = 10.0, 120.0  # seconds between heartbeats, and until a process of another machine is taken for dead
ENDING = "lock"


@contextmanager
def held(folder: str | Path, names: Sequence[str]) -> Iterator[None]:
    """Holds the locks of these names; raises EnvironmentFailed where another process holds one."""
    with ExitStack() as stack:
        for name in names:
            stack.enter_context(_held(Path(folder) / f"{name}.{ENDING}"))
        yield


@contextmanager
def _held(path: Path) -> Iterator[None]:
    own = json.dumps(this_process() | {"key": secrets.token_hex(8)}).encode()
    for _ in range(5):
        if _create(path, own):
            break
        refuse(path)
        _remove_stale(path)
    else:
        raise EnvironmentFailed(f"{path} cannot be made: other processes make and remove it again and again")
    ended = threading.Event()
    beats = threading.Thread(target=_beat, args=(path, ended), name=f"lock {path.name}", daemon=True)
    beats.start()
    try:
        yield
    finally:
        ended.set()
        beats.join()
        with suppress(OSError):
            if path.read_bytes() == own:
                path.unlink()


def refuse(path: Path) -> None:
    """Raises EnvironmentFailed if a process that lives holds the lock at `path`."""
    holder = _holder(path)
    if holder is None:
        return
    who = f"process {holder.get('pid', '?')} on {holder.get('host', '?')}, since {holder.get('since', '?')}"
    raise EnvironmentFailed(
        f"{path.parent} is being written: {path.name.removesuffix('.' + ENDING)} is computed there by {who} "
        f"(last sign of life {holder['silent']:.0f} s ago). Wait for its end, stop it (Ctrl-C, or kill {holder.get('pid', '?')} "
        "there), or choose another --out"
    )


def is_held(folder: str | Path, name: str) -> bool:
    """Whether a process that lives holds the lock of this name; nothing is written for the answer."""
    path = Path(folder) / f"{name}.{ENDING}"
    try:
        return _holder(path, time.time) is not None
    except OSError:
        return False


def refuse_all(folder: str | Path, but: Sequence[str] = ()) -> None:
    """Raises EnvironmentFailed if a process that lives holds any lock in a folder, except those of the names `but`."""
    for path in sorted(Path(folder).glob(f"*.{ENDING}")):
        if path.name.removesuffix(f".{ENDING}") not in but:
            refuse(path)


def this_process() -> dict[str, Any]:
    """Identity of this process: machine, its present start, number of the process, and when it began."""
    since = time.strftime("%Y-%m-%d %H:%M:%S")
    pid = os.getpid()
    return {"host": platform.node(), "boot": _boot(), "pid": pid, "began": began(pid), "since": since}


def _holder(path: Path, now: Callable[[], float] | None = None) -> dict[str, Any] | None:
    """The process that holds a lock, with the seconds since its last heartbeat; None without a lock or for a stale one.

    now(): the time, by default that of the file system, for which a file is made for a moment.
    """
    try:
        text, beat = path.read_bytes(), path.stat().st_mtime
    except OSError:
        return None
    silent = max(0.0, (_time_of_files(path) if now is None else now()) - beat)
    try:
        found = json.loads(text)
        pid = int(found["pid"])
    except (ValueError, KeyError, TypeError):
        return {"silent": silent} if silent < BEAT else None  # it is being written, or was never completed
    if found.get("host") == platform.node() and os.name == "posix":  # elsewhere os.kill(pid, 0) ends processes
        alive = found.get("boot") == _boot() and is_alive(pid, found.get("began"))
    else:
        alive = silent < SILENT
    return found | {"silent": silent} if alive else None


def is_alive(pid: int, began_then: Any) -> bool:
    """Whether the process with this number lives on this machine, and is the one that began then."""
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except OSError:
        pass  # it lives, and is of another user
    now = began(pid)
    if now is None and Path("/proc/self/stat").exists():
        return False  # a process that has ended, and whose parent has not taken note
    return now is None or began_then is None or now == began_then


def began(pid: int) -> str | None:
    """When a process of this machine began, in ticks since the start of the machine; None where the system does not say."""
    with suppress(OSError, IndexError):
        fields = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8", errors="replace").rpartition(")")[2].split()
        return None if fields[0] in "ZX" else fields[19]
    return None


def _boot() -> str:
    """Identity of the present run of this machine; "" where the system does not say."""
    with suppress(OSError):
        return Path("/proc/sys/kernel/random/boot_id").read_text(encoding="ascii").strip()
    return ""


def _time_of_files(path: Path) -> float:
    """The present time by the clock of the file system, which may be that of another machine."""
    probe = path.with_name(f".{path.name}.{secrets.token_hex(8)}")
    try:
        probe.touch()
        return probe.stat().st_mtime
    except OSError:
        return time.time()
    finally:
        with suppress(OSError):
            probe.unlink()


def _create(path: Path, content: bytes) -> bool:
    """Makes a lock with its content; returns False where there is one."""
    try:
        descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666)
    except FileExistsError:
        return False
    except OSError as error:
        raise EnvironmentFailed(f"cannot write to {path.parent}: {error}") from None
    try:
        with os.fdopen(descriptor, "wb") as file:
            file.write(content)
    except OSError as error:
        path.unlink(missing_ok=True)
        raise not_written(path, "the lock", len(content), error) from error
    return True


def _remove_stale(path: Path) -> None:
    """Removes a stale lock. It is renamed first: of several processes that find it stale, one gets it."""
    aside = path.with_name(f".{path.name}.{secrets.token_hex(8)}")
    with suppress(OSError):
        os.rename(path, aside)
        if _holder(aside) is not None and not path.exists():  # another process was faster, and this is its new lock
            with suppress(OSError):
                os.link(aside, path)
        aside.unlink()


def _beat(path: Path, ended: threading.Event) -> None:
    while not ended.wait(BEAT):
        with suppress(OSError):
            os.utime(path)
