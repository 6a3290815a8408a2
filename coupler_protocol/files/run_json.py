"""run.json: scene, machine, versions, end of a run and where its time went."""

import json
import logging
import os
import platform
import sys
import time
from collections.abc import Sequence
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from coupler_protocol import exits
from coupler_protocol.files.room import not_written

Rows = Sequence[dict[str, Any]]

log = logging.getLogger(__name__)
NAME, EARLIER = "run.json", "run.earlier.json"
ROOM = 1 << 16  # bytes that are kept for run.json while a run computes
LIBRARIES = ("colluvium", "numpy", "numba", "scipy", "pyzmq", "msgpack", "h5py", "isal", "pydantic")


def describe(scene: Any) -> dict[str, Any]:
    """Content of run.json that is known at the start."""
    return {
        "title": scene.title,
        "scene_hash": scene.digest(),
        "seed": scene.seed,
        "versions": {"python": platform.python_version()} | {name: _version(name) for name in LIBRARIES},
        "cpu": processor(),
        "host": platform.node(),
        "start": now(),
    }


def now() -> str:
    """Time of day, with its zone."""
    return time.strftime("%Y-%m-%dT%H:%M:%S%z")


def history_content(out: Path, plugin: Any) -> dict[str, Any]:
    """Content of run.json about earlier attempts at the run in the folder `out`, and about the user's functions that it calls.

    The run.json of the last attempt gets another name.
    """
    about = {} if plugin is None else {"plugin": plugin.name}
    set_aside(out)
    return about | ({"attempts": _attempts(read(out / EARLIER))} if (out / EARLIER).exists() else {})


def read(path: str | Path) -> dict[str, Any]:
    """The content of a run.json; raises EnvironmentFailed where it is not one."""
    content = _object(Path(path), _WITHOUT)
    if not _are_objects(content.get("stages", [])):
        raise exits.EnvironmentFailed(f"{path} is not what a run writes there. {_WITHOUT}")
    return content


_WITHOUT = "Remove it: resume and open_run need only the other files of the run"
_AGAIN = "Remove it and search again: colluvium fos SCENE --out DIR --force"


def read_search(path: str | Path) -> dict[str, Any]:
    """The content of a fos.json of one search; raises EnvironmentFailed where it is not one."""
    content = _object(Path(path), _AGAIN)
    meshes = content.get("meshes")
    whole = _are_objects(meshes) and meshes and all(_are_objects(m.get("trials")) and "zone_size" in m for m in meshes)
    if not whole or not isinstance(content.get("quantity"), str):
        raise exits.EnvironmentFailed(f"{path} is not what a search for a factor writes there. {_AGAIN}")
    return content


def _are_objects(rows: Any) -> bool:
    return isinstance(rows, list | tuple) and all(isinstance(row, dict) for row in rows)


def _object(path: Path, remedy: str) -> dict[str, Any]:
    """The object in a JSON file of results; raises EnvironmentFailed for a file that is not JSON, or not an object."""
    try:
        content = json.loads(path.read_text(encoding="utf-8-sig"))
    except ValueError as error:  # of the text's encoding, or of JSON
        raise exits.EnvironmentFailed(f"{path} is damaged: {error}. {remedy}") from None
    if not isinstance(content, dict):
        raise exits.EnvironmentFailed(f"{path} is not what a run writes there. {remedy}")
    return content


def _attempts(earlier: dict[str, Any]) -> list[dict[str, Any]]:
    """The attempts listed in run.json `earlier`, and `earlier` itself."""
    kept = ("start", "end", "seconds", "exit_code", "reason", "plugin", "warnings")
    return [*earlier.get("attempts", []), {key: earlier[key] for key in kept if key in earlier}]


def set_aside(out: str | Path) -> None:
    """Renames run.json before a run continues in the folder `out`; its content is kept for `attempts`."""
    path = Path(out) / NAME
    if path.exists():
        read(path)  # a damaged one is refused while it still has its name
        path.replace(Path(out) / EARLIER)


def keep_room(out: str | Path) -> None:
    """Occupies room for run.json, so that a disk that becomes full still takes it."""
    path = Path(out) / NAME
    try:
        _new(path).write_bytes(b" " * ROOM)
    except OSError as error:
        _new(path).unlink(missing_ok=True)
        raise not_written(path, "the account of the run", ROOM, error) from error


def _new(path: Path) -> Path:
    """Under which name a file is written before it gets its own."""
    return path.with_suffix(path.suffix + ".new")


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "?"


def processor() -> str:
    """Name of the processor."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        return next(line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()


def peak_memory() -> float:
    """Largest resident memory of this process so far [MB]; 0 if the system does not provide it."""
    try:
        import resource
    except ImportError:
        return 0.0
    unit = 1 if sys.platform == "darwin" else 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit / 1e6


def write_json(path: str | Path, content: Any) -> None:
    """Writes JSON to a new file, into the room kept for it, and renames it, so that a reader never gets half of the file."""
    path = Path(path)
    new, text = _new(path), (json.dumps(content, indent=1) + "\n").encode()
    try:
        with open(new, "r+b" if new.exists() else "wb") as file:
            file.write(text)
            file.truncate()
            file.flush()
            os.fsync(file.fileno())  # else a power cut could leave the new name without the content
        os.replace(new, path)
    except OSError as error:
        new.unlink(missing_ok=True)
        raise not_written(path, "the file", len(text), error) from error


def write(out: str | Path, content: dict[str, Any]) -> None:
    """Writes run.json into the folder `out`; a deviation from its schema is a fault of this program and is logged."""
    write_json(Path(out) / NAME, content)
    for problem in misfits(content):
        log.error("run.json: %s", problem)


def misfits(content: dict[str, Any]) -> list[str]:
    """Deviations of the content of a run.json from coupler_protocol.files.run_schema.RunJson, one text each."""
    from pydantic import ValidationError

    from coupler_protocol.files.run_schema import RunJson

    try:
        RunJson.model_validate(content)
    except ValidationError as error:
        return [f"{'.'.join(map(str, found['loc']))}: {found['msg']}" for found in error.errors()]
    return []


def name_the_cause(path: str | Path, code: int) -> None:
    """Replaces exit code PEER in run.json by `code`, that of the other side's failure."""
    path = Path(path)
    content = read(path) if path.exists() else {}
    if content.get("exit_code") == exits.PEER:
        write(path.parent, content | {"exit_code": code})


def stage_rows(results: Rows, continuum: Rows, discrete: Sequence[Rows]) -> list[dict[str, Any]]:
    """Rows of `stages` in run.json: outcome and seconds of each stage. discrete: one list of stage times for each rank.

    The waiting time of the grid is the time of packing in `fill`, and the wait for forces in coupled stages.
    """
    rows = []
    for result, times in zip(results, continuum, strict=True):
        seconds = {"continuum": times["computing"], "waiting": times["waiting"], "recording": times["recording"]}
        same = [t for rank in discrete for t in rank if t["name"] == times["name"]]
        seconds["discrete"] = max((t["computing"] for t in same), default=0.0)
        seconds["waiting_discrete"] = max((t["waiting"] for t in same), default=0.0)
        seconds["recording_discrete"] = max((t["recording"] for t in same), default=0.0)
        plain = _plain_steps(same) if "plain_steps" in result else {}
        rows.append(result | plain | {"seconds": {key: round(value, 4) for key, value in seconds.items()}})
    return rows


def _plain_steps(times: Rows) -> dict[str, list[Any]]:
    """Plain steps of the discs in a stage, and why there were none, by window."""
    found: dict[str, list[Any]] = {"plain_steps_discrete": [int(t.get("plain_steps", 0)) for t in times]}
    reasons = [str(t.get("one_by_one", "")) for t in times]
    return found | ({"one_by_one_discrete": reasons} if any(reasons) else {})


def stage_rows_alone(results: Rows, times: Rows) -> list[dict[str, Any]]:
    """The same rows for discs without a grid; times: of the same stages, and of one more if it did not reach its end."""
    rows = []
    for result, spent in zip(results, times, strict=False):
        seconds = dict.fromkeys(("continuum", "waiting", "recording", "waiting_discrete"), 0.0)
        seconds |= {"discrete": spent["computing"], "recording_discrete": spent["recording"]}
        rows.append(result | {"seconds": {key: round(value, 4) for key, value in seconds.items()}})
    return rows
