"""Imports that the end of a run needs, made while other processes compute.

They take about a second, in which nothing else would be left to do after the last step. They begin with the first step of a run,
so that they do not delay the start of the processes, in a thread of the lowest priority, so that they use only idle time.
"""

import os
import sys
import threading
from collections.abc import Callable, Sequence
from importlib import import_module
from types import TracebackType
from typing import Any

LOWEST = 19  # of the nice values of POSIX


class IdleImports:
    """A picture of progress that imports `modules` from the first step on, and passes all reports to another picture.

    At the end of its `with` block, modules that were not begun are left to the code that needs them.
    """

    def __init__(self, modules: Sequence[str], picture: Callable[[dict[str, Any]], None] | None = None) -> None:
        self._modules, self._picture = modules, picture
        self._thread: threading.Thread | None = None
        self._ended = threading.Event()

    def __call__(self, row: dict[str, Any]) -> None:
        """Passes on a report of progress."""
        if self._thread is None and row["step"]:
            # Not a daemon: the interpreter must not end within an import.
            self._thread = threading.Thread(target=self._import, name="idle imports")
            self._thread.start()
        if self._picture:
            self._picture(row)

    def __enter__(self) -> "IdleImports":
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._ended.set()

    def _import(self) -> None:
        if sys.platform == "linux":  # where a priority can belong to one thread
            os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), LOWEST)
        for name in self._modules:
            if self._ended.is_set():
                return
            import_module(name)
