"""Entry points by which installed distributions add effects, rules and doubts to scenes."""

from functools import cache
from importlib.metadata import EntryPoint, EntryPoints, entry_points


@cache
def installed(group: str) -> EntryPoints:
    """Entry points of a group, searched once in a process: a search reads a file of every installed distribution."""
    return entry_points(group=group)


def distribution(point: EntryPoint) -> str:
    """Name of the distribution of an entry point; "" if it has none."""
    return point.dist.name if point.dist is not None else ""
