"""One trial: steps from the elastic equilibrium with one factor, span after span, until there is a verdict.

Strength is divided in one step: gradual division gave the same factors within 0.3 % on three slopes, with associated flow and
without. Gravity grows in `GROWTH` spans: in one step it gave 8.14 for the slope of the paper, and gradually 7.98 at any rate,
because tension opens in another order.
"""

import time
from statistics import median
from typing import NamedTuple

import numpy as np

from fdm_server.fos.ground import LOOK, begin_trial, damping_of, weighted_length
from fdm_server.fos.verdict import UNDECIDED, Span, verdict
from fdm_server.model import Model, State
from fdm_server.step.gridpoint_pass import farthest, unbalanced_ratio, update_velocities
from fdm_server.step.momentum import Momentum
from fdm_server.step.safety import check_motion
from fdm_server.step.zone_pass import advance

GROWTH = 16  # spans in which gravity grows: twice the steps of settling


class Trial(NamedTuple):
    """Outcome of one factor."""

    factor: float
    verdict: str
    steps: int
    spans: list[Span]  # at full gravity
    farthest: float  # [m] largest displacement
    seconds: float
    model: Model
    state: State

    def row(self, span):
        """For JSON: outcome, and what each span of so many steps showed."""
        last = self.spans[-1]
        return {
            "factor": self.factor,
            "verdict": self.verdict,
            "steps": self.steps,
            "ratio": last.last_ratio,
            "motion_per_step": last.motion / span,
            "max_displacement": self.farthest,
            "seconds": round(self.seconds, 4),
            "spans": {name: [getattr(s, name) for s in self.spans] for name in ("ratio", "motion", "similarity")},
        }


def run_trial(scene, ground, factor, stop=lambda: None, say=lambda steps, ratio: None, accelerate=None):
    """Computes the Trial of a factor. Raises Unstable.

    stop() may end the work, say(steps, ratio) reports progress; accelerate(model, state, gravity) is the light half of a step
    (scripts/studies/equilibrium_study.py puts others in its place; None: by the damping of the scene).
    """
    begin = time.perf_counter()
    accelerate = accelerate or accelerator(scene)
    model, state = begin_trial(scene, ground, factor)
    spans, steps, before, found = [], 0, None, None
    gravity = ground.gravity
    if scene.fos.by == "gravity":
        for part in range(1, GROWTH + 1):
            gravity = ground.gravity * (1.0 + (factor - 1.0) * part / GROWTH)
            say(steps, _steps(model, state, gravity, ground.span, accelerate)[-1])
            steps += ground.span
            stop()
        state.displacement[:] = 0.0
    while found is None and steps + ground.span <= ground.budget:
        start = state.displacement.copy()
        ratios = _steps(model, state, gravity, ground.span, accelerate)
        steps += ground.span
        stop()
        check_motion(model, state)
        moved = state.displacement - start
        spans.append(Span(median(ratios), ratios[-1], weighted_length(model, moved), _similarity(model, moved, before)))
        say(steps, ratios[-1])
        found = verdict(spans, scene.fos.ratio, ground.settlement, farthest(state.displacement))
        before = moved
    seconds = time.perf_counter() - begin
    return Trial(factor, found or UNDECIDED, steps, spans, farthest(state.displacement), seconds, model, state)


def accelerator(scene):
    """The light half of a step under the damping of a scene's trials."""
    if damping_of(scene).kind is None:
        return update_velocities
    momentum = Momentum()

    def accelerate(model, state, gravity):
        update_velocities(model, state, gravity)
        momentum.take(model, state)

    return accelerate


def _steps(model, state, gravity, count, accelerate):
    """Takes `count` steps; returns the computed unbalanced ratios, the last one at the end."""
    ratios = []
    for step in range(1, count + 1):
        accelerate(model, state, gravity)
        advance(model, state)
        if step % LOOK == 0 or step == count:
            ratios.append(unbalanced_ratio(model, state, gravity))
    return ratios


def _similarity(model, moved, before):
    """Cosine between two displacement fields (N,2), weighted by mass; 0 if one is zero or missing."""
    if before is None:
        return 0.0
    lengths = weighted_length(model, moved) * weighted_length(model, before)
    if lengths == 0.0:
        return 0.0
    product = (model.weight_mass[:, None] * moved * before).sum() / model.weight_mass.sum()
    return float(np.clip(product / lengths, -1.0, 1.0))
