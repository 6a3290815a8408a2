"""Differences of two resolved scenes, for handshakes and for runs that continue an earlier one."""

from collections.abc import Iterator
from math import copysign
from typing import Any

OF = "'s"  # of the continuum's
SIDES = ("the discrete side", "the continuum" + OF)


def first_difference(a: Any, b: Any, whose: tuple[str, str] = SIDES, values: bool = True) -> str | None:
    """Text with the first key at which two resolved scenes differ and (values) both values, or None. whose: owners of a and b."""
    return next(differences(a, b, whose, values=values), None)


def differences(a: Any, b: Any, whose: tuple[str, str] = SIDES, path: str = "", values: bool = True) -> Iterator[str]:
    """Yields a text for every key at which two resolved scenes differ, with both values (values)."""
    if isinstance(a, dict) and isinstance(b, dict):
        for key in sorted(a.keys() | b.keys()):
            if key not in a or key not in b:
                yield f"{path}{key}: only {whose[key in b].removesuffix(OF)} has it"
            else:
                yield from differences(a[key], b[key], whose, f"{path}{key}.", values)
    elif isinstance(a, list) and isinstance(b, list) and len(a) == len(b):
        for i, (x, y) in enumerate(zip(a, b, strict=True)):
            yield from differences(x, y, whose, f"{path}{i}.", values)
    elif not _same(a, b):
        yield f"{path.rstrip('.')}: {both_values(a, b, whose) if values else 'the values differ'}"


def _same(a: Any, b: Any) -> bool:
    """Whether two values give the same results: Python's True equals 1, and -0.0 equals 0.0."""
    if isinstance(a, bool) is not isinstance(b, bool):
        return False
    return a == b and (not isinstance(a, float | int) or a != 0 or copysign(1.0, a) == copysign(1.0, b))


def both_values(a: Any, b: Any, whose: tuple[str, str] = SIDES) -> str:
    """Text with two values that should be equal, each with its owner."""
    return f"{a!r} on {whose[0]}, {b!r} on {whose[1]}"
