"""A State to a file and back, bit by bit.

A State is a NamedTuple, dataclass or dictionary whose fields are arrays, numbers, None or again such States; where annotated with
Any, also texts, lists and named tuples, which come back as dictionaries. A dictionary without entries is left out, and comes back
as one. A checkpoint is written beside its place under another name and renamed when
it is complete, so at any moment the place holds a whole checkpoint or none. It has a seal (seal.py), without which nothing of it
is read.
"""

import dataclasses
import io
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from types import NoneType
from typing import Any, get_args, get_origin, get_type_hints

import h5py
import numpy as np

from coupler_protocol.exits import EnvironmentFailed
from coupler_protocol.files import seal
from coupler_protocol.files.proof import require
from coupler_protocol.files.room import not_written, to_disk

LENGTH = "length"  # attribute of a group that is a list


class DamagedError(EnvironmentFailed):
    """A checkpoint is not the file that was written."""


def save(path: str | Path, state: Any, attributes: Mapping[str, Any] | None = None) -> None:
    """Writes a State and attributes (numbers, strings: what it belongs to) in place of `path`.

    Raises EnvironmentFailed where there is no room; `path` is then what it was.
    """
    path = Path(path)
    image = io.BytesIO()
    with h5py.File(image, "w", libver=("v108", "v114"), userblock_size=seal.ROOM) as file:
        file.attrs.update(attributes or {})
        _store(file.create_group("state"), state)
    seal.put_on(image.getbuffer())
    partial = path.with_name(path.name + ".partial")
    try:
        with open(partial, "wb") as out:
            out.write(image.getbuffer())
            out.flush()
            os.fsync(out.fileno())
        os.replace(partial, path)
    except OSError as error:
        partial.unlink(missing_ok=True)
        raise not_written(path, "the checkpoint", image.getbuffer().nbytes, error) from error
    to_disk(path.parent)


def load(path: str | Path) -> tuple[dict[str, Any], dict[str, Any]]:
    """Fields and attributes of a checkpoint; inner States are dictionaries, see `rebuild`. Raises DamagedError."""
    with _opened(path) as file:
        return _load(file["state"]), _attributes(file)


def attributes(path: str | Path) -> dict[str, Any]:
    """The attributes of a checkpoint alone. Raises DamagedError."""
    with _opened(path) as file:
        return _attributes(file)


@contextmanager
def _opened(path: str | Path) -> Iterator[h5py.File]:
    """A checkpoint that is as it was written."""
    found = seal.fault(path)
    if found:
        raise DamagedError(f"{path} is damaged: {found}")
    try:
        with h5py.File(path, "r", locking=False) as file:
            yield file
    except (OSError, KeyError) as error:
        raise DamagedError(f"{path} is not a checkpoint, although it is as it was written: {error}") from error


def _attributes(file: h5py.File) -> dict[str, Any]:
    return {name: _plain(value) for name, value in file.attrs.items()}


def rebuild(cls: type, fields: Mapping[str, Any], name: str = "state") -> Any:
    """The State of class `cls` from fields that `load` gave; its annotations say what each of them is.

    Raises proof.UnprovenError where a field is missing, unknown, or of another kind; `name`: of this State.
    """
    hints = get_type_hints(cls)
    own = list(_fields_of(cls))
    fields = {field: {} for field in own if get_origin(hints[field]) is dict} | dict(fields)
    for missing in (field for field in own if field not in fields):
        require(False, f"{name}.{missing} is missing")
    for strange in (field for field in fields if field not in own):
        require(False, f"{name}.{strange} is unknown")
    return cls(**{field: _rebuilt(hints[field], fields[field], f"{name}.{field}") for field in own})


def _rebuilt(hint: Any, value: Any, name: str) -> Any:
    """The value of a field, made sure to be what its annotation says: array, number, State, dictionary of them, or None."""
    if hint is Any:
        return value
    options = [get_origin(option) or option for option in (get_args(hint) if NoneType in get_args(hint) else (hint,))]
    if value is None:
        require(NoneType in options, f"{name} is empty")
        return None
    if dict in options:
        require(isinstance(value, dict), f"{name} is not a group")
        (inner,) = (get_args(option)[1] for option in (hint, *get_args(hint)) if get_origin(option) is dict)
        return {key: _rebuilt(inner, item, f"{name}.{key}") for key, item in value.items()}
    if np.ndarray in options:
        require(isinstance(value, np.ndarray), f"{name} is not an array")
        return value
    if not {bool, int, float}.isdisjoint(options):
        require(isinstance(value, bool | int | float | np.number), f"{name} is not a number")
        return value
    (cls,) = (option for option in options if option is not NoneType)
    require(isinstance(value, dict), f"{name} is not a group")
    return rebuild(cls, value, name)


def _store(group: h5py.Group, state: Any) -> None:
    for name, value in _fields(state).items():
        if isinstance(value, Mapping) and not value:
            continue
        if value is None:
            group[name] = h5py.Empty("f8")
        elif isinstance(value, np.ndarray):
            group[name] = value
        elif isinstance(value, bool | int | float | str | np.generic):
            group[name] = value
            group[name].attrs["number"] = type(value).__name__
        elif isinstance(value, list):
            rows = group.create_group(name)
            rows.attrs[LENGTH] = len(value)
            _store(rows, {str(place): row for place, row in enumerate(value)})
        else:
            _store(group.create_group(name), value)


def _fields_of(cls: type) -> tuple[str, ...]:
    """Names of the fields of a class of States."""
    if dataclasses.is_dataclass(cls):
        return tuple(field.name for field in dataclasses.fields(cls))
    return cls._fields  # type: ignore[attr-defined]  # a NamedTuple


def _fields(state: Any) -> dict[str, Any]:
    if dataclasses.is_dataclass(state):
        return {field.name: getattr(state, field.name) for field in dataclasses.fields(state)}
    if hasattr(state, "_asdict"):
        return state._asdict()
    if isinstance(state, Mapping):
        return {str(name): value for name, value in state.items()}
    raise TypeError(f"a State is made of arrays, numbers, None and named tuples of them, not of {type(state).__name__}")


def _load(group: h5py.Group) -> Any:
    found = {name: _load(item) if isinstance(item, h5py.Group) else _value(item) for name, item in group.items()}
    return found if LENGTH not in group.attrs else [found.get(str(place), {}) for place in range(group.attrs[LENGTH])]


def _value(data: h5py.Dataset) -> Any:
    value = data[()]
    if isinstance(value, h5py.Empty):
        return None
    kind = data.attrs.get("number")
    if kind == "str":
        return value.decode()
    return value.item() if kind in ("bool", "int", "float") else value


def _plain(value: Any) -> Any:
    return value.item() if isinstance(value, np.generic) else value
