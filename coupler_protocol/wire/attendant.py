"""A thread that serves the sockets of a selector until it is closed: of the gate of a continuum, or of the way there."""

import contextlib
import logging
import selectors
import socket
import threading
import time
from collections.abc import Iterable
from typing import Any

log = logging.getLogger(__name__)
TIDY = 0.5  # [s] between looks at clocks
REST = 0.02  # [s] between looks while something waits for a clock
END = 1.0  # [s] for the last bytes when it is closed


class Attendant:
    """One thread with a selector. Its kinds define `_serve`, `_busy` and `_connections`, and start the thread."""

    def __init__(self, name: str) -> None:
        self._selector = selectors.DefaultSelector()
        self._closed, (self._wake, self._woken) = threading.Event(), socket.socketpair()
        self._selector.register(self._woken, selectors.EVENT_READ, None)
        self.thread = threading.Thread(target=self._run, name=name, daemon=True)

    def close(self) -> None:
        """Passes on what is under way, for END seconds at most, and closes all connections."""
        self._closed.set()
        with contextlib.suppress(OSError):  # it has looked by itself, and ended
            self._wake.send(b"!")
        self.thread.join()
        self._wake.close()

    def _serve(self, seconds: float) -> None:
        """Handles what happens within a time [s]."""
        raise NotImplementedError

    def _rest(self) -> float:
        """Time [s] after which clocks are looked at."""
        return TIDY

    def _refuse_more(self) -> None:
        """Takes no more connections: the end has come."""

    def _busy(self) -> bool:
        """Whether bytes can still be under way."""
        raise NotImplementedError

    def _connections(self) -> Iterable[Any]:
        """What has to be closed at the end."""
        raise NotImplementedError

    def _run(self) -> None:
        try:
            while not self._closed.is_set():
                try:
                    self._serve(self._rest())
                except Exception:
                    log.exception("a fault of this program in the %s, please report it", self.thread.name)
                    time.sleep(TIDY)
            self._selector.unregister(self._woken)
            self._refuse_more()
            end = time.monotonic() + END
            while self._busy() and time.monotonic() < end:
                self._serve(REST)
        finally:
            for connection in (*self._connections(), self._woken):
                connection.close()
            self._selector.close()
