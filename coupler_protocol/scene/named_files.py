"""Files that a scene names: where they are, and a hash of their contents.

A path counts from the folder of the scene. The scene that was read has the absolute path and a hash. So two machines, or a run
and the run that continues it, compare the contents of the files and not their places.
"""

import hashlib
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

KEYS = (("discs", "file"), ("stones", "file"), ("stones", "shapes"))  # tables and keys with a path; the hash has the key KEY_hash
Place = tuple[Any, ...]  # path of a table in a scene, of the scene itself or of a window
FOR_JUDGING = ("accuracy",)  # tables of a scene that say only what its results should be
DIGITS = 64  # of a hash: 32 bytes, hexadecimal
SHOWN = 12  # digits of a hash in messages


def _tables(data: Any) -> Iterator[tuple[Place, Any, str]]:
    """(path, table, key) of every key with a path in plain data of a scene: of its tables and of those of its windows."""
    windows = data.get("window") if isinstance(data, dict) else None
    holders: list[tuple[Place, Any]] = [((), data)]
    holders += [(("window", i), window) for i, window in enumerate(windows if isinstance(windows, list) else ())]
    for at, holder in holders:
        for name, key in KEYS:
            table = holder.get(name) if isinstance(holder, dict) else None
            if isinstance(table, dict):
                yield (*at, name), table, key
    for at, boundary in _boundaries(data):
        table = boundary.get("shaking") if isinstance(boundary, dict) else None
        if isinstance(table, dict):
            yield (*at, "shaking"), table, "file"


def _boundaries(data: Any) -> Iterator[tuple[Place, Any]]:
    """(path, table) of every boundary in plain data of a scene: of the scene and of its stages."""
    stages = data.get("stage") if isinstance(data, dict) else None
    holders: list[tuple[Place, Any]] = [((), data)]
    holders += [(("stage", i), stage) for i, stage in enumerate(stages if isinstance(stages, list) else ())]
    for at, holder in holders:
        tables = holder.get("boundary") if isinstance(holder, dict) else None
        yield from (((*at, "boundary", k), table) for k, table in enumerate(tables if isinstance(tables, list) else ()))


def _at(data: Any, path: Place) -> Any:
    """The value at a path in plain data; None if there is none."""
    for part in path:
        inside = isinstance(data, dict) or (isinstance(data, list) and isinstance(part, int) and part < len(data))
        data = (data.get(part) if isinstance(data, dict) else data[part]) if inside else None
    return data


def _with(data: Any, path: Place, value: Any) -> Any:
    """Plain data with another value at a path; nothing else is changed or copied."""
    if not path:
        return value
    first, *rest = path
    inside = _with(data[first], tuple(rest), value)
    return data | {first: inside} if isinstance(data, dict) else [*data[:first], inside, *data[first + 1 :]]


def located(data: Any, folder: str | Path) -> tuple[Any, list[tuple[Place, str, str]]]:
    """Plain data of a scene with absolute paths and hashes of files; and problems as (path of the key, reason, remedy)."""
    problems = []
    for at, _, key in list(_tables(data)):
        table = _at(data, at)
        name, wanted = table.get(key), table.get(f"{key}_hash")
        if not isinstance(name, str) or not name:
            if wanted is not None:
                problems.append(((*at, f"{key}_hash"), f"a hash without {key}", f"add {key}, or remove the key"))
            continue
        if "\0" in name:
            problems.append(((*at, key), f"{name!r} is not a path", "remove the zero byte"))
            continue
        path = Path(os.path.abspath(Path(folder, name)))
        found = hash_of(path) if path.is_file() else None
        if None not in (found, wanted) and found != wanted:
            hashes = f"its hash is {str(found)[:SHOWN]}.., not {str(wanted)[:SHOWN]}.."
            why = f"{path} is not the file that the scene was made with: {hashes}"
            problems.append(((*at, key), why, f"restore the file, or remove {key}_hash and compute the scene from its start"))
        data = _with(data, at, table | {key: str(path), f"{key}_hash": found or wanted})
    return data, problems


def move_paths(data: Any, source: str | Path, target: str | Path) -> None:
    """Changes the relative paths of a scene in the folder `source`, in place, to those of the same files from `target` on."""
    table = data.get("calibrate")
    curves = table.get("curve", ()) if isinstance(table, dict) else ()
    for holder, key in [*((holder, key) for _, holder, key in _tables(data)), *((curve, "file") for curve in curves)]:
        name = holder.get(key)
        if name and not Path(name).is_absolute():
            holder[key] = Path(os.path.relpath(Path(source, name), target)).as_posix()


def hash_of(path: str | Path) -> str:
    """BLAKE2b hash of the contents of a file, DIGITS hexadecimal digits."""
    with open(path, "rb") as file:
        return hashlib.file_digest(file, lambda: hashlib.blake2b(digest_size=DIGITS // 2)).hexdigest()


def without_paths(resolved: Any) -> Any:
    """Plain data of a scene that compares equal where files have the same contents, wherever they are."""
    for at, _, key in list(_tables(resolved)):
        inside = _at(resolved, at)
        if inside.get(f"{key}_hash") is not None:
            other = {name: value for name, value in inside.items() if name != f"{key}_hash"}
            resolved = _with(resolved, at, other | {key: f"contents with the hash {str(inside[f'{key}_hash'])[:SHOWN]}"})
    return resolved


def that_computes(resolved: Any) -> Any:
    """The same without tables on which no result depends (FOR_JUDGING)."""
    resolved = without_paths(resolved)
    return {key: value for key, value in resolved.items() if key not in FOR_JUDGING} if isinstance(resolved, dict) else resolved


def paths_of(scene: Any) -> dict[Place, str]:
    """The files that a scene names, by the paths of their keys."""
    found = {}
    for at, holder in [((), scene), *((("window", i), window) for i, window in enumerate(scene.window))]:
        for name, key in KEYS:
            value = getattr(getattr(holder, name, None), key, None)
            if value is not None:
                found[(*at, name, key)] = value
    found |= {(*at, "shaking", "file"): boundary.shaking.file for at, boundary in boundaries_of(scene) if boundary.shaking}
    return found


def boundaries_of(scene: Any) -> Iterator[tuple[Place, Any]]:
    """(path, boundary) of every boundary of a scene that was read."""
    yield from ((("boundary", k), boundary) for k, boundary in enumerate(scene.boundary))
    for i, stage in enumerate(scene.stage):
        yield from ((("stage", i, "boundary", k), boundary) for k, boundary in enumerate(stage.boundary))


def absent(scene: Any, path: Any) -> bool:
    """Whether the key at `path` names a file that is not on this machine."""
    name = paths_of(scene).get(tuple(path))
    return name is not None and not Path(name).is_file()


def with_hashes_of(other: Any, resolved: Any) -> Any:
    """Plain data of a scene, with hashes from `other` (of another machine) for files that are not on this one."""
    for at, inside, key in list(_tables(resolved)):
        theirs = _at(other, at)
        if not isinstance(theirs, dict) or inside.get(key) is None or theirs.get(key) is None:
            continue
        if inside.get(f"{key}_hash") is None and theirs.get(f"{key}_hash") is not None:
            resolved = _with(resolved, at, _at(resolved, at) | {f"{key}_hash": theirs[f"{key}_hash"]})
    return resolved


def remedy_for(path: str | Path) -> str:
    """The remedy where there is no file at the absolute path of a scene: how paths count, and what may have been meant."""
    path = Path(path)
    remedy = "paths count from the folder of the scene"
    for end in range(1, min(4, len(path.parts))):
        elsewhere = Path(*path.parts[-end:])
        if elsewhere.is_file() and elsewhere.absolute() != path:
            return f"{remedy}; there is {elsewhere.absolute()}"
    return remedy
