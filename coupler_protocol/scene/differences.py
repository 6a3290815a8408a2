"""Differences of two resolved scenes, for handshakes and for runs that continue an earlier one."""

from collections.abc import Iterator
from typing import Any

OF = "'s"  # of the continuum's
SIDES = ("the discrete side", "the continuum" + OF)


def first_difference(a: Any, b: Any, whose: tuple[str, str] = SIDES) -> str | None:
    """Text with the first key at which two resolved scenes differ and both values, or None. whose: owners of a and b."""
    return next(differences(a, b, whose), None)


def differences(a: Any, b: Any, whose: tuple[str, str] = SIDES, path: str = "") -> Iterator[str]:
    """Yields a text for every key at which two resolved scenes differ, with both values."""
    if isinstance(a, dict) and isinstance(b, dict):
        for key in sorted(a.keys() | b.keys()):
            if key not in a or key not in b:
                yield f"{path}{key}: only {whose[key in b].removesuffix(OF)} has it"
            else:
                yield from differences(a[key], b[key], whose, f"{path}{key}.")
    elif isinstance(a, list) and isinstance(b, list) and len(a) == len(b):
        for i, (x, y) in enumerate(zip(a, b, strict=True)):
            yield from differences(x, y, whose, f"{path}{i}.")
    elif a != b:
        yield f"{path.rstrip('.')}: {both_values(a, b, whose)}"


def both_values(a: Any, b: Any, whose: tuple[str, str] = SIDES) -> str:
    """Text with two values that should be equal, each with its owner."""
    return f"{a!r} on {whose[0]}, {b!r} on {whose[1]}"
