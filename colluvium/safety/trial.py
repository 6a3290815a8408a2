"""One trial of a coupled search: a run that branches from the slope at rest, in its own processes, and its row of fos.json."""

import json
import shutil
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from colluvium.running import processes
from colluvium.safety import scenes
from colluvium.safety.judge import Judge, farthest, read_rows, spans_of
from coupler_protocol import exits
from coupler_protocol.files import run_json
from fdm_server.fos.verdict import FAILS, RESTS, UNDECIDED

ROW = "trial.json"  # last file of a finished trial


class Base(NamedTuple):
    """What all trials have in common: folder, scene and tables of the slope at rest, and the steps and lengths of its grid."""

    folder: Path
    scene: Any
    tables: dict[str, Any]
    gravity: float  # [m/s2]
    settlement: float  # [m] of the elastic grid
    span: int  # steps
    budget: int  # steps


def run_trial(base: Base, factor: float, out: Path, asked: Callable[[], bool], threads: int = 1) -> dict[str, Any]:
    """The row of a factor; computed unless `out` has it. asked(): whether to end early.

    Raises Interrupted where it was asked, and the exit of a run that failed for another reason than its physics.
    """
    tables = scenes.trial_tables(base.scene, base.tables, factor, base.budget)
    judge = Judge(
        out, scenes.trial_name(base.scene), base.span, base.scene.fos.ratio, base.settlement, base.gravity, len(base.scene.window)
    )
    known = {"scene": scenes.checked(tables).digest(), "span": base.span, "settlement": base.settlement}
    if (row := _finished(out, known)) is not None:
        return row
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir(parents=True)
    plugin, path = judge.write(), out / "scene.toml"
    path.write_text(processes.as_toml(tables), encoding="utf-8")
    last = base.scene.stage[-1].name
    options = [f"--from={base.folder}@{last}", f"--plugin={plugin}", "--quiet", "--checkpoint=1e9", f"--threads={threads}"]
    begin = time.perf_counter()
    code = processes.run_files(path, out, len(base.scene.window), options, None, asked)
    if code not in (exits.DONE, exits.PHYSICS):
        processes.checked(code)
    row = _row(base, factor, out, code) | {"seconds": round(time.perf_counter() - begin, 3)}
    run_json.write_json(out / ROW, {"of": known, "row": row})
    return row


def _finished(out: Path, known: dict[str, Any]) -> dict[str, Any] | None:
    """The row in the folder of a trial, if it is finished and of the same scene and judge."""
    path = out / ROW
    if not path.exists():
        return None
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
        return found["row"] if found["of"] == known else None
    except (ValueError, KeyError, TypeError):
        return None


def _row(base: Base, factor: float, out: Path, code: int) -> dict[str, Any]:
    """Outcome of a run that ended, and what each span showed."""
    stage = run_json.read(out / run_json.NAME)["stages"][-1]
    sides = [read_rows(out, rank) for rank in range(len(base.scene.window) + 1)]
    count = min(len(side) for side in sides)
    sides = [side[:count] for side in sides]
    spans = spans_of(sides)
    said = stage["ended_by"] if stage["ended_by"] in (RESTS, FAILS) else UNDECIDED
    row = {
        "factor": factor,
        "verdict": said,
        "steps": stage["steps"],
        "ratio": spans[-1].last_ratio if spans else None,
        "max_displacement": farthest(sides),
        "bonds_broken": [int(broken) for broken in stage["bonds_broken"]],
        "folder": out.name,
        "spans": {name: [getattr(span, name) for span in spans] for name in ("ratio", "motion", "similarity")},
    }
    return row | ({"stopped": run_json.read(out / run_json.NAME)["reason"]} if code else {})
