"""`colluvium status RUN_DIR`: where each process of a run is, while it runs and after its end, from the files of one folder.

Nothing is written and no lock is taken. A process that has left no word of its end, and no longer lives, has crashed.
"""

import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from coupler_protocol.exits import EnvironmentFailed
from coupler_protocol.files import locks, run_json, status_file
from coupler_protocol.scene.run_number import UNKNOWN

CRASHED, SILENT = "crashed", "silent"
OVERDUE = 20.0  # [s] without a new status, from which a process that lives counts as silent
Info = dict[str, Any]


def of_folder(folder: str | Path) -> Info:
    """Status of the run in a folder: content of run.json, if the run has ended, and `processes`, a list.

    Raises EnvironmentFailed for a folder without files of a run.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise EnvironmentFailed(f"{folder} is not a folder: give the --out of a server or of colluvium run")
    found = [_present(folder, name, content) for name, content in status_file.in_folder(folder).items()]
    path = folder / run_json.NAME
    info = run_json.read(path) if path.exists() else {}
    if not found and not info and not any(folder.glob("*.vtkhdf")):
        raise EnvironmentFailed(f"{folder} has no files of a run: give the --out of a server or of colluvium run")
    return info | {"processes": found}


def is_over(info: Info) -> bool:
    """Whether no process of the folder computes any more."""
    return all(row["state"] in (*status_file.ENDED, CRASHED) for row in info["processes"])


def _present(folder: Path, name: str, content: Info) -> Info:
    """Status of a process, with what its files add: state, seconds since its last status, its last checkpoint."""
    row: Info = {"process": name, "state": CRASHED} | content
    row["silent"] = max(0.0, time.time() - content["written"]) if "written" in content else None
    if row["state"] not in status_file.ENDED:
        if not locks.is_held(folder, name):
            row["state"] = CRASHED
        elif row["silent"] is not None and row["silent"] > OVERDUE:
            row["state"] = SILENT
    newest = max(folder.glob(f"{name}.*.h5"), key=lambda path: path.stat().st_mtime, default=None)
    if newest is not None:
        row["checkpoint"] = {"file": newest.name, "age": max(0.0, time.time() - newest.stat().st_mtime)}
    return row


def lines(folder: str | Path, info: Info) -> Iterator[str]:
    """Yields the status of a folder in lines of text."""
    rows = info["processes"]
    if not rows:
        yield from _without_status(folder, info)
    for number, row in enumerate(rows):
        if number == 0:
            yield f"run {row.get('run', UNKNOWN)}: {row.get('title') or 'without a title'}"
        yield f"{row['process']} on {row.get('host', '?')}: {row['state']}{_about(row)}"
        for text in _details(row):
            yield f"    {text}"


def _without_status(folder: str | Path, info: Info) -> Iterator[str]:
    """Yields the last frame of a run of an earlier version, which has no status files."""
    if "exit_code" in info:
        return
    from colluvium.results.run import open_run

    with open_run(folder) as run:
        last = run.frames[-1] if run.frames else None
    yield "not finished" + (f"; last frame: step {last.step}, stage {last.stage}, {last.gravity_factor:.2f} g" if last else "")


def _about(row: Info) -> str:
    """What the state needs to be understood."""
    if row["state"] in status_file.ENDED:
        return f" ({row.get('reason')}); exit code {row.get('exit_code')}"
    waiting = row.get("waiting")
    if row["state"] == CRASHED:
        return f", its process {row.get('pid', '?')} is gone and said nothing of an end: start the same command again"
    if row["state"] == SILENT:
        return f", alive but without a word for {duration(row['silent'])}: it is stopped, or the machine is overloaded"
    if waiting:
        word = f"; its last word: {waiting['word']}" if waiting["word"] else ""
        when = time.strftime("%H:%M:%S", time.localtime(waiting["since"]))
        return f" for {waiting['peer']} since {when} (phase {waiting['phase']}, {waiting['message']}{word})"
    return f": {row['doing']}" if row.get("doing") else ""


def _details(row: Info) -> Iterator[str]:
    """Yields the place in the run, the speed and the last checkpoint."""
    if row.get("stage"):
        yield ", ".join(_place(row))
    if row.get("steps_per_second") and row["state"] in (status_file.RUNNING, status_file.WAITING):
        yield f"{row['steps_per_second']:.4g} steps/s; {_left(row)}"
    if "checkpoint" in row:
        words = f"last checkpoint {row['checkpoint']['file']}"
        yield words + (f", {duration(row['checkpoint']['age'])} ago" if row["state"] not in status_file.ENDED else "")


def _place(row: Info) -> Iterator[str]:
    yield f"stage {row['stage']} ({row['stage_number']} of {row['stages']})"
    limit = f" of at most {row['stage_steps']:,}" if row.get("stage_steps") else ""
    yield f"step {row['step']:,} of the run"
    yield f"{row['stage_step']:,}{limit} of the stage"
    if row.get("ratio") is not None:
        yield f"ratio {row['ratio']:.2e}"
    if row.get("gravity_factor") is not None:
        yield f"{row['gravity_factor']:.2f} g"


def _left(row: Info) -> str:
    stage, run = row.get("stage_seconds_left"), row.get("run_seconds_left")
    if stage is None:
        return "time left unknown: no number of steps ends the stage"
    whole = f", of the run {duration(run)}" if run is not None else ""
    return f"at this speed at most {duration(stage)} of the stage are left{whole}"


def duration(seconds: float) -> str:
    """Text of a time span: "8 s", "12 min", "3.5 h", "2.1 d"."""
    for unit, size, most in (("s", 1.0, 100.0), ("min", 60.0, 100.0), ("h", 3600.0, 48.0)):
        if seconds < most * size:
            return f"{seconds / size:.{0 if unit != 'h' else 1}f} {unit}"
    return f"{seconds / 86400.0:.1f} d"
