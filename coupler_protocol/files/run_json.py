"""run.json: what was run, where, with which versions, how it ended and where the time went."""

import json
import logging
import os
import platform
import sys
import time
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from coupler_protocol import exits

log = logging.getLogger(__name__)
NAME, EARLIER = "run.json", "run.earlier.json"
LIBRARIES = ("colluvium", "numpy", "numba", "scipy", "pyzmq", "msgpack", "h5py", "pydantic")


def describe(scene):
    """The part of run.json that is known at the start."""
    return {
        "title": scene.title,
        "scene_hash": scene.digest(),
        "seed": scene.seed,
        "versions": {"python": platform.python_version()} | {name: _version(name) for name in LIBRARIES},
        "cpu": processor(),
        "host": platform.node(),
        "start": now(),
    }


def now():
    """Time of day, with its zone."""
    return time.strftime("%Y-%m-%dT%H:%M:%S%z")


def origin_content(out, origin, plugin):
    """What run.json says about where a run into the folder `out` begins, and about the functions of a user that it calls.

    A run that goes on in the folder of its origin lists in `attempts` how those before it ended.
    """
    about = {} if plugin is None else {"plugin": plugin.name}
    if origin is not None:
        about["begins_after"] = {"run": str(origin.folder), "stage": origin.stage}
        if origin.continues(out) and (out / EARLIER).exists():
            about["attempts"] = _attempts(json.loads((out / EARLIER).read_text(encoding="utf-8")))
    return about


def _attempts(earlier):
    """How the run that left `earlier` ended, after those before it."""
    kept = ("start", "end", "seconds", "exit_code", "reason", "plugin", "warnings")
    return [*earlier.get("attempts", []), {key: earlier[key] for key in kept if key in earlier}]


def set_aside(out):
    """Make room for the run.json of a run that goes on; what it says is kept for `attempts`."""
    path = Path(out) / NAME
    if path.exists():
        path.replace(Path(out) / EARLIER)


def _version(name):
    try:
        return version(name)
    except PackageNotFoundError:
        return "?"


def processor():
    """Name of the processor."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        return next(line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()


def peak_memory():
    """Largest resident memory of this process so far [MB]; 0 where the system does not tell."""
    try:
        import resource
    except ImportError:
        return 0.0
    unit = 1 if sys.platform == "darwin" else 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit / 1e6


def write_json(path, content):
    """Write JSON to a new file and rename it, so that a reader never sees half of it."""
    path = Path(path)
    new = path.with_suffix(path.suffix + ".new")
    new.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
    os.replace(new, path)


def write(out, content):
    """Write run.json into the folder `out`; what does not fit its schema is a fault of this program, and goes into the log."""
    write_json(Path(out) / NAME, content)
    for problem in misfits(content):
        log.error("run.json: %s", problem)


def misfits(content):
    """How the content of a run.json differs from what coupler_protocol.files.run_schema.RunJson declares, a text each."""
    from pydantic import ValidationError

    from coupler_protocol.files.run_schema import RunJson

    try:
        RunJson.model_validate(content)
    except ValidationError as error:
        return [f"{'.'.join(map(str, found['loc']))}: {found['msg']}" for found in error.errors()]
    return []


def name_the_cause(path, code):
    """Where run.json has only heard of the other side's failure (exit code PEER), give it the code of that failure."""
    path = Path(path)
    content = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}
    if content.get("exit_code") == exits.PEER:
        write(path.parent, content | {"exit_code": code})


def stage_rows(results, continuum, discrete):
    """Rows of run.json's `stages`: outcome and seconds of each. discrete: one list of stage times for each rank.

    The grid's waiting inside `fill` is the discs' building; in coupled stages it is the wait for their forces.
    """
    rows = []
    for result, times in zip(results, continuum, strict=True):
        seconds = {"continuum": times["computing"], "waiting": times["waiting"], "recording": times["recording"]}
        same = [t for rank in discrete for t in rank if t["name"] == times["name"]]
        seconds["discrete"] = max((t["computing"] for t in same), default=0.0)
        seconds["waiting_discrete"] = max((t["waiting"] for t in same), default=0.0)
        seconds["recording_discrete"] = max((t["recording"] for t in same), default=0.0)
        rows.append(result | {"seconds": {key: round(value, 4) for key, value in seconds.items()}})
    return rows


def stage_rows_alone(results, times):
    """The same rows for discs without a grid; times: of the same stages, and of one more that did not reach its end."""
    rows = []
    for result, spent in zip(results, times, strict=False):
        seconds = dict.fromkeys(("continuum", "waiting", "recording", "waiting_discrete"), 0.0)
        seconds |= {"discrete": spent["computing"], "recording_discrete": spent["recording"]}
        rows.append(result | {"seconds": {key: round(value, 4) for key, value in seconds.items()}})
    return rows
