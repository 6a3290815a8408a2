"""`colluvium export --format csv`: a frame, all histories and the list of frames as tables with units in their head lines.

Numbers are written so that they are read with the same bits; NaN is `nan`, and an empty entry was not recorded.
"""

import csv
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from colluvium.results.rank_file import Fields
from colluvium.results.run import Run
from coupler_protocol.files.quantities import CRACKS, FIELDS, PER_STEP

Columns = dict[str, Any]  # head with its unit: values (n,)


def write(run: Run, frame: int, folder: Path) -> list[Path]:
    """Writes the tables of a frame, counted from 0, and of the run into a folder; returns their paths."""
    tables = {"frames": _frames(run)}
    for rank in run.files:
        tables[f"histories.rank{rank}"] = _histories(run, rank)
        if run.files[rank].kind == "discrete":
            tables[f"cracks.rank{rank}"] = _cracks(run, rank)
        if run.has(frame, rank):
            tables |= {f"{name}.{frame}": table for name, table in _bodies(run, frame, rank).items()}
    paths = []
    for name, table in tables.items():
        if table:
            paths.append(folder / f"{name}.csv")
            _write(paths[-1], table)
    return paths


def _bodies(run: Run, frame: int, rank: int) -> dict[str, Columns]:
    """Tables of one rank in a frame by the beginning of their files' names."""
    if run.files[rank].kind == "continuum":
        gridpoints, zones = run.gridpoints(frame, rank), run.zones(frame, rank)
        corners = {f"gridpoint_{k + 1} [-]": column for k, column in enumerate(zones.corners.T)}
        return {
            "gridpoints": {"gridpoint [-]": np.arange(len(gridpoints.xy)), **_fields(run, frame, gridpoints)},
            "zones": {"zone [-]": np.arange(len(zones.xy)), **corners, **_fields(run, frame, zones)},
        }
    return {
        f"discs.rank{rank}": _fields(run, frame, run.discs(frame, rank)),
        f"contacts.rank{rank}": _fields(run, frame, run.contacts(frame, rank)),
    }


def _fields(run: Run, frame: int, bodies: Fields) -> Columns:
    """Columns of places and recorded fields, one for each component."""
    places = dict(zip(("x [m]", "y [m]"), bodies.xy.T, strict=True)) if "xy" in bodies else {}
    found: Columns = {}
    for name in bodies.names:
        if name not in ("corners", "ends", "xy"):
            values, unit = bodies[name], run.units(name, frame)
            parts = [f"_{part}" for part in FIELDS[name].components] if values.ndim > 1 else [""]
            columns = values.reshape(len(values), len(parts)).T
            found |= {f"{name}{part} [{unit}]": column for part, column in zip(parts, columns, strict=True)}
    first = {head: found.pop(head) for head in ("id [-]",) if head in found}
    return {**first, **places, **found}


def _histories(run: Run, rank: int) -> Columns:
    """Columns of all histories of a rank over their steps; a step that a history has twice has two rows."""
    rows: dict[tuple[int, int], dict[str, float]] = {}
    heads = []
    for name in run.histories(rank):
        steps, values = run.history(name, rank)
        heads.append(f"{name} [{_unit(run, name)}]")
        seen: dict[int, int] = {}
        for step, value in zip(steps.tolist(), values.tolist(), strict=True):
            seen[step] = seen.get(step, -1) + 1
            rows.setdefault((step, seen[step]), {})[heads[-1]] = value
    order = sorted(rows)
    columns: Columns = {"step [-]": [step for step, _ in order]}
    return columns | {head: [rows[key].get(head) for key in order] for head in heads} if heads else {}


def _cracks(run: Run, rank: int) -> Columns:
    """Columns of the list of cracks, one row a break; none without breaks."""
    found, columns = run.cracks(rank), dict[str, Any]()
    for name, column in found._asdict().items() if len(found.step) else ():
        about = CRACKS[name]
        parts = [f"_{part}" for part in about.components] or [""]
        values = column.reshape(len(column), len(parts)).T
        columns |= {f"{name}{part} [{about.unit}]": value for part, value in zip(parts, values, strict=True)}
    return columns


def _unit(run: Run, name: str) -> str:
    """Unit of a history over all stages: a rate is per step in static ones."""
    unit = run.units(name)
    modes = {run.in_real_time(stage) for stage in run.stages} if unit in PER_STEP else set()
    if False not in modes:
        return unit
    return f"{unit}, static stages: {PER_STEP[unit]}" if True in modes else PER_STEP[unit]


def _frames(run: Run) -> Columns:
    modes = {run.in_real_time(stage) for stage in run.stages}
    unit = "s" if False not in modes else "steps" if modes == {False} else "s, static stages: steps"
    names = {"step": "step [-]", "time": f"time [{unit}]", "stage": "stage", "gravity_factor": "gravity_factor [-]"}
    columns = {head: [getattr(info, name) for info in run.frames] for name, head in names.items()}
    return {"frame [-]": list(range(len(run.frames))), **columns}


def _write(path: Path, table: Columns) -> None:
    with open(path, "w", encoding="utf-8", newline="") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(table)
        out.writerows(zip(*(_texts(column) for column in table.values()), strict=True))


def _texts(column: Any) -> Iterable[str]:
    values = column.tolist() if isinstance(column, np.ndarray) else column
    return ("" if value is None else value if isinstance(value, str) else repr(value) for value in values)
