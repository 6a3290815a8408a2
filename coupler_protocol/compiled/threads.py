"""Threads that share the heavy half of a step: the one that asks, and others that wait for work.

Kernels hold no interpreter lock, so plain threads do: there is no run-time library to choose, and nothing to pay where one
thread is enough. The work is cut into parts whose outcome does not depend on which thread takes them or how many there are.
"""

from concurrent.futures import ThreadPoolExecutor
from threading import local

_size = 1
_own = local()


def set_size(count):
    """Threads of this process that share a step, from now on."""
    global _size
    _size = count


def size():
    """Threads that share a step."""
    return _size


def _others(count):
    """Threads that serve the asking one alone: crews wait for each other awake, so two that begin at once must not share any."""
    teams = _own.__dict__
    if count not in teams:
        teams[count] = ThreadPoolExecutor(count, thread_name_prefix="team")
    return teams[count]


def each(work, parts):
    """[work(*part) for part in parts], each part in a thread of its own; an exception of any of them is raised here."""
    if len(parts) == 1:
        return [work(*parts[0])]
    others = _others(len(parts) - 1)
    waiting = [others.submit(work, *part) for part in parts[1:]]
    own = work(*parts[0])
    return [own, *(one.result() for one in waiting)]
