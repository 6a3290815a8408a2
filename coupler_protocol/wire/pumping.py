"""Threads in which a compiled loop (coupler_protocol/compiled/pump.py) passes on the bytes of connections that proved themselves.

In Python, each piece of a message needs the interpreter, and waits for the main thread, which has it: an exchange put threads to
sleep 16 to 20 times instead of 8. Until the loop is compiled or loaded, and with NUMBA_DISABLE_JIT=1, the threads of gate and
passage pass the bytes on themselves.
"""

import contextlib
import logging
import socket
import threading
from collections.abc import Callable
from functools import cache

from coupler_protocol.compiled import ahead, pump

log = logging.getLogger(__name__)
_compiled = threading.Event()


def ready() -> bool:
    """Whether the loop can be called; begins to compile it, or to load it, at the first question."""
    if ahead.ENABLED:
        _begin_to_compile()
    return _compiled.is_set()


@cache
def _begin_to_compile() -> None:
    # Not a daemon: a process that ends while another thread is inside of the compiler can crash.
    threading.Thread(target=_compile, name="pump compiler").start()


def _compile() -> None:
    try:
        ahead.compile_for(pump.pass_on, (pump.pump_between(-1, -1, (b"", b""), 0.0),))
    except Exception:  # steps are slower without it, nothing else
        log.exception("bytes are passed on without a compiled loop, please report it")
    else:
        _compiled.set()


class PumpThread:
    """Passes on what two sockets say, in a thread of its own, and closes them at the end; then it calls ended().

    pending: what each socket still has to get; linger: time [s] for the other direction once one of them has said all.
    """

    def __init__(
        self, ends: tuple[socket.socket, socket.socket], pending: tuple[bytes, bytes], linger: float, ended: Callable[[], object]
    ) -> None:
        self._ends, self._ended = ends, ended
        self._pump = pump.pump_between(ends[0].fileno(), ends[1].fileno(), pending, linger)
        self._thread = threading.Thread(target=self._run, name="pump", daemon=True)
        self._thread.start()

    def _run(self) -> None:
        try:
            pump.pass_on(self._pump)
        finally:
            for end in self._ends:
                end.close()
            self._ended()

    def stop(self) -> None:
        """Ends both connections; returns when the thread has closed them."""
        for end in self._ends:
            with contextlib.suppress(OSError):  # the peer has gone, or the thread has closed it
                end.shutdown(socket.SHUT_RDWR)
        self._thread.join()
