"""Macroscopic strength of the discs at a factor: biaxial tests of samples with the scene's discs and with the reduced ones."""

import os
from pathlib import Path
from typing import Any

from colluvium.lab import study
from colluvium.lab.summary import strength_in_words
from colluvium.lab.trials import trials_of
from colluvium.safety.reduction import reduced_discs
from coupler_protocol.scene.changes import after_stage
from coupler_protocol.scene.reader import build_scene

KIND = "biaxial"


def strengths(scene: Any, factor: float, out: Path, say: Any) -> dict[str, Any]:
    """{"1": .., "F": ..} peak strength of every sample with the discs as they are and divided by `factor`, and failed tests."""
    now = after_stage(scene, len(scene.stage) - 1)
    found: dict[str, Any] = {}
    for one in (1.0, factor):
        folder = out / f"{one:.6g}"
        folder.mkdir(parents=True, exist_ok=True)
        trials = trials_of(KIND, now.model_copy(update={"discs": reduced_discs(now.discs, one)}))
        for trial in trials:
            build_scene(trial.tables)  # reports problems before a process starts
        failed = study.compute(trials, folder, min(len(os.sched_getaffinity(0)), len(trials)), say)
        summary, _ = study.evaluate(KIND, trials, folder)
        samples = {name: own["peak"] for name, own in summary["samples"].items() if own.get("peak")}
        found[f"{one:.6g}"] = {"samples": samples, "failed": [f"{one.name}: {one.message}" for one in failed]}
    return found


def as_lines(found: dict[str, Any], scene: Any, factor: float) -> list[str]:
    """Lines of text: c and phi of the discs at both factors, and of the zones."""
    from fdm_server.fos.reduction import reduced

    now = after_stage(scene, len(scene.stage) - 1)
    lines = []
    for one, own in zip((1.0, factor), found.values(), strict=True):
        for m in reduced(now.material, one, scene.fos):
            if m.mohr_coulomb is not None:
                law = m.mohr_coulomb
                lines.append(f"at {one:.4g}: zones of {m.name!r}: c {law.cohesion / 1e3:.1f} kPa, phi {law.friction:.1f} deg")
        lines += [f"at {one:.4g}: discs, {name}: {strength_in_words(peak)}" for name, peak in own["samples"].items()]
        lines += [f"at {one:.4g}: test failed: {words}" for words in own["failed"]]
    return lines
