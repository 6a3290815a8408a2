"""Log lines about strangers: one of a kind in ten seconds, with the count of those left out; nothing of what strangers sent."""

import logging
import time

EVERY = 10.0  # [s] between two lines of a kind


class SparseLog:
    """Warnings of a few kinds, each at most once in EVERY seconds."""

    def __init__(self, log: logging.Logger) -> None:
        self.log = log
        self._next: dict[str, float] = {}
        self._left_out: dict[str, int] = {}

    def warn(self, kind: str, text: str) -> None:
        """Logs `text`, or counts it; kind: one of few."""
        now = time.monotonic()
        if now < self._next.get(kind, 0.0):
            self._left_out[kind] = self._left_out.get(kind, 0) + 1
            return
        self._next[kind] = now + EVERY
        more = self._left_out.pop(kind, 0)
        self.log.warning("%s%s", text, f" ({more} more since the last such line)" if more else "")
