"""Stopping at a safe point: a request is only noted, and the run asks for it where its state is whole."""

import contextlib
import os
import signal
import threading

from coupler_protocol.exits import INTERRUPTED, Interrupted

GRACE = 20.0  # seconds a requested stop may take before the process ends itself


class StopRequest:
    """Whether somebody asked this run to stop, and why."""

    def __init__(self):
        self.reason = None

    def ask(self, reason):
        """Ask the run to stop at its next safe point."""
        self.reason = self.reason or reason

    def check(self):
        """Raise Interrupted if a stop was asked for."""
        if self.reason is not None:
            raise Interrupted(self.reason)


def stop_on_signals(stop):
    """Let Ctrl-C and a polite kill ask for a stop; the second one takes effect at once."""

    def ask(number, frame):
        if stop.reason is not None:
            raise KeyboardInterrupt
        stop.ask("interrupted by " + signal.Signals(number).name)

    signal.signal(signal.SIGINT, ask)
    signal.signal(signal.SIGTERM, ask)


def stop_with_parent(stop):
    """Ask for a stop when standard input closes, and end the process if that takes too long: no orphan stays behind."""

    def watch():
        with contextlib.suppress(OSError):  # there is none: gone as well
            while os.read(0, 4096):  # not sys.stdin: its lock must be free when the interpreter ends
                pass
        stop.ask("the launcher is gone")
        threading.Event().wait(GRACE)
        os._exit(INTERRUPTED)

    threading.Thread(target=watch, name="tether", daemon=True).start()
