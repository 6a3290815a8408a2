"""This machine: versions, cores, compiled kernels, disk, clock and names."""

import os
import platform
import shutil
import socket
import tempfile
import time
from collections.abc import Iterator
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from colluvium.doctor.findings import LOOK, OK, WRONG, Finding
from coupler_protocol.exits import EnvironmentFailed
from coupler_protocol.files import locks
from coupler_protocol.files.room import megabytes
from coupler_protocol.files.run_json import LIBRARIES

SMALL, FULL = 2e9, 2e8  # free bytes of the disk from which a run is doubted, and from which it fails
SERVERS = ("dem_server", "fdm_server")


def versions() -> Iterator[Finding]:
    """Yields one line with all versions, and one for each library that is missing."""
    found = {"python": platform.python_version()}
    for name in LIBRARIES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            yield Finding(WRONG, "versions", f"{name} is not installed", f"pip install {name}, or install colluvium again")
    found |= _inner_versions()
    yield Finding(OK, "versions", ", ".join(f"{name} {number}" for name, number in found.items()))


def _inner_versions() -> dict[str, str]:
    """Versions of the libraries in C below ours."""
    import h5py
    import zmq

    return {"libzmq": zmq.zmq_version(), "hdf5": h5py.version.hdf5_version}


def cores() -> Iterator[Finding]:
    """Yields the cores that this process may use, and the load."""
    count = os.cpu_count() or 1
    mine = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else count
    quota = cgroup_limit()
    usable = min(mine, quota or mine)
    text = f"{mine} of {count} cores may be used" + (f", limited to {quota:g} by a control group" if quota else "")
    if usable < 2:
        remedy = "both sides on this machine would take turns; use two machines, or allow 2 cores"
        yield Finding(LOOK, "cores", text, remedy)
    else:
        yield Finding(OK, "cores", f"{text}; each server takes 1 unless --threads says more")
    load = os.getloadavg()[0]
    if load > usable:
        yield Finding(
            LOOK, "load", f"{load:.1f} processes compete for them", "steps of a coupled run wait for each other: stop others"
        )
    else:
        yield Finding(OK, "load", f"{load:.1f}")


def cgroup_limit(root: str | Path = "/sys/fs/cgroup") -> float | None:
    """Cores that a control group (versions 2 and 1) allows; None without a limit."""
    try:
        quota, period = (Path(root) / "cpu.max").read_text(encoding="ascii").split()
    except (OSError, ValueError):
        try:
            quota, period = ((Path(root) / f"cpu/cpu.cfs_{name}_us").read_text(encoding="ascii") for name in ("quota", "period"))
        except OSError:
            return None
    return None if quota == "max" or float(quota) <= 0 else float(quota) / float(period)


def kernels() -> Iterator[Finding]:
    """Yields the folder of compiled kernels of each server: whether it can be written, and what is there."""
    from coupler_protocol.compiled.jit import cache_folder

    for package in SERVERS:
        folder = Path(cache_folder(package))
        if why := not_writable(folder):
            remedy = "every run compiles again; name a folder in NUMBA_CACHE_DIR"
            yield Finding(LOOK, "kernels", f"{folder} cannot be written ({why})", remedy)
            continue
        files = [path for path in folder.rglob("*") if path.is_file()]
        compiled = sum(path.suffix == ".nbc" for path in files)
        size = megabytes(sum(path.stat().st_size for path in files))
        if compiled:
            yield Finding(OK, "kernels", f"{compiled} of {package}, {size}, in {folder}")
        else:
            remedy = "the first run compiles them, which takes a minute; later runs do not"
            yield Finding(LOOK, "kernels", f"none of {package} in {folder}", remedy)


def not_writable(folder: Path) -> str:
    """Why a folder, or the nearest one above it that exists, cannot be written; "" if it can."""
    while not folder.exists() and folder != folder.parent:
        folder = folder.parent
    try:
        with tempfile.TemporaryFile(dir=folder):
            return ""
    except OSError as error:
        return error.strerror or str(error)


def disk(folder: Path) -> Iterator[Finding]:
    """Yields room and permission of a run directory, and whether a process writes there."""
    if why := not_writable(folder):
        yield Finding(WRONG, "disk", f"{folder} cannot be written ({why})", "choose another --out")
        return
    there = next(path for path in (folder, *folder.absolute().parents) if path.exists())
    free = shutil.disk_usage(there).free
    level = WRONG if free < FULL else LOOK if free < SMALL else OK
    yield Finding(
        level, "disk", f"{megabytes(free)} are free for {folder}", "" if level == OK else "make room, or choose another --out"
    )
    try:
        locks.refuse_all(folder)
    except EnvironmentFailed as error:
        yield Finding(LOOK, "folder", str(error))


def clock() -> Iterator[Finding]:
    """Yields the time of this machine in UTC."""
    now = time.time()
    text = time.strftime("%Y-%m-%d %H:%M:%S UTC", time.gmtime(now))
    if now < 1.7e9:  # 2023-11: before this version existed
        yield Finding(LOOK, "clock", text, "the clock is wrong: set it, or switch its synchronisation on")
    else:
        yield Finding(OK, "clock", text)


def names() -> Iterator[Finding]:
    """Yields name and addresses of this machine, as others may use them."""
    host = socket.gethostname()
    try:
        found = sorted({str(row[4][0]) for row in socket.getaddrinfo(host, None, type=socket.SOCK_STREAM)})
    except OSError as error:
        yield Finding(
            LOOK, "name", f"{host} has no address ({error.strerror})", "give others an address of this machine, not its name"
        )
        return
    text = f"{host} has the addresses {', '.join(found)}"
    if all(address.startswith("127.") or address == "::1" for address in found):
        yield Finding(LOOK, "name", text, "others cannot use them: give them the address of the network card")
    else:
        yield Finding(OK, "name", text)
