"""`colluvium export`: the discs of a frame as a CSV file (coupler_protocol/files/disc_csv.py), to begin another scene with.

Control discs are left out. Velocities are written for stages in real time only: those of static stages are metres a step.
"""

import contextlib
import sys
from pathlib import Path

import numpy as np

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
        number = run.last_frame(stage) if stage is not None else _last(run, rank) if frame is None else frame
        discs, info = run.discs(number, rank), run.frames[number]
        free = discs.material != RING
        stone = discs.stone[free] if "stone" in discs else None
        motion = np.column_stack([discs.velocity, discs.spin])[free] if run.in_real_time(info.stage) else None
        with contextlib.nullcontext(sys.stdout) if out is None else open(out, "w", encoding="utf-8", newline="") as file:
            disc_csv.write(file, discs.xy[free], discs.radius[free], stone, motion)
        return int(free.sum())


def _last(run: Run, rank: int) -> int:
    """Number of the last frame that this rank recorded."""
    return max((i for i in range(len(run.frames)) if run.has(i, rank)), default=-1)
