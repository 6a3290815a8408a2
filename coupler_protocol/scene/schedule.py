"""Gravity and boundaries over the stages: what each inherits, and gravity at any step."""

from typing import NamedTuple

from coupler_protocol.scene.stage_kinds import of


class Leg(NamedTuple):
    """Gravity during one stage: factor goes linearly from `start` to `end` over `over` steps, then stays."""

    gravity: float  # [m/s2] at factor 1
    start: float
    end: float
    over: int

    def factor(self, step):
        """Gravity factor of the step with this number (from 0) in the stage."""
        if step + 1 >= self.over:
            return self.end
        return self.start + (self.end - self.start) * ((step + 1) / self.over)

    def at(self, step):
        """Gravity [m/s2] of that step."""
        return self.gravity * self.factor(step)


def leg_of(stage, gravity, factor):
    """The Leg of a stage that begins where `gravity` [m/s2] acted with `factor`."""
    ramp = stage.gravity_factor
    gravity = gravity if stage.gravity is None else stage.gravity
    return Leg(gravity, factor, factor, 0) if ramp is None else Leg(gravity, factor, ramp.to, ramp.over)


def plan(scene):
    """A Leg for every stage, each run to its end. Gravity and its factor stay for later stages, except those of discarded stages.

    A stage that ends inside its ramp leaves less: the continuum takes `leg_of` from what was reached.
    """
    gravity, factor, legs = 0.0, 1.0, []
    for stage in scene.stage:
        legs.append(leg_of(stage, gravity, factor))
        if not stage.discard:
            gravity, factor = legs[-1].gravity, legs[-1].end
    return legs


def large_strain(scene, stage):
    """Whether a stage computes in large strain. Equilibrium finds the stress in the shape that the scene draws: never there."""
    if scene.grid is None:
        return False
    return not of(stage).drawn and (scene.grid.large_strain or stage.large_strain is True)


def acting_boundaries(scene, index):
    """The boundaries that act in the stage with this number, in order; those of a discarded stage act there only."""
    stages = scene.stage[: index + 1]
    return [*scene.boundary, *(b for i, s in enumerate(stages) if i == index or not s.discard for b in s.boundary)]


def new_boundaries(scene, index):
    """The boundaries that begin in the stage with this number; the scene's own in the first that computes the grid and stays."""
    first = all(not of(stage).computes or stage.discard for stage in scene.stage[:index])
    return [*(scene.boundary if first else []), *scene.stage[index].boundary]
