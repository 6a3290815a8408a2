"""A State to a file and back, bit by bit.

A State is a NamedTuple or dataclass whose fields are arrays, numbers, None or again such tuples. A checkpoint
is written beside its place under another name and renamed when it is complete, so at any moment the place
holds a whole checkpoint or none.
"""

import dataclasses
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import h5py
import numpy as np


def save(path: str | Path, state: Any, attributes: Mapping[str, Any] | None = None) -> None:
    """Write a State and attributes (numbers, strings: what it belongs to) in place of `path`."""
    path = Path(path)
    partial = path.with_name(path.name + ".partial")
    with h5py.File(partial, "w", libver=("v108", "v114"), locking=False) as file:
        file.attrs.update(attributes or {})
        _store(file.create_group("state"), state)
    _to_disk(partial)
    os.replace(partial, path)
    _to_disk(path.parent)


def load(path: str | Path) -> tuple[dict[str, Any], dict[str, Any]]:
    """Fields and attributes of a checkpoint: `State(**fields)` is the State; inner tuples are dicts."""
    with h5py.File(path, "r", locking=False) as file:
        return _load(file["state"]), {name: _plain(value) for name, value in file.attrs.items()}


def _store(group: h5py.Group, state: Any) -> None:
    for name, value in _fields(state).items():
        if value is None:
            group[name] = h5py.Empty("f8")
        elif isinstance(value, np.ndarray):
            group[name] = value
        elif isinstance(value, bool | int | float | np.generic):
            group[name] = value
            group[name].attrs["number"] = type(value).__name__
        else:
            _store(group.create_group(name), value)


def _fields(state: Any) -> dict[str, Any]:
    if dataclasses.is_dataclass(state):
        return {field.name: getattr(state, field.name) for field in dataclasses.fields(state)}
    if hasattr(state, "_asdict"):
        return state._asdict()
    raise TypeError(f"a State is made of arrays, numbers, None and named tuples of them, not of {type(state).__name__}")


def _load(group: h5py.Group) -> dict[str, Any]:
    return {name: _load(item) if isinstance(item, h5py.Group) else _value(item) for name, item in group.items()}


def _value(data: h5py.Dataset) -> Any:
    value = data[()]
    if isinstance(value, h5py.Empty):
        return None
    python_number = data.attrs.get("number") in ("bool", "int", "float")
    return value.item() if python_number else value


def _plain(value: Any) -> Any:
    return value.item() if isinstance(value, np.generic) else value


def _to_disk(path: Path) -> None:
    """Make the operating system write a file, or the names in a folder, to the disk."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
