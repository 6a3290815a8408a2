"""Entry points by which installed distributions add effects, rules and doubts to scenes."""

from functools import cache
from importlib.metadata import EntryPoint, EntryPoints, entry_points


def installed(group: str) -> EntryPoints:
    """Entry points of a group."""
    return _all().select(group=group)


def distribution(point: EntryPoint) -> str:
    """Name of the distribution of an entry point; "" if it has none."""
    return point.dist.name if point.dist is not None else ""


@cache
def _all() -> EntryPoints:
    """All entry points, searched once in a process: a search reads a file of every installed distribution."""
    return entry_points()
