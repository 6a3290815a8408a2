"""CSV files of motions: a velocity over time, one moment a line below a header of column names.

time [s] is required and rises; x and y [m/s] are velocities to the right and upwards, at least one of them.
"""

from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from coupler_protocol.files.csv_rows import check_width, number_of, read_rows, refuse_lines
from coupler_protocol.problems import unfit

COLUMNS = ("time", "x", "y")


class Motion(NamedTuple):
    """Velocities (n,) [m/s] by component, at times (n,) [s]; linear between them."""

    time: NDArray[np.float64]
    velocity: dict[str, NDArray[np.float64]]

    @property
    def step(self) -> float:
        """Mean time [s] between two rows."""
        return float(self.time[-1] - self.time[0]) / (len(self.time) - 1)

    def drift(self, component: str) -> float:
        """Displacement [m] at the end of the motion."""
        return float(np.trapezoid(self.velocity[component], self.time))


def read(path: str | Path, key: str) -> Motion:
    """Reads the Motion at `path`; raises SceneError with all lines that are wrong."""
    head, rows = read_rows(path, key, COLUMNS, ("time",))
    components = [name for name in head if name != "time"]
    if not components:
        raise unfit(key, f"{path} has no column of velocities", f"columns: {', '.join(COLUMNS)}")
    wrong: list[tuple[int, str]] = []
    found: list[list[float]] = []
    for number, row in rows:
        try:
            check_width(row, head)
            values = [number_of(name, text.strip()) for name, text in zip(head, row, strict=True)]
            time, before = values[head.index("time")], found[-1][head.index("time")] if found else 0.0
            if found and time <= before:
                raise ValueError(f"time {time:g} s does not follow {before:g} s")
            if time < 0.0:
                raise ValueError(f"time {time:g} s is negative: times count from the start of the stage")
            found.append(values)
        except ValueError as error:
            wrong.append((number, str(error)))
    refuse_lines(path, key, wrong, "one moment a line, times rise")
    if len(found) < 2:
        raise unfit(key, f"{path} has {len(found)} moments", "give at least two, one a line under the header")
    columns = dict(zip(head, np.array(found).T, strict=True))
    return Motion(np.ascontiguousarray(columns["time"]), {name: np.ascontiguousarray(columns[name]) for name in components})
