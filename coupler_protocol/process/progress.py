"""Progress of a server, reported a few times a second at most: lines for a reader, or JSON lines for the launcher."""

import json
import sys
import time
from collections.abc import Callable
from typing import Any


class Progress:
    """Reports of one process. `form`: "plain" (standard error), "json" (standard output), "none", or a function of a dict."""

    def __init__(self, rank: int, form: str | Callable[[dict[str, Any]], None] = "plain", interval: float | None = None) -> None:
        self.rank, self.form = rank, form
        self.interval = interval if interval is not None else (2.0 if form == "plain" else 0.2)
        self._next, self._begin = 0.0, time.monotonic()
        self._stage = "start"

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
        self._stage = stage
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
        self(self._stage, text)


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
