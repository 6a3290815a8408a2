"""CSV files of discs: one disc a line below a header of column names.

x, y, radius [m] are required. vx, vy [m/s], spin [rad/s] are motion for stages in real time. material is soil or stone; discs of
one number in the column `stone` are one stone, -1 or an empty entry means soil. Numbers are written so that they are read with
the same bits.
"""

import csv
from pathlib import Path
from typing import IO, Any, NamedTuple

import numpy as np

from coupler_protocol.files.csv_rows import check_width, number_of, read_rows, refuse_lines
from coupler_protocol.problems import unfit

PLACE = ("x", "y", "radius")  # required columns
MOTION = ("vx", "vy", "spin")
MATERIALS = ("soil", "stone")
COLUMNS = (*PLACE, *MOTION, "material", "stone")
LARGEST = 2**31 - 1  # number of a stone


class DiscFile(NamedTuple):
    """Discs of a file: xy (n, 2), radius (n,) [m]; motion (n, 3): vx, vy, spin; stone (n,): its number or -1, None: no stones."""

    xy: np.ndarray
    radius: np.ndarray
    motion: np.ndarray
    stone: np.ndarray | None

    def counted_from(self, origin: np.ndarray) -> "DiscFile":
        """The same discs with positions counted from the point `origin` (2,) [m]."""
        return self._replace(xy=self.xy - origin) if np.any(origin) else self


def read(path: str | Path, key: str = "discs.file") -> DiscFile:
    """Reads the DiscFile at `path`; raises SceneError with the lines and columns that are wrong."""
    head, rows = read_rows(path, key, COLUMNS, PLACE)
    wrong = []
    table: dict[str, list[str | float]] = {name: [] for name in head}
    for number, row in rows:
        try:
            check_width(row, head)
            for name, text in zip(head, row, strict=True):
                table[name].append(_value(name, text.strip()))
        except ValueError as error:
            wrong.append((number, str(error)))
    refuse_lines(path, key, wrong, "one disc a line")
    if not rows:
        raise unfit(key, f"{path} holds no discs", "one disc a line under the head line")
    return _discs(path, key, table)


def _value(name: str, text: str) -> str | float:
    """Value of one entry; raises ValueError with the reason."""
    if name == "material":
        if text not in MATERIALS:
            raise ValueError(f"material {text!r} is not known: soil or stone")
        return text
    if name == "stone":
        if not text.removeprefix("-").isdecimal() and text:
            raise ValueError(f"stone {text!r} is not an integer")
        number = int(text or -1)
        if abs(number) > LARGEST:
            raise ValueError(f"stone {text!r} is larger than {LARGEST}")
        return number
    value = number_of(name, text)
    if name == "radius" and value <= 0.0:
        raise ValueError("the radius is not positive")
    return value


def _discs(path: str | Path, key: str, table: dict[str, Any]) -> DiscFile:
    radius = np.array(table["radius"])
    motion = np.column_stack([np.array(table.get(name, np.zeros(len(radius)))) for name in MOTION])
    stone = np.array(table["stone"], dtype=np.int64) if "stone" in table else None
    if "material" in table:
        marked = np.array(table["material"]) == "stone"
        number = np.full(len(radius), -1) if stone is None else stone
        wrong = np.flatnonzero(marked != (number >= 0))
        if len(wrong):
            first = int(wrong[0])
            what = f"disc {first + 1} is of material {table['material'][first]} and has stone {number[first]}"
            raise unfit(key, f"{path}: {what}", "give discs of stone the number of their stone, from 0, and discs of soil -1")
    if stone is not None and (stone < 0).all():
        stone = None
    return DiscFile(np.column_stack([table["x"], table["y"]]), radius, motion, stone)


def write(
    file: IO[str], xy: np.ndarray, radius: np.ndarray, stone: np.ndarray | None = None, motion: np.ndarray | None = None
) -> None:
    """Writes discs to an open text file, as `read` reads them; stone (n,): numbers or -1, motion (n, 3)."""
    out = csv.writer(file, lineterminator="\n")
    out.writerow([*PLACE, *(MOTION if motion is not None else ()), "material", "stone"])
    number = np.full(len(radius), -1) if stone is None else np.asarray(stone)
    columns = np.column_stack([xy, radius] + ([] if motion is None else [motion]))
    for values, k in zip(columns.tolist(), number.tolist(), strict=True):
        out.writerow([*map(repr, values), MATERIALS[k >= 0], k])
