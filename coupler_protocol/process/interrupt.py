"""Stops at safe points: a request is only stored, and the run checks it when its state is complete."""

import contextlib
import os
import signal
import threading
import time
from typing import Any

from coupler_protocol.exits import INTERRUPTED, Interrupted

GRACE = 30.0  # seconds a requested stop may take before the process ends itself


class StopRequest:
    """Request to stop this run, with its reason."""

    def __init__(self) -> None:
        self.reason: str | None = None
        self._since = 0.0

    @property
    def asked(self) -> bool:
        """Whether a stop was requested."""
        return self.reason is not None

    def ask(self, reason: str) -> None:
        """Requests the run to stop at its next safe point."""
        if self.reason is None:
            self._since = time.monotonic()
            self.reason = reason

    def check(self, patience: float = 0.0) -> None:
        """Raises Interrupted if a stop was requested more than `patience` seconds ago."""
        if self.reason is not None and time.monotonic() - self._since >= patience:
            raise Interrupted(self.reason)


def stop_on_signals(stop: StopRequest) -> None:
    """Makes the `signals` request a stop; the second signal takes effect immediately."""

    def ask(number: int, frame: Any) -> None:
        if stop.reason is not None:
            raise KeyboardInterrupt
        stop.ask("interrupted by " + signal.Signals(number).name)

    for number in signals():
        signal.signal(number, ask)


def signals() -> list[signal.Signals]:
    """Signals that stop a run with its State saved: Ctrl-C, a polite kill and, unless nohup is in force, the end of the terminal.

    Ctrl-C also if the shell that started the program ignores it for commands in the background.
    """
    hangup = getattr(signal, "SIGHUP", None)  # not on Windows
    ignored = hangup is None or signal.getsignal(hangup) == signal.SIG_IGN
    return [signal.SIGINT, signal.SIGTERM, *([] if ignored or hangup is None else [hangup])]


def stop_with_parent(stop: StopRequest) -> None:
    """Requests a stop when standard input closes, and ends the process after GRACE: no process outlives the launcher."""

    def watch() -> None:
        with contextlib.suppress(OSError):  # no standard input: the launcher is gone as well
            while os.read(0, 4096):  # not sys.stdin: its lock must be free when the interpreter ends
                pass
        stop.ask("the launcher is gone")
        threading.Event().wait(GRACE)
        os._exit(INTERRUPTED)

    threading.Thread(target=watch, name="tether", daemon=True).start()
