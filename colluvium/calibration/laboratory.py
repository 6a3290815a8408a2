"""Tests of samples with given parameters: biaxial tests of colluvium/lab, each computed once and kept.

A test has a folder of its own in `trials`, numbered by its set of parameters, and a line in `trials.jsonl`: parameters, sample,
stress, seed, answers, seconds of its run. A test whose scene is in that file is not computed again.

A short test, for the moduli, is made at one stress and ends at half of the strength; its steps are enough for the loading to be
quasi-static (docs/lab.md), at least those of an oedometer. Full tests have the rate and strain that the targets give, which
are the same for all sets.
"""

import hashlib
import json
import resource
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from colluvium.calibration.parameters import Values, scene_with
from colluvium.calibration.targets import Targets, strength_name
from colluvium.lab import trials as lab_trials
from colluvium.lab.answers import answers_of
from colluvium.lab.curves import curve_of
from colluvium.lab.loading import ELASTIC, FEWEST, LEAST, LONG, MOST, QUIET, loading
from colluvium.lab.specimen import specimen
from colluvium.lab.trials import Trial
from colluvium.running.pool import Failed, Job, run_all
from colluvium.running.processes import as_toml
from coupler_protocol.files import run_json

KEPT = "trials.jsonl"
HALF = 0.5  # of the strength, at which a short test ends
ANSWERS = ("E", "nu", "dilation", "peak_axial", "peak_side", "peak_strain", "side_bias", "bonds_broken")  # that are kept


class Cost(NamedTuple):
    """Tests that were computed, seconds of their runs, and processor seconds of their processes."""

    tests: int = 0
    seconds: float = 0.0
    processor: float = 0.0


class SampleTests:
    """Laboratory of a scene; `failed`: tests that ended with an error; `factor`: of the rate of all tests."""

    factor = 1.0

    def __init__(
        self, scene: Any, sample: str, targets: Targets, out: Path, at_once: int, report: Callable[[str], None]
    ) -> None:  # fmt: skip
        """sample: soil, clump or cluster; out: folder of the calibration; report(text): called when a test fails."""
        self.scene, self.sample, self.targets, self.out = scene, sample, targets, out
        self.at_once, self.report = at_once, report
        self.pressures = [goal.pressure for goal in targets.goals if goal.pressure] or [middle(scene.lab.confinement)]
        self.failed: list[Failed] = []
        self.rows = {row["scene"]: row for row in read(out / KEPT)}
        self.used: dict[str, dict[str, Any]] = {}

    def cost(self, short: bool) -> int:
        """Number of tests of one sample."""
        return 1 if short else len(self.pressures)

    def measure(self, values: Values, seeds: Sequence[int], short: bool) -> dict[int, dict[str, float]]:
        """Answers by the name of the goal, of the sample of each seed; a seed whose tests all failed is missing."""
        tests = [self.trial(values, pressure, seed, short) for seed in seeds for pressure in self.pressures_of(short)]
        self._compute(values, tests, short)
        found = {}
        for seed in seeds:
            own = [row for test in tests if test.seed == seed and (row := self.rows.get(key_of(test)))]
            self.used |= {row["scene"]: row for row in own}
            if own:
                found[seed] = _moduli(own) if short else _moduli(own) | _peaks(own)
        return found

    def spent(self) -> Cost:
        """Cost of all tests that the calibration used."""
        rows = self.used.values()
        return Cost(len(rows), sum(row["seconds"] for row in rows), sum(row["processor"] for row in rows))

    def trial(self, values: Values, pressure: float, seed: int, short: bool) -> Trial:
        """The test of one sample at one stress."""
        scene = scene_with(self.scene, values)
        lab = scene.lab.model_copy(update=self._lengths(scene, pressure, short))
        test = lab_trials.trial("biaxial", scene.model_copy(update={"lab": lab}), self.sample, pressure, seed, self.factor)
        record = test.tables["record"] | {"every": max(1, test.loading.steps)}  # curves need no frames
        return test._replace(tables=test.tables | {"record": record})

    def pressures_of(self, short: bool) -> list[float]:
        """Stresses of a sample."""
        return [middle(self.pressures)] if short else self.pressures

    def _lengths(self, scene: Any, pressure: float, short: bool) -> dict[str, float]:
        """Keys of [lab] that set strain and rate of a test: the targets' own, or those of the estimate of the scene."""
        body = specimen("biaxial", scene.discs.radius, scene.lab)
        plain = loading("biaxial", scene, body, pressure, self._content(scene))
        young, peak = self.targets.value("young"), self._peak(pressure)
        yields = peak / young if young and peak else plain.strain / LONG
        quiet = QUIET * yields / (body.height / (2.0 * scene.discs.radius))
        if short:
            return {"strain": HALF * yields, "rate": min(quiet, HALF * yields / ELASTIC)}
        strain = scene.lab.strain or min(max(LONG * yields, LEAST), MOST)
        return {"strain": strain, "rate": scene.lab.rate or min(quiet, strain / FEWEST)}

    def _content(self, scene: Any) -> float:
        return scene.stones.content if self.sample != "soil" else 0.0

    def _peak(self, pressure: float) -> float | None:
        """Target of the strength at a stress [Pa], that at the next higher stress where there is none; None without any."""
        peaks = {goal.pressure: goal.value for goal in self.targets.goals if goal.pressure}
        return peaks.get(pressure) or (peaks[max(peaks)] if peaks else None)

    def _compute(self, values: Values, tests: list[Trial], short: bool) -> None:
        """Runs the tests that are not kept, and keeps all that are done, also after Ctrl-C."""
        left = [(test, self._job(values, test, short)) for test in tests if key_of(test) not in self.rows]
        ended = {job.name for _, job in left if job.done()}  # before an interruption
        before = _processor_seconds()
        try:
            for one in run_all([job for _, job in left], self.at_once, lambda text: None):
                self.failed.append(one)
                self.report(f"{one.name}: exit code {one.code}: {one.message}")
        finally:
            new = [(test, job) for test, job in left if job.done()]
            each = (_processor_seconds() - before) / max(len([job for _, job in new if job.name not in ended]), 1)
            for test, job in new:
                self._keep(values, test, job, short, None if job.name in ended else each)

    def _job(self, values: Values, test: Trial, short: bool) -> Job:
        """The run of a test; its folder begins with the number of its set."""
        numbers = {json.dumps(row["parameters"], sort_keys=True): row["set"] for row in self.rows.values()}
        number = numbers.get(json.dumps(values, sort_keys=True), max(numbers.values(), default=0) + 1)
        name = f"set{number:03d}.{test.name}{'.short' if short else ''}"
        return Job(name, test.tables, self.out / "trials" / name)

    def _keep(self, values: Values, test: Trial, job: Job, short: bool, processor: float | None) -> None:
        """Adds a finished test to the file; processor: seconds, None if its run ended in an earlier call."""
        seconds = run_json.read(job.out / run_json.NAME).get("seconds") or 0.0
        found = answers_of("biaxial", curve_of(test, job.out))
        row = {
            "scene": key_of(test),
            "set": int(job.name[3:6]),
            "folder": job.name,
            "parameters": values,
            "sample": test.sample,
            "pressure": test.pressure,
            "seed": test.seed,
            "short": short,
            "steps": test.loading.steps,
            "answers": {name: found[name] for name in ANSWERS},
            "seconds": seconds,
            "processor": seconds if processor is None else processor,
        }
        self.rows[row["scene"]] = row
        with (self.out / KEPT).open("a", encoding="utf-8") as file:
            file.write(json.dumps(row) + "\n")


def _processor_seconds() -> float:
    """Processor seconds of all processes that this one started and that have ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def key_of(test: Trial) -> str:
    """Hash of the scene of a test."""
    return hashlib.blake2b(as_toml(test.tables).encode(), digest_size=8).hexdigest()


def middle(pressures: Sequence[float]) -> float:
    """The middle one of stresses, the lower of two."""
    return sorted(pressures)[(len(pressures) - 1) // 2]


def read(path: Path) -> list[dict[str, Any]]:
    """Rows of a file of tests; a last line that was cut is left out."""
    found = []
    for line in path.read_text(encoding="utf-8").splitlines() if path.exists() else []:
        try:
            found.append(json.loads(line))
        except json.JSONDecodeError:
            break
    return found


def _moduli(rows: list[dict[str, Any]]) -> dict[str, float]:
    """Moduli of a sample by the name of the goal: means over its stresses."""
    return {name: _mean(rows, key) for name, key in (("young", "E"), ("poisson", "nu"))}


def _peaks(rows: list[dict[str, Any]]) -> dict[str, float]:
    """Strength of a sample at each stress and mean dilation, by the name of the goal."""
    peaks = {strength_name(row["pressure"]): row["answers"]["peak_axial"] - row["answers"]["peak_side"] for row in rows}
    return peaks | {"dilation": _mean(rows, "dilation")}


def _mean(rows: list[dict[str, Any]], key: str) -> float:
    return float(np.mean([row["answers"][key] for row in rows]))
