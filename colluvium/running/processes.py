"""Launcher of one continuum process and one discrete process for every window, which end with the launcher."""

import contextlib
import json
import queue
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import IO, Any

from colluvium.running.stand_bys import StandBys, start
from coupler_protocol import exits
from coupler_protocol.files import status_file
from coupler_protocol.files.run_json import name_the_cause, write

Picture = Callable[[dict[str, Any]], None]  # called with each report of progress
Asked = Callable[[], bool]  # whether another thread asks for the end, as Ctrl-C does

LOCK = "run"  # name of the lock of the launcher
GRACE = 30.0  # seconds for a process to end before it is killed
ECHO = 10.0  # seconds within which an error of the other side follows the error that caused it
ECHOES = (exits.PEER, exits.INTERRUPTED)  # codes with which a side ends because the other one has failed


def own_files(out: str | Path) -> list[str]:
    """Names of files of an earlier run in `out`."""
    out = Path(out)
    patterns = ["*.vtkhdf", "*.h5", "*.log", "*.trace.csv", "run*.json", "dem.rank*.json", "scene.json", "scene.toml", "endpoint"]
    patterns += [f"*.{status_file.ENDING}", "*.partial", "*.json.new", "*.undo", "*.damaged"]
    return [path.name for pattern in patterns for path in sorted(out.glob(pattern))] if out.is_dir() else []


class Process:
    """A server as a child of this process. Its standard input is the tether: when it closes, the server stops."""

    def __init__(
        self, name: str, arguments: Sequence[str | Path], rows: queue.Queue[dict[str, Any]], ahead: StandBys | None = None
    ) -> None:
        self.name = name
        self.errors: list[str] = []
        module, words = str(arguments[0]), [*map(str, arguments[1:]), "--tether", "--progress", "json"]
        self.popen = (ahead and ahead.order(module, words)) or start(module, words)
        self._threads = [
            threading.Thread(target=self._read_rows, args=(self.popen.stdout, rows), daemon=True),
            threading.Thread(target=self._read_errors, args=(self.popen.stderr,), daemon=True),
        ]
        for thread in self._threads:
            thread.start()

    def _read_rows(self, out: IO[str], rows: queue.Queue[dict[str, Any]]) -> None:
        for line in out:
            with contextlib.suppress(json.JSONDecodeError):
                rows.put(json.loads(line))
        self.popen.wait()  # it has closed its output, so it is about to end
        rows.put({})  # nothing to show: whoever waits for rows looks at the exit code at once

    def _read_errors(self, errors: IO[str]) -> None:
        for line in errors:
            self.errors.append(line.rstrip())

    def code(self) -> int | None:
        """Exit code, or None while it runs."""
        return self.popen.poll()

    def interrupt(self) -> None:
        """Requests the process to stop at its next safe point."""
        if self.code() is None:
            self.popen.send_signal(signal.SIGINT)

    def end(self, seconds: float) -> int | None:
        """Waits for the end of the process, `seconds` at most, then kills it; returns the exit code."""
        try:
            self.popen.wait(max(0.1, seconds))
        except subprocess.TimeoutExpired:
            self.popen.kill()
            self.popen.wait()
        for thread in self._threads:
            thread.join(2.0)
        if self.popen.stdin is not None:
            self.popen.stdin.close()
        return self.code()


def run_files(
    scene_path: str | Path,
    out: str | Path,
    n_windows: int | None,
    options: Sequence[str] = (),
    picture: Picture | None = None,
    asked: Asked | None = None,
    ahead: StandBys | None = None,
) -> int:
    """Runs the scene at `scene_path` in processes; `options`: for every server. Returns the exit code.

    n_windows: of the grid, each a discrete process; None: discs alone. ahead: servers that stand by.
    picture(row) is called with each report of progress; asked: for a call in a thread, which gets no Ctrl-C. Messages of failed
    processes are printed to standard error.
    """
    rows: queue.Queue[dict[str, Any]] = queue.Queue()
    shared = [str(scene_path), f"--out={out}", *options]
    if n_windows is None:
        processes = [Process("dem-server", ["dem_server", *shared], rows, ahead)]
    else:
        processes = _both_sides(n_windows, shared, out, rows, ahead)
    interrupted = _watch(processes, rows, picture, asked)
    code = _conclude(processes, interrupted)
    _complete_run_json(Path(out), code, processes)
    return code


def _both_sides(
    n_windows: int, shared: Sequence[str | Path], out: str | Path, rows: queue.Queue[dict[str, Any]], ahead: StandBys | None
) -> list[Process]:
    """Starts one process for the grid and one for every window."""
    processes = [Process("fdm-server", ["fdm_server", *shared, "--bind=local"], rows, ahead)]
    endpoint = str(Path(out) / "endpoint")
    for rank in range(1, n_windows + 1):
        arguments = ["dem_server", *shared, f"--connect={endpoint}", "--rank", str(rank)]
        processes.append(Process(f"dem-server {rank}", arguments, rows, ahead))
    return processes


def windows_of(scene: Any) -> int | None:
    """Number of the scene's windows; None without a grid, because discs alone need one process."""
    return len(scene.window) if scene.grid else None


def run_alone(name: str, arguments: Sequence[str | Path], picture: Picture | None = None, asked: Asked | None = None) -> int:
    """Runs one module of this project (`arguments` begin with its name) as a child; returns the exit code."""
    rows: queue.Queue[dict[str, Any]] = queue.Queue()
    processes = [Process(name, [str(a) for a in arguments], rows)]
    interrupted = _watch(processes, rows, picture, asked)
    return _conclude(processes, interrupted)


def _watch(
    processes: Sequence[Process], rows: queue.Queue[dict[str, Any]], picture: Picture | None, asked: Asked | None = None
) -> bool:
    """Passes reports to `picture` until all processes have ended or one has failed; returns whether the end was asked for."""
    try:
        while any(p.code() is None for p in processes):
            with contextlib.suppress(queue.Empty):
                row = rows.get(timeout=0.1)
                if row and picture:
                    picture(row)
                if row:
                    continue
            if any(p.code() for p in processes):
                return False
            if asked and asked():
                return True
    except KeyboardInterrupt:
        return True
    return False


def _conclude(processes: Sequence[Process], interrupted: bool) -> int:
    """Ends the remaining processes and prints the reason for the end; returns the exit code of the process at fault."""
    if interrupted:
        for process in processes:
            process.interrupt()
    else:
        # One side has failed: the other receives FAILURE or detects the silence; there is no need to wait for its time-out.
        deadline = time.monotonic() + ECHO
        while time.monotonic() < deadline and any(p.code() is None for p in processes):
            time.sleep(0.05)
        for process in processes:
            process.interrupt()
    codes = {process.name: process.end(GRACE) for process in processes}
    failed = [code for code in codes.values() if code]
    causes = [code for code in failed if code not in ECHOES]
    for process in processes:
        if causes and process.code() in ECHOES:
            continue  # it repeats the error of the other side
        for line in process.errors:
            print(line, file=sys.stderr)
        code = process.code()
        if code and code < 0:
            name = signal.Signals(-code).name
            print(f"{process.name} was ended from outside ({name})", file=sys.stderr)
    if interrupted:
        return exits.INTERRUPTED
    if not failed:
        return exits.DONE
    cause = (causes or failed)[0]
    return exits.PEER if cause < 0 else cause


def _complete_run_json(out: Path, code: int, processes: Sequence[Process]) -> None:
    """Writes run.json in place of a killed continuum, or the exit code of failed discs into the continuum's run.json."""
    path = out / "run.json"
    if code:
        name_the_cause(path, code)
    if code and not path.exists() and out.is_dir():
        reason = "; ".join(f"{p.name} ended with {p.code()}" for p in processes)
        write(out, {"exit_code": code, "reason": reason, "stages": []})


def run_scene(scene: Any, out: Path, report: str = "none") -> None:
    """Runs a scene object in processes; raises RunEnded if the run fails."""
    path = out / "scene.toml"
    path.write_text(as_toml(scene.model_dump(mode="json", exclude_none=True)), encoding="utf-8")
    checked(run_files(path, out, windows_of(scene), ["--quiet"] if report == "none" else []))


def checked(code: int) -> None:
    """Raises the RunEnded of an exit code, unless the run is done."""
    if code:
        raise _ENDED.get(code, exits.RunEnded)(f"the run ended with code {code} ({exits.MEANING.get(code, '?')})")


_ENDED = {c.code: c for c in (exits.EnvironmentFailed, exits.PeerLost, exits.PhysicsFailed, exits.Interrupted)}


def as_toml(data: Mapping[str, Any]) -> str:
    """Plain scene data as TOML: JSON values are TOML values except tables, which become inline tables."""
    return "".join(f"{key} = {_value(value)}\n" for key, value in data.items())


def _value(value: Any) -> str:
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{k} = {_value(v)}" for k, v in value.items()) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(map(_value, value)) + "]"
    return json.dumps(value, ensure_ascii=False)
