"""Gravity and boundaries over the stages: values that stages inherit, and gravity at any step."""

from typing import Any, NamedTuple

import numpy as np

from coupler_protocol.scene.stage_kinds import of
from coupler_protocol.scene.tables.boundary import Boundary


class Leg(NamedTuple):
    """Gravity during one stage: the factor changes linearly from `start` to `end` over `over` steps, then is constant."""

    gravity: float  # [m/s2] at factor 1
    start: float
    end: float
    over: int

    def factor(self, step: int) -> float:
        """Gravity factor of the step with this number (from 0) in the stage."""
        if step + 1 >= self.over:
            return self.end
        return self.start + (self.end - self.start) * ((step + 1) / self.over)

    def factors(self, first: int, count: int) -> np.ndarray:
        """Gravity factors (count,) of the steps from `first` on, with the bits of `factor`."""
        steps = np.arange(first + 1, first + count + 1)
        if first + 1 >= self.over:
            return np.full(count, float(self.end))
        return np.where(steps >= self.over, self.end, self.start + (self.end - self.start) * (steps / self.over))

    def at(self, step: int) -> float:
        """Gravity [m/s2] of that step."""
        return self.gravity * self.factor(step)


def leg_of(stage: Any, gravity: float, factor: float) -> Leg:
    """Leg of a stage; gravity [m/s2], factor: at the end of the previous stage."""
    ramp = stage.gravity_factor
    gravity = gravity if stage.gravity is None else stage.gravity
    return Leg(gravity, factor, factor, 0) if ramp is None else Leg(gravity, factor, ramp.to, ramp.over)


def plan(scene: Any) -> list[Leg]:
    """A Leg for every stage, each run to its end. Later stages inherit gravity and factor, except from discarded stages.

    If a stage ends inside its ramp, the continuum uses `leg_of` with the factor that was reached.
    """
    gravity, factor, legs = 0.0, 1.0, []
    for stage in scene.stage:
        legs.append(leg_of(stage, gravity, factor))
        if not stage.discard:
            gravity, factor = legs[-1].gravity, legs[-1].end
    return legs


def large_strain(scene: Any, stage: Any) -> bool:
    """Whether a stage computes in large strain; never in an equilibrium, which finds the stress in the shape of the scene."""
    if scene.grid is None:
        return False
    return not of(stage).drawn and (scene.grid.large_strain or stage.large_strain is True)


def acting_boundaries(scene: Any, index: int) -> list[Boundary]:
    """Boundaries that act in the stage with this number, in order; those of a discarded stage act only in it."""
    stages = scene.stage[: index + 1]
    return [*scene.boundary, *(b for i, s in enumerate(stages) if i == index or not s.discard for b in s.boundary)]


def new_boundaries(scene: Any, index: int) -> list[Boundary]:
    """Boundaries that begin in the stage with this number; those of the scene begin in the first kept stage with a grid."""
    first = all(not of(stage).computes or stage.discard for stage in scene.stage[:index])
    return [*(scene.boundary if first else []), *scene.stage[index].boundary]
