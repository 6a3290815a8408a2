"""Rows of a CSV file with a header of column names; problems of the table itself are one SceneError."""

import csv
from collections.abc import Sequence
from math import isfinite
from pathlib import Path
from typing import NamedTuple

from coupler_protocol.problems import Problem, SceneError, unfit
from coupler_protocol.scene.named_files import remedy_for

SHOWN = 5  # problems of a file that are named
FARTHEST = 1e9  # larger numbers have lost the digits that count


class CsvRows(NamedTuple):
    """Column names, and (line number, entries) of every row that is not empty."""

    head: list[str]
    rows: list[tuple[int, list[str]]]


def read_rows(path: str | Path, key: str, columns: Sequence[str], required: Sequence[str]) -> CsvRows:
    """CsvRows of the file at `path`, which the key of a scene names; raises SceneError for a file or a header that is wrong."""
    path = Path(path)
    if not path.is_file():
        raise unfit(key, f"there is no file {path}", remedy_for(path))
    try:
        with open(path, encoding="utf-8-sig", newline="") as file:  # also with the mark that spreadsheets write
            rows = [(number, row) for number, row in enumerate(csv.reader(file), start=1) if row]
    except (UnicodeDecodeError, csv.Error) as error:
        raise unfit(key, f"{path} is not a CSV table: {error}", f"columns: {', '.join(columns)}") from None
    head = [name.strip() for name in rows[0][1]] if rows else []
    _check_head(path, key, head, columns, required)
    return CsvRows(head, rows[1:])


def _check_head(path: Path, key: str, head: Sequence[str], columns: Sequence[str], required: Sequence[str]) -> None:
    if len(head) == 1 and ";" in head[0]:
        raise unfit(key, f"{path}: columns are parted by semicolons", "part them by commas, with points in numbers")
    missing = [name for name in required if name not in head]
    strange = [name for name in head if name not in columns]
    twice = [name for name in head if head.count(name) > 1]
    for names, what in ((missing, "missing"), (strange, "not known"), (twice, "there twice")):
        if names:
            raise unfit(key, f"{path}: column {names[0]!r} is {what}", f"columns: {', '.join(columns)}")


def check_width(row: Sequence[str], head: Sequence[str]) -> None:
    """Raises ValueError if a row has not as many entries as the header."""
    if len(row) != len(head):
        hint = ": are decimals written with commas?" if len(row) > len(head) else ""
        raise ValueError(f"{len(row)} columns instead of {len(head)}{hint}")


def number_of(name: str, text: str) -> float:
    """The finite number in an entry; raises ValueError."""
    try:
        value = float(text.replace("_", "?"))
    except ValueError:
        value = float("nan")
    if not isfinite(value) or abs(value) > FARTHEST:
        raise ValueError(f"{name} {text!r} is not a number" + (": decimals have a point" if "," in text else ""))
    return value


def refuse_lines(path: str | Path, key: str, wrong: Sequence[tuple[int, str]], remedy: str) -> None:
    """Raises SceneError with the first SHOWN of the wrong lines (number, reason), if there are any."""
    if wrong:
        more = f" ({len(wrong)} lines are wrong)" if len(wrong) > SHOWN else ""
        raise SceneError([Problem(str(path), number, key, why + more, remedy) for number, why in wrong[:SHOWN]])
