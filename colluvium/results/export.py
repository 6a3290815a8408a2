"""`colluvium export`: the discs of a frame to begin another scene with, or frames for other programs.

A CSV file of discs (coupler_protocol/files/disc_csv.py) has no control discs. It has velocities for stages in real time only:
those of static stages are metres a step.
"""

import contextlib
import sys
from pathlib import Path

import numpy as np

from colluvium.results import meshes, tables
from colluvium.results.run import Run, open_run
from coupler_protocol.files import disc_csv

RING = 0  # number of the material of control discs


def write(
    run_dir: str | Path, frame: int | None = None, stage: str | None = None, rank: int = 1, out: str | Path | None = None
) -> int:
    """Writes the discs of frame `frame` (or of the last one of `stage`, or the last of all) to `out`; returns their number.

    out: path of a file, None: standard output. Raises NotRecordedError or IndexError for frames that do not exist.
    """
    with open_run(run_dir) as run:
        number = _number(run, frame, stage, _last(run, rank))
        discs, info = run.discs(number, rank), run.frames[number]
        free = discs.material != RING
        stone = discs.stone[free] if "stone" in discs else None
        motion = np.column_stack([discs.velocity, discs.spin])[free] if run.in_real_time(info.stage) else None
        with contextlib.nullcontext(sys.stdout) if out is None else open(out, "w", encoding="utf-8", newline="") as file:
            disc_csv.write(file, discs.xy[free], discs.radius[free], stone, motion)
        return int(free.sum())


def write_folder(
    run_dir: str | Path, form: str, frame: int | None = None, stage: str | None = None, out: str | Path | None = None
) -> list[Path]:
    """Writes a frame, chosen as in `write`, as form "csv" or "vtu", or all frames as "pvd", to `out`; returns the paths.

    out: path of a folder, None: RUN_DIR/export. Raises NotRecordedError or IndexError for frames that do not exist.
    """
    folder = Path(run_dir) / "export" if out is None else Path(out)
    with open_run(run_dir) as run:
        if not run.frames:
            raise IndexError(f"{run_dir}: no frame was recorded, so there is nothing to export")
        number = _number(run, frame, stage, -1)
        if not -len(run.frames) <= number < len(run.frames):
            raise IndexError(f"there is no frame {number}: {run_dir} has the frames 0 to {len(run.frames) - 1}")
        number %= len(run.frames)
        folder.mkdir(parents=True, exist_ok=True)
        if form == "pvd":
            return meshes.write_series(run, folder)
        return tables.write(run, number, folder) if form == "csv" else meshes.write_frame(run, number, folder)


def _number(run: Run, frame: int | None, stage: str | None, otherwise: int) -> int:
    """Number of the wanted frame: the last one of a stage, or the given one."""
    return run.last_frame(stage) if stage is not None else otherwise if frame is None else frame


def _last(run: Run, rank: int) -> int:
    """Number of the last frame that this rank recorded."""
    return max((i for i in range(len(run.frames)) if run.has(i, rank)), default=-1)
