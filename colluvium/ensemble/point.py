"""One point of a sweep, computed by a worker: a run in the folder of its scene, and the quantities read from it.

A run that ended by a fault of physics after the slope had failed (discs that left the ring, inverted zones) has its failure
gravity all the same, which its frames show; `ended` says how it ended. A point that is done is not computed again. One that was
interrupted, or whose worker was killed, goes on from its last checkpoint; one that failed is tried once more, from its last
checkpoint too if it has one.
"""

import contextlib
import json
import os
import time
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

from colluvium.accuracy.quantity import FACTOR, quantity_of, value_of
from colluvium.running import processes, searches
from coupler_protocol import exits
from coupler_protocol.files import locks, run_json
from coupler_protocol.scene.reader import build_scene, read_scene

RESULT, SCENE, STOP = "point.json", "point.toml", "stop"
SEARCH = "fos"  # folder of the search for a factor, in that of the point
FAILURE = "failure_gravity"
TRIES = 2
PATIENCE = 60.0  # [s] for the end of processes whose worker was killed, and which still write to the folder
Told = dict[str, Any]


class Job(NamedTuple):
    """What a worker needs: plain scene, quantities, folder, where the point branches off, and the version that asks.

    root: folder of the sweep; a file `stop` there ends all points. origin: DIR@STAGE, or "".
    """

    name: str
    tables: dict[str, Any]
    quantities: tuple[str, ...]
    root: str
    folder: str
    origin: str
    version: str


class OtherVersionError(RuntimeError):
    """A worker has another version of this project."""


def compute(job: Job) -> Told:
    """The result of a point: `values` {quantity: [value, half width]}, `lacking` {quantity: why}, steps, seconds, `failed`."""
    if job.version != version("colluvium"):
        raise OtherVersionError(f"this worker has colluvium {version('colluvium')}, the sweep {job.version}: install the same")
    folder, scene = Path(job.folder), build_scene(job.tables)
    digest = scene.digest()
    if known := finished(folder, digest, job.quantities):
        return known
    folder.mkdir(parents=True, exist_ok=True)
    (folder / SCENE).write_text(processes.as_toml(job.tables), encoding="utf-8")
    begin = time.monotonic()
    found: Told = {"scene": digest, "tries": 0, "values": {}, "lacking": {}, "failed": "", "code": exits.DONE}
    runs = tuple(text for text in job.quantities if text != FACTOR)
    if runs:
        _tried(job, found, lambda: _is_known(folder, digest, runs), lambda: _run(job, scene, folder))
        if _is_known(folder, digest, runs):
            found |= _cost(folder)
            _read(folder, scene, runs, found)
            if not _is_done(folder, digest):
                found["ended"] = _why(folder, found["code"])
        else:
            found["failed"] = _why(folder, found["code"])
    if FACTOR in job.quantities and not found["failed"]:
        _search(job, folder, found)
    found["wall"] = time.monotonic() - begin
    _write(folder / RESULT, found)
    return found


def finished(folder: Path, digest: str, quantities: tuple[str, ...]) -> Told | None:
    """The stored result of a point that is done and has all quantities, or None; failed points are not done."""
    with contextlib.suppress(OSError, ValueError):
        found: Told = json.loads((folder / RESULT).read_text(encoding="utf-8"))
        known = found.get("values", {}).keys() | found.get("lacking", {}).keys()
        if found.get("scene") == digest and not found.get("failed") and known >= {*quantities}:
            return found
    return None


def _tried(job: Job, found: Told, done: Callable[[], bool], work: Callable[[], int]) -> None:
    """Calls work() until done(), TRIES times at most; raises Interrupted when the sweep is stopped."""
    tries = 0
    while not done() and tries < TRIES:
        tries += 1
        _wait_until_free(Path(job.folder))
        found["code"] = work()
        if found["code"] == exits.INTERRUPTED or _stopped(job):
            raise exits.Interrupted("interrupted: the same command continues")
    found["tries"] = max(found["tries"], tries)


def _search(job: Job, folder: Path, found: Told) -> None:
    """Searches for the factor of safety of a point, on grid and discs where its scene couples them."""
    out, code = folder / SEARCH, [exits.RunEnded.code]

    def work() -> int:
        code[0] = searches.run(folder / SCENE, out, lambda: _stopped(job))
        return code[0]

    _tried(job, found, lambda: code[0] == exits.DONE, work)
    if code[0] == exits.DONE:
        found["values"][FACTOR] = list(searches.value_of(out))
    else:
        found["failed"] = f"the search for the factor ended with code {code[0]}: {exits.MEANING.get(code[0], '?')}"


def _run(job: Job, scene: Any, folder: Path) -> int:
    """Computes the run of a point, or goes on with it; returns the exit code."""
    options = ["--quiet"]
    if _hash(folder) != scene.digest():
        options.append("--force")
        if job.origin and _branches(job.origin):
            options.append(f"--from={job.origin}")
    return processes.run_files(folder / SCENE, folder, processes.windows_of(scene), options, asked=lambda: _stopped(job))


def _branches(origin: str) -> bool:
    """Whether the run that a point branches off has saved the end of the stage."""
    folder, _, stage = origin.rpartition("@")
    return (Path(folder) / f"fdm.rank0.{stage}.h5").is_file()


def _read(folder: Path, scene: Any, quantities: tuple[str, ...], found: Told) -> None:
    """Reads the quantities of a finished run."""
    for text in quantities:
        try:
            value = _failure(folder) if text == FAILURE else value_of(quantity_of(text, scene), folder)
        except LookupError as error:
            found["lacking"][text] = str(error)
        else:
            found["values"][text] = list(value)


def _failure(folder: Path) -> tuple[float, float]:
    """(gravity factor at which the slope fails, half the distance of the frames it lies between); raises LookupError."""
    from colluvium.accuracy.measured import failure_gravity
    from colluvium.results.run import open_run

    with open_run(folder) as run:
        return failure_gravity(run)


def _is_done(folder: Path, digest: str) -> bool:
    with contextlib.suppress(OSError, ValueError, exits.RunEnded):
        info = run_json.read(folder / run_json.NAME)
        return bool(info.get("scene_hash") == digest and info.get("exit_code") == exits.DONE)
    return False


def _is_known(folder: Path, digest: str, runs: tuple[str, ...]) -> bool:
    """Whether a run has the quantities: at its end, or after the slope had failed if only that is asked."""
    return _is_done(folder, digest) or (runs == (FAILURE,) and _had_failed(folder, digest))


def _had_failed(folder: Path, digest: str) -> bool:
    """Whether a run ended by a fault of physics after a frame in which the slope had failed."""
    with contextlib.suppress(OSError, ValueError, LookupError, exits.RunEnded):
        info = run_json.read(folder / run_json.NAME)
        if info.get("scene_hash") == digest and info.get("exit_code") == exits.PHYSICS:
            return _failure(folder)[0] > 0.0
    return False


def _hash(folder: Path) -> str:
    """Hash of the scene that was begun in a folder, "" where there is none."""
    with contextlib.suppress(OSError, ValueError, exits.RunEnded):
        return str(read_scene(folder / "scene.json").digest())
    return ""


def _cost(folder: Path) -> Told:
    """Steps and seconds of all attempts at a finished run."""
    info = run_json.read(folder / run_json.NAME)
    return {"steps": sum(int(stage["steps"]) for stage in info["stages"]), "seconds": float(info.get("seconds") or 0.0)}


def _why(folder: Path, code: int) -> str:
    """Why a run failed, in words."""
    reason = ""
    with contextlib.suppress(OSError, ValueError, exits.RunEnded):
        reason = str(run_json.read(folder / run_json.NAME).get("reason") or "")
    return reason or f"exit code {code}: {exits.MEANING.get(code, '?')}"


def _wait_until_free(folder: Path, sleep: Callable[[float], None] = time.sleep) -> None:
    """Waits for the end of processes of a killed worker; raises EnvironmentFailed if they do not end."""
    until = time.monotonic() + PATIENCE
    while True:
        try:
            return locks.refuse_all(folder)
        except exits.EnvironmentFailed:
            if time.monotonic() > until:
                raise
            sleep(0.2)


def _stopped(job: Job) -> bool:
    return (Path(job.root) / STOP).exists()


def _write(path: Path, content: Told) -> None:
    """Replaces a file by its new content as a whole."""
    new = path.with_name(f"{path.name}.{os.getpid()}.new")
    new.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
    new.replace(path)
