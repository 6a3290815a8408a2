"""What is asked of a State that comes from a file, before a kernel sees it: compiled code does not check what it is given."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from coupler_protocol.exits import EnvironmentFailed


class UnprovenError(ValueError):
    """A State is not one that steps can be taken with; the message says why."""


@contextmanager
def of_file(path: str | Path) -> Iterator[None]:
    """Turns an UnprovenError into the end of a run that names the file of the State."""
    try:
        yield
    except UnprovenError as error:
        raise EnvironmentFailed(
            f"{path} is as it was written, but does not hold a State that a run can continue from: {error}"
        ) from error


def require(holds: object, why: str) -> None:
    """Raises UnprovenError unless something holds."""
    if not holds:
        raise UnprovenError(why)


def shaped(name: str, array: np.ndarray, shape: tuple[int, ...], kind: str = "f") -> None:
    """An array of this shape; kind: numpy's letter, f: finite real numbers, i: integers, u: without sign, b: truth."""
    require(array.shape == shape, f"{name} has the shape {array.shape} instead of {shape}")
    require(array.dtype.kind == kind, f"{name} holds {array.dtype} numbers")
    if kind == "f":
        require(np.isfinite(array).all(), f"{name} holds NaN or infinite numbers")


def within(name: str, array: np.ndarray, low: float, high: float) -> None:
    """Numbers from `low` to `high`, both included."""
    wrong = ~((array >= low) & (array <= high))
    require(not wrong.any(), f"{name} holds {array[wrong].flat[0] if wrong.any() else ''}, not between {low} and {high}")


def positive(name: str, array: np.ndarray) -> None:
    """Numbers above zero."""
    require((array > 0.0).all(), f"{name} holds numbers that are not positive")
