"""quick_slope.toml cut short, its two servers started by hand, and how far they are."""

import subprocess
import time
from pathlib import Path

import h5py

from coupler_protocol.scene import rest
from tests.commands import command

SHORT = (
    "stage.0.until.steps=400",
    "stage.2.handover=100",
    "stage.2.until.steps=200",
    "stage.3.gravity_factor.over=100",
    "stage.3.until.steps=150",
    "record.every=50",
)
STONES = (
    "discs.radius=0.045",
    "stones={content=0.4,size={mean=0.25,sigma=0.35,min=0.15,max=0.6},gap=0.02}",
    "discs.stone={density=2700.0,spring={normal=5e8,shear=5e8},friction={coefficient=1.0},bond={tension=1e6,shear=1e6}}",
)
IMPATIENT = ("link.give_up=3.0", "link.timeout=1.0")  # only where a peer is lost: a busy machine may be silent for seconds
LONG = ("stage.3.until.steps=10000000", "stage.3.until.ratio=1e-12")
FILES = ("fdm.rank0.vtkhdf", "dem.rank1.vtkhdf", "fdm.rank0.overload.h5", "dem.rank1.overload.h5")


def overrides(*more):
    return [word for pair in (*SHORT, *more) for word in ("--set", pair)]


def start_servers(scene, fdm_out, dem_out, *more):
    """Both servers by hand, as in two shells."""
    options = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    extra = overrides(*more)
    fdm = subprocess.Popen(
        command("fdm_server", scene, "--bind", "tcp://127.0.0.1:0", "--out", fdm_out, "--quiet", *extra), **options
    )
    dem = subprocess.Popen(
        command("dem_server", scene, "--connect", fdm_out / "endpoint", "--rank", 1, "--out", dem_out, "--quiet", *extra),
        **options,
    )
    return fdm, dem


def wait_for(condition, seconds, what):
    """Wait until condition() holds."""
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline, f"waited {seconds} s for {what}"
        time.sleep(0.05)


def coupled_frames(path):
    """Frames a discrete process has written so far."""
    try:
        with h5py.File(path, "r", locking=False) as file:
            return int(file["VTKHDF/Steps"].attrs["NSteps"])
    except (OSError, KeyError):
        return 0


def watched(info):
    """Warnings of the watches in the content of a run.json; that a short run did not come to rest is not theirs."""
    return [warning for warning in info.get("warnings", []) if warning["name"] != rest.NAME]


def end(*processes):
    for process in processes:
        if process.poll() is None:
            process.kill()
        process.communicate()


def children_of(pid):
    """Process ids of the children of a process, from /proc."""
    found = []
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                status = (entry / "stat").read_text().rpartition(")")[2].split()
            except OSError:
                continue
            if int(status[1]) == pid:
                found.append(int(entry.name))
    return found


def alive(pid):
    try:
        return (Path("/proc") / str(pid) / "stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False
