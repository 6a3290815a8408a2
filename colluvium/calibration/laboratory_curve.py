"""Curve of a soil laboratory as a target: a CSV file with names, units and one row a point.

    strain, deviator, volume          axial strain, s1 - s3, change of the volume over the volume (growth positive)
    %, kPa, %

Without `volume` there is no Poisson's ratio, no dilation, and in plane strain no Young's modulus. Compression is positive. The
columns `axial` and `side` may replace `deviator`, so that a curve of `colluvium lab biaxial` is such a file as well. The answers
are defined as those of the tests (docs/lab.md). A triaxial test gives Young's modulus and Poisson's ratio directly:

    E = d(deviator) / d(strain),    nu = (1 + d(volume) / d(strain)) / 2          (1)
"""

import csv
from pathlib import Path
from typing import NamedTuple

import numpy as np

from colluvium.lab.answers import answers_of
from colluvium.lab.curves import COLUMNS, Curve

STRAINS, STRESSES = {"-": 1.0, "": 1.0, "%": 0.01}, {"Pa": 1.0, "kPa": 1e3, "MPa": 1e6}
NEEDED = {"strain": STRAINS, "deviator": STRESSES, "volume": STRAINS, "axial": STRESSES, "side": STRESSES}
POINTS = 400  # of the curve that is evaluated, evenly in strain
FEWEST = 5  # points of a file


class Measured(NamedTuple):
    """Answers of a curve: peak deviator [Pa]; E [Pa], nu in three dimensions and dilation [deg], None if not measured."""

    deviator: float
    young: float | None
    poisson: float | None
    dilation: float | None


def measured(path: Path, confinement: float, triaxial: bool) -> Measured:
    """Answers of the file of a test at `confinement` [Pa]; raises ValueError with the fault of the file, or OSError."""
    columns = _read(path)
    if (np.diff(columns["strain"]) <= 0.0).any():
        raise ValueError("strain does not grow from row to row")
    even = np.linspace(columns["strain"][0], columns["strain"][-1], POINTS)
    load = np.interp(even, columns["strain"], columns["deviator"])
    has_volume = "volume" in columns
    volume = np.interp(even, columns["strain"], columns["volume"]) if has_volume else -0.5 * even
    found = {name: np.zeros(POINTS) for name in COLUMNS} | {"strain": even, "wall_strain": even, "side_strain": -(volume + even)}
    found |= {"volume": volume, "axial": load + confinement, "side": np.full(POINTS, confinement)}
    answers = answers_of("biaxial", Curve(found, POINTS - 1))
    strength = answers["peak_axial"] - answers["peak_side"]
    if not has_volume:
        return Measured(strength, answers["E2"] if triaxial else None, None, None)
    young, poisson = (answers["E2"], 0.5 * answers["nu2"]) if triaxial else (answers["E"], answers["nu"])
    return Measured(strength, young, poisson, answers["dilation"])


def _read(path: Path) -> dict[str, np.ndarray]:
    """Columns of a file in SI units, with a `deviator`."""
    with path.open(newline="", encoding="utf-8-sig") as file:
        rows = [[cell.strip() for cell in row] for row in csv.reader(file) if any(cell.strip() for cell in row)]
    if len(rows) < 2 + FEWEST:
        raise ValueError(f"{max(len(rows) - 2, 0)} points: a line of names, a line of units and {FEWEST} points are needed")
    names, units, *points = rows
    found = {}
    for number, name in enumerate(names):
        if name not in NEEDED:
            continue
        unit = units[number] if number < len(units) else ""
        if unit not in NEEDED[name]:
            raise ValueError(f"{name} in {unit!r}: the second line gives units, {', '.join(filter(None, NEEDED[name]))}")
        try:
            found[name] = NEEDED[name][unit] * np.array([float(row[number]) for row in points])
        except (ValueError, IndexError):
            raise ValueError(f"a row has no number in the column {name}") from None
        if not np.isfinite(found[name]).all():
            raise ValueError(f"the column {name} holds a value that is not finite")
    if "deviator" not in found and {"axial", "side"} <= set(found):
        found["deviator"] = found["axial"] - found["side"]
    for name in ("strain", "deviator"):
        if name not in found:
            raise ValueError(f"there is no column {name}: its columns are {', '.join(names)}")
    return found
