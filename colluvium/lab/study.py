"""A laboratory of one kind of test: trials in processes, their curves as CSV, answers.json."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from colluvium.lab.answers import answers_of
from colluvium.lab.curves import Curve, curve_of, write_csv
from colluvium.lab.summary import summary
from colluvium.lab.trials import Trial
from colluvium.running.pool import Failed, Job, run_all

ANSWERS = "answers.json"
SPEED = 6e6  # discs x steps a second on one core, roughly


def jobs_of(trials: list[Trial], out: Path) -> list[Job]:
    """The run of each trial, in a folder of its own."""
    return [Job(trial.name, trial.tables, out / "trials" / trial.name) for trial in trials]


def forecast(trials: list[Trial], out: Path, at_once: int) -> list[str]:
    """What trials would cost, as lines of text."""
    jobs = jobs_of(trials, out)
    left = [trial for trial, job in zip(trials, jobs, strict=True) if not job.done()]
    seconds = sum(trial.disc_steps for trial in left) / SPEED
    lines = [f"{len(trials)} trials, {len(trials) - len(left)} of them done; {at_once} at once"]
    lines += [
        f"{trial.name}: about {trial.discs:.0f} discs, {trial.loading.steps} steps of {trial.loading.rate:.3g} to a strain of "
        f"{trial.loading.strain:.3g}"
        for trial in left
    ]
    return [
        *lines,
        f"about {seconds / at_once:.0f} s on {at_once} idle cores, without compilation ({SPEED:.0e} disc-steps a second)",
    ]


def compute(trials: list[Trial], out: Path, at_once: int, report: Callable[[str], None]) -> list[Failed]:
    """Runs all trials that are not done; returns those that failed."""
    return run_all(jobs_of(trials, out), at_once, report)


def evaluate(kind: str, trials: list[Trial], out: Path) -> tuple[dict[str, Any], dict[str, Curve]]:
    """Writes curves and answers of all finished trials; returns the summary and the curves by the name of the trial."""
    rows, curves = [], {}
    for trial, job in zip(trials, jobs_of(trials, out), strict=True):
        if job.done():
            curve = curves[trial.name] = curve_of(trial, job.out)
            write_csv(curve, out / "curves" / f"{trial.name}.csv")
            place = {"name": trial.name, "sample": trial.sample, "pressure": trial.pressure, "seed": trial.seed}
            rows.append(place | {"factor": trial.factor} | answers_of(kind, curve))
    found = summary(kind, rows)
    (out / ANSWERS).write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    return found, curves
