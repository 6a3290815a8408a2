"""Many runs of discs alone, several at once: one process each, which ends with this one.

A folder whose run is done is left as it is. A run that was interrupted continues from its last checkpoint.
"""

import contextlib
import json
import queue
import time
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, NamedTuple

from colluvium.running.processes import GRACE, Process, as_toml
from coupler_protocol import exits
from coupler_protocol.files import run_json

LOOK = 0.1  # seconds between looks at the processes
LINES = 3  # of the message of a failed process: place, problem, remedy


class Job(NamedTuple):
    """A run: its name, the tables of its scene, its folder."""

    name: str
    tables: dict[str, Any]
    out: Path

    @property
    def scene(self) -> Path:
        """File of the scene."""
        return self.out / "sample.toml"

    def done(self) -> bool:
        """Whether the run is done, with the tables of this job."""
        path = self.out / run_json.NAME
        same = self.scene.exists() and self.scene.read_text(encoding="utf-8") == as_toml(self.tables)
        return same and path.exists() and run_json.read(path).get("exit_code") == exits.DONE


class Failed(NamedTuple):
    """A run that ended with an error: its name, exit code and last message."""

    name: str
    code: int
    message: str


def run_all(jobs: Iterable[Job], at_once: int, report: Callable[[str], None]) -> list[Failed]:
    """Runs all jobs, `at_once` at a time; report(text): called when one ends. Returns those that failed.

    Raises Interrupted after Ctrl-C, when all processes have saved their State and ended.
    """
    waiting, total = [job for job in jobs if not job.done()], 0
    total, ended = len(waiting), 0
    running: dict[str, tuple[Job, Process]] = {}
    failed: list[Failed] = []
    try:
        while waiting or running:
            while waiting and len(running) < at_once:
                job = waiting.pop(0)
                running[job.name] = job, _start(job)
            time.sleep(LOOK)
            for name, (job, process) in list(running.items()):
                if process.code() is not None:
                    code, ended = process.end(GRACE) or 0, ended + 1
                    del running[name]
                    failed += [Failed(name, code, _last_words(process))] if code else []
                    report(f"{ended} of {total}: {name} {'failed' if code else _how(job)}")
    except KeyboardInterrupt:
        for _, process in running.values():
            process.interrupt()
        raise exits.Interrupted("interrupted: the same command continues") from None
    finally:
        for _, process in running.values():
            process.end(GRACE)
    return failed


def _start(job: Job) -> Process:
    """Writes the scene of a job and starts its process."""
    job.out.mkdir(parents=True, exist_ok=True)
    text = as_toml(job.tables)
    fresh = not job.scene.exists() or job.scene.read_text(encoding="utf-8") != text
    job.scene.write_text(text, encoding="utf-8")
    rows: queue.Queue[dict[str, Any]] = queue.Queue()
    return Process(job.name, ["dem_server", str(job.scene), f"--out={job.out}", "--quiet", *(["--force"] if fresh else [])], rows)


def _how(job: Job) -> str:
    """Time that a run took, in words."""
    with contextlib.suppress(OSError, ValueError, json.JSONDecodeError):
        seconds = run_json.read(job.out / run_json.NAME).get("seconds")
        return f"done, {seconds:.1f} s" if seconds is not None else "done"
    return "done"


def _last_words(process: Process) -> str:
    """The last lines of a process on standard error, as one."""
    return " ".join([line.strip() for line in process.errors if line.strip()][-LINES:]) or "no message"
