"""Line numbers of the keys of a TOML text, for messages: the standard reader gives values without line numbers."""

import re
from collections.abc import Mapping

from coupler_protocol.problems import KeyPath

_HEADER = re.compile(r"^\s*(\[\[?)\s*([^\]]+?)\s*\]")
_KEY = re.compile(r"^\s*((?:[A-Za-z0-9_\-]+|\"[^\"]*\")(?:\s*\.\s*(?:[A-Za-z0-9_\-]+|\"[^\"]*\"))*)\s*=")
_TEXT = re.compile(r"\"(?:[^\"\\]|\\.)*\"|'[^']*'|#.*$")
# All texts and comments: texts of several lines are needed, the others so that their quotation marks are not misread.
_LONG_TEXT = re.compile(r"\"\"\"(?:[^\\]|\\.)*?\"{3,5}|'''.*?'{3,5}|\"(?:[^\"\\\n]|\\.)*\"|'[^'\n]*'|#[^\n]*", re.DOTALL)


def _only_line_ends(found: re.Match[str]) -> str:
    """Replacement of a text: a text of several lines without its content; others unchanged."""
    return '""' + "\n" * found[0].count("\n") if "\n" in found[0] else found[0]


def _parts(dotted: str) -> KeyPath:
    return tuple(part.strip().strip('"') for part in dotted.split("."))


def locate(text: str) -> dict[KeyPath, int]:
    """Line number (from 1) of every table and key, by its path: ("material", 0, "density") -> 12.

    Keys inside inline tables and arrays have no entry; `line_of` returns the line of the enclosing key.
    """
    lines: dict[tuple, int] = {}
    counts: dict[tuple, int] = {}
    prefix: tuple = ()
    depth = 0
    for number, line in enumerate(_LONG_TEXT.sub(_only_line_ends, text).split("\n"), start=1):
        bare = _TEXT.sub('""', line)
        header = _HEADER.match(bare) if depth == 0 else None
        if header:
            prefix = _with_indices(_parts(header[2]), counts, new_item=header[1] == "[[")
            lines[prefix] = number
            continue
        key = _KEY.match(line) if depth == 0 else None
        if key:
            lines[prefix + _parts(key[1])] = number
            bare = bare.partition("=")[2]
        depth = max(0, depth + sum(bare.count(c) for c in "[{") - sum(bare.count(c) for c in "]}"))
    return lines


def _with_indices(parts: KeyPath, counts: dict[KeyPath, int], new_item: bool) -> KeyPath:
    """Path of a table header with the list positions that are implicit in TOML."""
    path: tuple = ()
    for place, part in enumerate(parts):
        path += (part,)
        if new_item and place == len(parts) - 1:
            counts[path] = counts.get(path, -1) + 1
        if path in counts:
            path += (counts[path],)
    return path


def line_of(lines: Mapping[KeyPath, int], path: KeyPath) -> int | None:
    """Line of `path`, or of the innermost enclosing table or key; None without one."""
    path = tuple(path)
    while path:
        if path in lines:
            return lines[path]
        path = path[:-1]
    return None
