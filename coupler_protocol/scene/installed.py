"""Entry points by which installed distributions add effects, rules and doubts to scenes."""

from functools import cache
from importlib.metadata import EntryPoint, EntryPoints, entry_points
from typing import Any

from coupler_protocol.exits import EnvironmentFailed


@cache
def installed(group: str) -> EntryPoints:
    """Entry points of a group, searched once in a process: a search reads a file of every installed distribution."""
    return entry_points(group=group)


def distribution(point: EntryPoint) -> str:
    """Name of the distribution of an entry point; "" if it has none."""
    return point.dist.name if point.dist is not None else ""


def loaded(point: EntryPoint) -> Any:
    """What an entry point names; raises EnvironmentFailed if it cannot be imported, with the distribution that declares it."""
    try:
        return point.load()
    except (ImportError, AttributeError, SyntaxError) as error:
        owner = f"of the installed distribution {distribution(point)!r}" if distribution(point) else "of no distribution"
        why = f"the entry point {point.name!r} ({point.group}) {owner}, {point.value}, cannot be imported: {error}"
        raise EnvironmentFailed(f"{why}. Repair or uninstall the distribution, or install it again") from error
