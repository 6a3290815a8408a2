"""Objects of a stage that a checkpoint inside the stage contains: they name their attributes that change (KEPT).

A continued stage makes such an object as at its start and then restores these attributes. All other attributes are constant, or
set before they are read.
"""

from collections import deque
from typing import Any, ClassVar

import numpy as np

from coupler_protocol.files.proof import require


class Kept:
    """Base of these objects. Values: numbers, texts, None, arrays, lists, sets, queues and named tuples of them."""

    KEPT: ClassVar[tuple[str, ...]] = ()

    def saved(self) -> dict[str, Any]:
        """Attributes for a checkpoint."""
        return {name: _plain(getattr(self, name)) for name in self.KEPT}

    def restore(self, saved: dict[str, Any]) -> None:
        """Sets the attributes from a checkpoint; raises UnprovenError where one is missing or an array has another shape."""
        for name in self.KEPT:
            setattr(self, name, like(f"{type(self).__name__}.{name}", getattr(self, name), value_of(saved, name)))


def value_of(saved: dict[str, Any], name: str) -> Any:
    """A value of a checkpoint; raises UnprovenError where it is missing."""
    require(isinstance(saved, dict) and name in saved, f"{name} is missing")
    return saved[name]


def like(name: str, present: Any, value: Any) -> Any:
    """`value` of a checkpoint as what `present` is; raises UnprovenError for an array of another shape or kind."""
    if isinstance(present, np.ndarray):
        require(isinstance(value, np.ndarray), f"{name} is not an array")
        require((value.shape, value.dtype) == (present.shape, present.dtype), f"{name} has the shape {value.shape}")
    if isinstance(present, set):
        return set(value)
    if isinstance(present, deque):
        return deque(value, present.maxlen)
    if hasattr(present, "_fields"):
        require(isinstance(value, dict) and set(value) == set(present._fields), f"{name} is not a {type(present).__name__}")
        return type(present)(**{field: like(f"{name}.{field}", getattr(present, field), value[field]) for field in value})
    return value


def _plain(value: Any) -> Any:
    """A value as a checkpoint takes it."""
    if (isinstance(value, tuple) and not hasattr(value, "_fields")) or isinstance(value, list | deque):
        return [_plain(item) for item in value]
    return sorted(value) if isinstance(value, set) else value
