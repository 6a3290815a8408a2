"""Choice of frames for pictures.

In small strain, a slope that fails moves without limit, and its mesh at the present positions has no meaning. So frames of a
run-out are left out, except for the last frame of the run, which every series of pictures ends with; displacements of a run-out
are drawn at a part of their length. Discs alone and large strain have true positions: no frame of theirs is a run-out.
"""

from typing import Any

import numpy as np

from colluvium.results.run import Run

REACH = 0.05  # largest displacement over the larger side of the model, above which a frame belongs to a run-out


def has_true_positions(run: Run) -> bool:
    """Whether bodies are where their displacements put them: discs alone, or a scene with large strain."""
    return not run.recorded(0) or large_strain(run.scene)


def large_strain(scene: dict[str, Any]) -> bool:
    """Whether any stage of a scene (scene.json) computes in large strain."""
    always = bool((scene.get("grid") or {}).get("large_strain"))
    return always or any(stage.get("large_strain") for stage in scene.get("stage", ()))


def before_run_out(run: Run) -> list[int]:
    """Frames up to the last one whose largest displacement is within REACH; all frames if there is none."""
    frames = list(range(len(run.frames)))
    reach = np.finfo(float).max if has_true_positions(run) else REACH * size(run)
    last = next((i for i in reversed(frames) if farthest(run, i) <= reach), frames[-1])
    return frames[: last + 1]


def last(run: Run, rank: int | None = None) -> int:
    """The last frame (of a rank) in which all positions are numbers; the last frame if there is none."""
    own = [i for i in range(len(run.frames)) if rank is None or run.has(i, rank)]
    return next((i for i in reversed(own) if np.isfinite(farthest(run, i))), own[-1])


def last_of_stages(run: Run, rank: int, most: int) -> list[int]:
    """The last frame of a rank in each stage before the run-out and the last of the run: at most `most`, from the end."""
    ends = {run.frames[i].stage: i for i in before_run_out(run) if run.has(i, rank)}
    return sorted({*ends.values(), last(run, rank)})[-most:]


def of_last_stage(run: Run, rank: int, most: int) -> list[int]:
    """At most `most` frames of a rank: evenly over its last stage before the run-out, and the last of the run."""
    own = [i for i in before_run_out(run) if run.has(i, rank)]
    end = last(run, rank)
    stage = [i for i in own if run.frames[i].stage == run.frames[own[-1]].stage] if own else []
    if end in stage:
        return sorted({stage[round(place)] for place in np.linspace(len(stage) - 1, 0, most + 1)[:-1]})
    return [*sorted({stage[round(place)] for place in np.linspace(len(stage) - 1, 0, most)[:-1]}), end]


def drawn_part(run: Run, frame: int) -> float:
    """Share of the displacements that is drawn: 1, or in a run-out the share that keeps the largest within REACH."""
    return 1.0 if has_true_positions(run) else capped_part(run, frame)


def capped_part(run: Run, frame: int) -> float:
    """Share of the displacements with which the largest is within REACH."""
    moved = farthest(run, frame)
    return REACH * size(run) / moved if moved > REACH * size(run) else 1.0


def note(run: Run, frame: int) -> str:
    """Line for the title of a picture whose displacements are not drawn at their length, or ""."""
    part = drawn_part(run, frame)
    return f"\nrun-out: displacements drawn at {part:.2g} of their length" if part < 1.0 else ""


def size(run: Run) -> float:
    """Larger side of the model at the start [m]."""
    return max(float(np.ptp(body.xy, axis=0).max()) for body in run.bodies(0))


def farthest(run: Run, frame: int) -> float:
    """Largest displacement of a gridpoint or disc in a frame [m]."""
    return max(float(np.sqrt((body.displacement**2).sum(axis=1).max())) for body in run.bodies(frame))
