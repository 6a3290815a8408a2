"""Files that a scene names: where they are, and a hash of their contents.

A path counts from the folder of the scene. The scene that was read has the absolute path and a hash. So two machines, or a run
and the run that continues it, compare the contents of the files and not their places.
"""

import hashlib
import os
from pathlib import Path
from typing import Any

KEYS = (("discs", "file"), ("stones", "file"), ("stones", "shapes"))  # tables and keys with a path; the hash has the key KEY_hash
DIGITS = 64  # of a hash: 32 bytes, hexadecimal
SHOWN = 12  # digits of a hash in messages


def located(data: Any, folder: str | Path) -> tuple[Any, list[tuple[tuple[str, str], str, str]]]:
    """Plain data of a scene with absolute paths and hashes of files; and problems as (path of the key, reason, remedy)."""
    problems = []
    for table, key in KEYS if isinstance(data, dict) else ():
        name = data[table].get(key) if isinstance(data.get(table), dict) else None
        wanted = data[table].get(f"{key}_hash") if isinstance(data.get(table), dict) else None
        if not isinstance(name, str) or not name:
            if wanted is not None:
                problems.append(((table, f"{key}_hash"), f"a hash without {key}", f"add {key}, or remove the key"))
            continue
        if "\0" in name:
            problems.append(((table, key), f"{name!r} is not a path", "remove the zero byte"))
            continue
        path = Path(os.path.abspath(Path(folder, name)))
        found = hash_of(path) if path.is_file() else None
        if None not in (found, wanted) and found != wanted:
            hashes = f"its hash is {str(found)[:SHOWN]}.., not {str(wanted)[:SHOWN]}.."
            why = f"{path} is not the file that the scene was made with: {hashes}"
            problems.append(((table, key), why, f"restore the file, or remove {key}_hash and compute the scene from its start"))
        data = data | {table: data[table] | {key: str(path), f"{key}_hash": found or wanted}}
    return data, problems


def hash_of(path: str | Path) -> str:
    """BLAKE2b hash of the contents of a file, DIGITS hexadecimal digits."""
    with open(path, "rb") as file:
        return hashlib.file_digest(file, lambda: hashlib.blake2b(digest_size=DIGITS // 2)).hexdigest()


def without_paths(resolved: Any) -> Any:
    """Plain data of a scene that compares equal where files have the same contents, wherever they are."""
    for table, key in KEYS:
        inside = resolved.get(table) if isinstance(resolved, dict) else None
        if isinstance(inside, dict) and inside.get(f"{key}_hash") is not None:
            other = {name: value for name, value in inside.items() if name != f"{key}_hash"}
            resolved = resolved | {table: other | {key: f"contents with the hash {str(inside[f'{key}_hash'])[:SHOWN]}"}}
    return resolved


def absent(scene: Any, path: Any) -> bool:
    """Whether the key at `path` names a file that is not on this machine."""
    table = getattr(scene, path[0], None) if tuple(path) in KEYS else None
    name = getattr(table, path[1], None)
    return name is not None and not Path(name).is_file()


def with_hashes_of(other: Any, resolved: Any) -> Any:
    """Plain data of a scene, with hashes from `other` (of another machine) for files that are not on this one."""
    for table, key in KEYS:
        inside, theirs = (data.get(table) if isinstance(data, dict) else None for data in (resolved, other))
        if not isinstance(inside, dict) or not isinstance(theirs, dict) or inside.get(key) is None or theirs.get(key) is None:
            continue
        if inside.get(f"{key}_hash") is None and theirs.get(f"{key}_hash") is not None:
            resolved = resolved | {table: inside | {f"{key}_hash": theirs[f"{key}_hash"]}}
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
