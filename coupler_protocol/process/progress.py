"""Progress of a server, reported a few times a second at most: lines for a reader, or JSON lines for the launcher.

The last report is also kept: lines of logs (log_lines.py) and the status file (status.py) say where the process is.
"""

import json
import sys
import time
from collections.abc import Callable
from typing import Any

from coupler_protocol.scene import run_number


class Progress:
    """Reports of one process. `form`: "plain" (standard error), "json" (standard output), "none", or a function of a dict.

    run: text of the number of the run; stage, text, ratio, factor: the last ones reported; first: step of the run before the
    first of the stage; limit, limit_time: its steps and seconds [s] if they are bounded; wait: function that gives the Waiting
    of the process, or None.
    """

    def __init__(self, rank: int, form: str | Callable[[dict[str, Any]], None] = "plain", interval: float | None = None) -> None:
        self.rank, self.form = rank, form
        self.interval = interval if interval is not None else (2.0 if form == "plain" else 0.2)
        self._next, self._begin = 0.0, time.monotonic()
        self.run, self.stage, self.text = run_number.UNKNOWN, "start", ""
        self.ratio: float | None = None
        self.factor: float | None = None
        self.first, self.limit, self.limit_time = 0, None, None
        self.wait: Callable[[], Any] = lambda: None
        self._first_time = 0.0
        self._side: Any = None

    def follow(self, side: Any) -> None:
        """Takes steps and time of the run from a side (coupler_protocol.process.server.run_side) from now on."""
        self._side = side

    def name_run(self, number: int) -> None:
        """Stores the number of the run."""
        self.run = run_number.as_text(number)

    def begin(self, stage: Any, first: int, past: float = 0.0) -> None:
        """Notes the begin of a stage (of a scene). first: step of the run before its first; past: its time so far [s]."""
        self.stage, self.text, self.first, self._first_time = stage.name, "", first, self.time - past
        self.limit = stage.until.steps if stage.until else None
        self.limit_time = stage.until.time if stage.until else None

    @property
    def steps(self) -> int:
        """Steps of the run so far."""
        return int(getattr(self._side, "steps", 0))

    @property
    def time(self) -> float:
        """Time of the run so far [s]; static steps count as 1."""
        return float(getattr(self._side, "time", 0.0))

    @property
    def share(self) -> float | None:
        """Share of the stage that is done, if steps or time bound it; conditions such as a ratio may end it before."""
        shares: list[float] = [(self.steps - self.first) / self.limit] if self.limit else []
        shares += [(self.time - self._first_time) / self.limit_time] if self.limit_time else []
        return max(shares, default=None)

    def __call__(
        self,
        stage: str,
        text: str = "",
        step: int = 0,
        of: int | None = None,
        ratio: float | None = None,
        factor: float | None = None,
        now: bool = False,
    ) -> None:
        """Reports, unless the last report is too recent; `now`: always."""
        self.stage, self.text = stage, text
        self.ratio = self.ratio if ratio is None else ratio
        self.factor = self.factor if factor is None else factor
        time_now = time.monotonic()
        if time_now < self._next and not now:
            return
        self._next = time_now + self.interval
        row = {"rank": self.rank, "stage": stage, "text": text, "step": step, "of": of, "ratio": ratio, "factor": factor}
        if callable(self.form):
            self.form(row)
            return
        try:
            if self.form == "json":
                print(json.dumps(row), flush=True)
            elif self.form == "plain":
                print(f"{time_now - self._begin:7.1f} s  {as_line(row)}", file=sys.stderr, flush=True)
        except OSError:  # the reader or the terminal has gone: no reason to end a run
            self.form = "none"

    def note(self, text: str) -> None:
        """Reports a text in the stage of the last report, unless that is too recent."""
        self(self.stage, text)


def as_line(row: dict[str, Any]) -> str:
    """One report as a line of text."""
    parts = [f"rank {row['rank']}", f"{row['stage']:<12}"]
    if row["step"]:
        parts.append(f"step {row['step']}" + (f"/{row['of']}" if row["of"] else ""))
    if row["factor"] is not None:
        parts.append(f"{row['factor']:.2f} g")
    if row["ratio"] is not None:
        parts.append(f"ratio {row['ratio']:.2e}")
    if row["text"]:
        parts.append(row["text"])
    return "  ".join(parts)
