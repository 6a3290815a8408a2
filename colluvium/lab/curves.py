"""Curves of a trial, from the histories of its run: one row a point, compression positive, volume growth positive.

| column | biaxial, oedometer, brazilian | shear |
|---|---|---|
| strain | axial strain of the discs | displacement over height |
| wall_strain | axial strain between the walls | the same |
| side_strain | lateral strain of the discs | - (zero) |
| volume | change of the area over the area | rise of the upper wall over height |
| axial | stress on the upper wall (brazilian: force over diameter) | shear stress on the plane |
| side | mean stress on the side walls | normal stress |
| work, stored, kinetic, lost | energy since the test began, J per m3 of the sample | the same |

Strains of the discs are those of `dem_server/observe/sample_strain.py`: the contacts with the walls do not take part. `work` is
that of the walls on the discs (trapezoidal rule over the points), `lost` = work - stored - kinetic: friction, damping, bonds.
"""

import csv
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from colluvium.lab.trials import Trial
from colluvium.results.run import open_run

COLUMNS = {
    "step": "-",
    "strain": "-",
    "wall_strain": "-",
    "side_strain": "-",
    "volume": "-",
    "axial": "Pa",
    "side": "Pa",
    "work": "J/m3",
    "stored": "J/m3",
    "kinetic": "J/m3",
    "lost": "J/m3",
    "bonds_broken": "-",
}


@dataclass(frozen=True)
class Curve:
    """Columns (n,) of a trial's test by name; `turn`: number of the point at which the wall of an oedometer turns back."""

    columns: dict[str, np.ndarray]
    turn: int

    def __getitem__(self, name: str) -> np.ndarray:
        """A column."""
        return self.columns[name]


class Histories:
    """Histories of a run, of the points from the last before the stage `test` on."""

    def __init__(self, run: Any) -> None:
        self.run = run
        before = run.frames[run.last_frame("bond")].step
        steps, _ = run.history("elastic_energy")
        self.first = max(0, int(np.searchsorted(steps, before, side="right")) - 1)
        self.step = steps[self.first :] - before
        self.turn = int(np.searchsorted(steps, run.frames[run.last_frame("test")].step, side="right")) - 1 - self.first

    def __call__(self, name: str) -> np.ndarray:
        """A history, from the last point before the test on."""
        return np.asarray(self.run.history(name)[1][self.first :], dtype=float)

    def wall(self, name: str, what: str) -> tuple[np.ndarray, np.ndarray]:
        """x and y of `force` [N] on a wall, or of its middle ("" for what) [m]."""
        kind = f"wall_{what}_" if what else "wall_"
        return self(f"{kind}x:{name}"), self(f"{kind}y:{name}")


def curve_of(trial: Trial, folder: Path) -> Curve:
    """The curve of a finished trial."""
    with open_run(folder) as run:
        found = Histories(run)
        columns = (
            _of_shear_box(found) if trial.kind == "shear" else _of_sample(found, trial.kind == "brazilian", trial.body.width)
        )
        columns |= _energies(found, list(trial.body.walls), trial)
        columns |= {"step": found.step, "bonds_broken": found("bonds_broken") - found("bonds_broken")[0]}
    return Curve({name: columns[name] for name in COLUMNS}, found.turn)


def _of_sample(found: Histories, brazilian: bool, width: float) -> dict[str, np.ndarray]:
    """Columns of a sample between a floor and an upper wall, and side walls unless it is a Brazilian disc."""
    height = found.wall("top", "")[1] - found.wall("bottom", "")[1]
    load = 0.5 * (found.wall("top", "force")[1] - found.wall("bottom", "force")[1])
    axial, across = -found("strain_yy"), -found("strain_xx")
    axial, across = axial - axial[0], across - across[0]
    side = np.zeros_like(load)
    if not brazilian:
        width = found.wall("right", "")[0] - found.wall("left", "")[0]
        side = 0.5 * (found.wall("right", "force")[0] - found.wall("left", "force")[0]) / height
    return {
        "strain": axial,
        "wall_strain": 1.0 - height / height[0],
        "side_strain": across,
        "volume": -(axial + across),
        "axial": load / width,
        "side": side,
    }


def _of_shear_box(found: Histories) -> dict[str, np.ndarray]:
    """Columns of a shear box: stresses on the plane, whose length is the part on which both halves face each other."""
    top, floor = found.wall("top", "")[1], found.wall("bottom", "")
    height = top[0] - floor[1][0]
    moved = floor[0] - floor[0][0]
    left, right = found.wall("upper_left", ""), found.wall("upper_right", "")
    length = right[0] - left[0]
    upper = sum(found.wall(f"upper_{name}", "force")[0] for name in ("left", "right"))
    lower = sum(found.wall(f"lower_{name}", "force")[0] for name in ("left", "right"))
    normal = found.wall("top", "force")[1]
    return {
        "strain": moved / height,
        "wall_strain": moved / height,
        "side_strain": np.zeros_like(moved),
        "volume": (top - top[0]) / height,
        "axial": 0.5 * (upper - lower) / (length - moved),
        "side": normal / length,
    }


def _energies(found: Histories, walls: list[str], trial: Trial) -> dict[str, np.ndarray]:
    """Work of the walls on the discs and where it went, per volume of the sample."""
    power = np.zeros(max(len(found.step) - 1, 0))
    for name in walls:
        for force, place in zip(found.wall(name, "force"), found.wall(name, ""), strict=True):
            power -= 0.5 * (force[1:] + force[:-1]) * np.diff(place)
    share = 1.0 / (trial.body.width * trial.body.height * (0.785 if trial.kind == "brazilian" else 1.0))
    work = share * np.append(0.0, np.cumsum(power))
    stored, kinetic = (share * (energy - energy[0]) for energy in (found("elastic_energy"), found("kinetic_energy")))
    return {"work": work, "stored": stored, "kinetic": kinetic, "lost": work - stored - kinetic}


def write_csv(curve: Curve, path: Path) -> None:
    """Writes a curve with units in the second line."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w", newline="", encoding="utf-8") as file:
        rows = csv.writer(file)
        rows.writerow(COLUMNS)
        rows.writerow(COLUMNS.values())
        rows.writerows(zip(*(map("{:.9g}".format, column) for column in curve.columns.values()), strict=True))


def read_csv(path: Path) -> dict[str, np.ndarray]:
    """Columns of a file of `write_csv`."""
    with path.open(newline="", encoding="utf-8") as file:
        names, _, *rows = list(csv.reader(file))
    return dict(zip(names, np.array(rows, dtype=float).T, strict=True))
