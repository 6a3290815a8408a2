"""Choice of frames for pictures.

A slope that fails moves without limit in small strain, and a picture of the run-out shows a distorted mesh. So pictures show the
frames before it.
"""

import numpy as np

from colluvium.results.run import Run

REACH = 0.05  # largest displacement over the larger side of the model, above which a frame belongs to a run-out


def before_run_out(run: Run) -> list[int]:
    """Frames up to the last one whose largest displacement is within REACH; all frames if there is none."""
    size = max(float(np.ptp(body.xy, axis=0).max()) for body in run.bodies(0))
    frames = list(range(len(run.frames)))
    last = next((i for i in reversed(frames) if farthest(run, i) <= REACH * size), frames[-1])
    return frames[: last + 1]


def last_of_stages(run: Run, rank: int, most: int) -> list[int]:
    """The last frame of a rank in each stage before the run-out, for the last `most` stages."""
    last = {run.frames[i].stage: i for i in before_run_out(run) if run.has(i, rank)}
    return sorted(last.values())[-most:]


def of_last_stage(run: Run, rank: int, most: int) -> list[int]:
    """At most `most` frames of a rank, evenly distributed over its last stage before the run-out."""
    own = [i for i in before_run_out(run) if run.has(i, rank)]
    stage = [i for i in own if run.frames[i].stage == run.frames[own[-1]].stage]
    return sorted({stage[round(place)] for place in np.linspace(len(stage) - 1, 0, most + 1)[:-1]})


def farthest(run: Run, frame: int) -> float:
    """Largest displacement of a gridpoint or disc in a frame [m]."""
    return max(float(np.sqrt((body.displacement**2).sum(axis=1).max())) for body in run.bodies(frame))
