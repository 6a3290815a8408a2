"""Compilation before the first call, and what a process has compiled so far.

numba triggers an event for every function that it compiles; nothing is triggered for a kernel that is found in the cache.
"""

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numba
from numba.core import event

Report = Callable[[str], object]
MOST = 10  # functions in run.json
ENABLED = not numba.config.DISABLE_JIT  # type: ignore[attr-defined]  # set when numba is imported


def compile_for(kernel: Any, arguments: tuple[Any, ...]) -> None:
    """Compiles `kernel` for arguments of these types, or loads it from its cache, without a call; for plain functions nothing."""
    if hasattr(kernel, "overloads"):
        kernel.compile(tuple(kernel.typeof_pyval(argument) for argument in arguments))


class Compiled(event.Listener):
    """Functions that the thread which made this object compiles: {name: [processor seconds without its callees, times]}.

    report(text) is called before a function is compiled that is not compiled as a part of another.
    """

    def __init__(self, report: Report) -> None:
        self._report = report
        self.found: dict[str, list[float]] = {}
        self._thread = threading.get_ident()
        self._open: list[list[float]] = []  # beginning, seconds of callees

    def on_start(self, event: event.Event) -> None:
        """A function is about to be compiled."""
        if threading.get_ident() != self._thread:
            return
        if not self._open:
            self._report(f"compiling {event.data['dispatcher'].py_func.__name__}")
        self._open.append([time.thread_time(), 0.0])

    def on_end(self, event: event.Event) -> None:
        """A function is compiled."""
        if threading.get_ident() != self._thread:
            return
        begin, inside = self._open.pop()
        seconds = time.thread_time() - begin
        if self._open:
            self._open[-1][1] += seconds
        function = event.data["dispatcher"].py_func
        row = self.found.setdefault(f"{function.__module__}.{function.__qualname__}", [0.0, 0])
        row[0] += seconds - inside
        row[1] += 1

    def report(self) -> dict[str, Any]:
        """Content of run.json: {} if everything was in the cache."""
        found = sorted(self.found.items(), key=lambda item: -item[1][0])
        if not found:
            return {}
        dearest = [{"function": name, "seconds": s, "specialisations": int(n)} for name, (s, n) in found[:MOST]]
        seconds = sum(row[0] for _, row in found)
        return {"compiled": {"seconds": seconds, "functions": len(found), "most_expensive": dearest}}


@contextmanager
def watched(report: Report) -> Iterator[Compiled]:
    """While this lasts, what the present thread compiles is reported and noted."""
    compiled = Compiled(report)
    with event.install_listener("numba:compile", compiled):
        yield compiled
