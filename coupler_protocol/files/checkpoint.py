"""A State to a file and back, bit by bit.

A State is a NamedTuple, dataclass or dictionary whose fields are arrays, numbers, None or again such States. A dictionary
without entries is left out, and comes back as one. A checkpoint is written beside its place under another name and renamed when
it is complete, so at any moment the place holds a whole checkpoint or none.
"""

import dataclasses
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, get_args, get_origin, get_type_hints

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
    """Fields and attributes of a checkpoint; inner States are dictionaries, see `rebuild`."""
    with h5py.File(path, "r", locking=False) as file:
        return _load(file["state"]), {name: _plain(value) for name, value in file.attrs.items()}


def attributes(path: str | Path) -> dict[str, Any]:
    """The attributes of a checkpoint alone."""
    with h5py.File(path, "r", locking=False) as file:
        return {name: _plain(value) for name, value in file.attrs.items()}


def rebuild(cls: type, fields: Mapping[str, Any]) -> Any:
    """The State of class `cls` from fields that `load` gave; its annotations say of which classes the inner States are."""
    hints = get_type_hints(cls)
    empty: dict[str, Any] = {name: {} for name, hint in hints.items() if get_origin(hint) is dict}
    return cls(**empty | {name: _rebuilt(hints[name], value) for name, value in fields.items()})


def _rebuilt(hint: Any, value: Any) -> Any:
    if not isinstance(value, dict):
        return value
    if get_origin(hint) is dict:
        return {name: _rebuilt(get_args(hint)[1], item) for name, item in value.items()}
    (cls,) = (c for c in (hint, *get_args(hint)) if isinstance(c, type) and c is not type(None))
    return rebuild(cls, value)


def _store(group: h5py.Group, state: Any) -> None:
    for name, value in _fields(state).items():
        if isinstance(value, Mapping) and not value:
            continue
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
    if isinstance(state, Mapping):
        return {str(name): value for name, value in state.items()}
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
