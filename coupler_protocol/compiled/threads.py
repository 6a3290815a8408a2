"""Threads that share the expensive half of a step: the calling thread, and others that wait for work.

Kernels hold no interpreter lock, so plain threads are enough: there is no run-time library to choose and no cost with one thread.
The work is divided into parts whose result does not depend on which thread takes them or how many threads there are.
"""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from threading import local
from typing import Any

_size = 1
_own = local()


def set_size(count: int) -> None:
    """Sets the number of threads of this process that share a step."""
    global _size
    _size = count


def size() -> int:
    """Number of threads that share a step."""
    return _size


def _others(count: int) -> ThreadPoolExecutor:
    """Threads that serve the calling thread only: crews wait actively, so two that begin together must not share a thread."""
    teams: dict[Any, ThreadPoolExecutor] = _own.__dict__
    if count not in teams:
        teams[count] = ThreadPoolExecutor(count, thread_name_prefix="team")
    return teams[count]


def each(work: Callable[..., Any], parts: Sequence[Sequence[Any]]) -> list[Any]:
    """Returns [work(*part) for part in parts], each part in a separate thread; raises the exception of any part."""
    if len(parts) == 1:
        return [work(*parts[0])]
    others = _others(len(parts) - 1)
    waiting = [others.submit(work, *part) for part in parts[1:]]
    own = work(*parts[0])
    return [own, *(one.result() for one in waiting)]
