"""Status file of a process (coupler_protocol.files.status_file), kept by a thread: it is also written while the process waits.

Speed is the mean over the last SPAN seconds. Times left hold at this speed, and stages may end before their last step.
"""

import threading
import time
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from coupler_protocol import exits
from coupler_protocol.files import locks, status_file
from coupler_protocol.process.progress import Progress

EVERY = 2.0  # [s] between two statuses
SPAN = 30.0  # [s] over which the speed is taken
LONG = 2.0  # [s] of a wait from which the process counts as waiting


@contextmanager
def shown(folder: str | Path, name: str, progress: Progress, scene: Any) -> Iterator[None]:
    """Keeps the status file of the process `name` while this lasts; its last content says how the process ended."""
    told = Status(progress, scene)
    ended = threading.Event()

    def write() -> None:
        while not ended.is_set():
            status_file.write(folder, name, told.now())
            ended.wait(EVERY)

    thread = threading.Thread(target=write, name=f"status {name}", daemon=True)
    thread.start()
    end = {"state": status_file.FINISHED, "exit_code": exits.DONE, "reason": "all stages done"}
    try:
        yield
    except BaseException as error:
        code = exits.INTERRUPTED if isinstance(error, KeyboardInterrupt) else exits.code_of(error)
        state = status_file.STOPPED if code == exits.INTERRUPTED else status_file.FAILED
        end = {"state": state, "exit_code": code, "reason": str(error) or type(error).__name__}
        raise
    finally:
        ended.set()
        thread.join()
        status_file.write(folder, name, told.now() | {"waiting": None, "doing": ""} | end)


class Status:
    """What a status file contains, from the progress of a process and the stages of its scene."""

    def __init__(self, progress: Progress, scene: Any) -> None:
        self._progress = progress
        self._about = {"title": scene.title, "scene_hash": scene.digest()} | locks.this_process()
        self._stages = [(stage.name, stage.until.steps if stage.until else 0) for stage in scene.stage]
        self._moments: deque[tuple[float, int, float]] = deque()  # time [s], steps, share of the stage
        self._stage = ""

    def now(self) -> dict[str, Any]:
        """The present status."""
        where = self._progress
        names = [name for name, _ in self._stages]
        speed, left = self._rates(where.stage, where.steps, where.share)
        waiting = where.wait()
        long = waiting is not None and time.time() - waiting.since >= LONG
        stage = where.stage if where.stage in names else None
        return {
            **self._about,
            "rank": where.rank,
            "run": where.run,
            "state": status_file.WAITING if long else status_file.RUNNING,
            "written": time.time(),
            "stage": stage,
            "stage_number": names.index(stage) + 1 if stage else None,
            "stages": len(names),
            "step": where.steps,
            "stage_step": where.steps - where.first,
            "stage_steps": where.limit,
            "ratio": where.ratio,
            "gravity_factor": where.factor,
            "doing": where.text,
            "steps_per_second": speed,
            "stage_seconds_left": left,
            "run_seconds_left": self._left_of_run(stage, speed, left),
            "waiting": waiting._asdict() if long and waiting is not None else None,
        }

    def _rates(self, stage: str, steps: int, share: float | None) -> tuple[float | None, float | None]:
        """Steps per second, and seconds left of the stage, where they are known."""
        now = time.monotonic()
        if stage != self._stage:
            self._stage = stage
            self._moments.clear()
        self._moments.append((now, steps, share or 0.0))
        while self._moments[0][0] < now - SPAN:
            self._moments.popleft()
        begun, before, had = self._moments[0]
        if now - begun < 0.5 * EVERY or steps == before:
            return None, None
        rate = ((share or 0.0) - had) / (now - begun)
        return (steps - before) / (now - begun), (1.0 - share) / rate if share is not None and rate > 0.0 else None

    def _left_of_run(self, stage: str | None, speed: float | None, left: float | None) -> float | None:
        """Seconds left of the run if the steps of all later stages are bounded."""
        if stage is None or speed is None or left is None:
            return None
        later = [steps for _, steps in self._stages[[name for name, _ in self._stages].index(stage) + 1 :]]
        return None if None in later else left + sum(steps for steps in later if steps) / speed
