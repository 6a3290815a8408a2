"""Doubts about stages that end late or never, one a function.

Forces have 16 digits at most: below their round-off an unbalanced force ratio is noise, and a stage that waits for less waits for
ever.
"""

from collections.abc import Iterator
from math import pi, sqrt
from typing import Any

from coupler_protocol.problems import Finding
from coupler_protocol.scene.local_origin import FAR
from coupler_protocol.scene.of_window import scenes_of_discs
from coupler_protocol.scene.rules.units import height_of, least_zone, overburden
from coupler_protocol.scene.schedule import plan
from coupler_protocol.scene.stage_kinds import of
from coupler_protocol.scene.tables.stages import Until

HANDOVER = 500  # steps, if the stage has none
MANY = 1e8  # steps of a stage: days
EPS = 2.2e-16
GRID = 1e-14  # ratio that a grid at rest still reaches; measured: 2e-16 .. 6e-15


def round_off(scene: Any) -> float:
    """Unbalanced force ratio below which forces are round-off.

    Of discs with springs k/2, contact forces are of the order of the stress s times the diameter d, and positions x round off by
    EPS x, gaps and forces with them: EPS x k/2 / (s d).
    """
    if scene.discs is None:
        return GRID
    extent, found = scene.grid.length if scene.grid is not None and scene.grid.length else _extent_of_window(scene), [GRID]
    for _, own in scenes_of_discs(scene):
        stress = max(overburden(scene), own.discs.confinement)
        found.append(EPS * extent * 0.5 * own.discs.soil.spring.normal / (stress * 2.0 * own.discs.radius))
    return max(found)


def _extent_of_window(scene: Any) -> float:
    corners = [abs(v) for w in scene.window for point in w.polygon or () for v in point]
    return min(max(corners, default=1.0), FAR * max(height_of(scene), 1.0))


def ratios_below_round_off(scene: Any) -> Iterator[Finding]:
    """Stages that wait for less than round-off, and end otherwise."""
    yield from _too_small(scene, True, "never reaches", "or leave it out: other conditions end the stage")


def ratios_never_reached(scene: Any) -> Iterator[Finding]:
    """Refusals: stages that nothing but a ratio below the round-off of the forces would end."""
    yield from _too_small(scene, False, "would never end: it never reaches", "and add steps as a second limit")


def _too_small(scene: Any, ends: bool, words: str, more: str) -> Iterator[Finding]:
    least = round_off(scene)
    for i, stage in enumerate(scene.stage):
        until = stage.until
        if until is not None and until.ratio is not None and until.ratio < least and _ends(until) == ends:
            what = f"stage {stage.name!r} {words} the ratio {until.ratio:g}: forces have a round-off of {least:.1g}"
            yield ("stage", i, "until", "ratio"), what, f"use 1e-5, {more}"


def _ends(until: Until) -> bool:
    """Whether steps or seconds end a stage in any case."""
    return until.steps is not None or until.time is not None


def only_at_rest(scene: Any) -> Iterator[Finding]:
    """Stages that end only at rest: ground that flows never comes to rest."""
    for i, stage in enumerate(scene.stage):
        until = stage.until
        if not of(stage).computes or until is None or _ends(until):
            continue
        if until.ratio is not None and until.displacement is None:
            what = f"stage {stage.name!r} ends only at rest, ratio {until.ratio:g}: where something fails it never ends"
            yield ("stage", i, "until"), what, "add steps as a second limit"
        elif until.displacement is not None and until.ratio is None:
            what = f"stage {stage.name!r} ends only if something moves by {until.displacement:g} m: what comes to rest never does"
            yield ("stage", i, "until"), what, "add steps as a second limit, or ratio"


def handovers_cut_short(scene: Any) -> Iterator[Finding]:
    """Hand-overs that take more steps than their stage."""
    for i, stage in enumerate(scene.stage):
        steps = stage.until.steps if stage.until is not None else None
        handover = stage.handover or HANDOVER
        if of(stage).couples and steps is not None and steps < handover:
            why = f"stage {stage.name!r} ends after {steps} steps, inside its hand-over of {handover}"
            yield ("stage", i, "handover"), why, f"give the stage more than {handover} steps, or the hand-over fewer"


def displacements_beyond_the_ground(scene: Any) -> Iterator[Finding]:
    """Displacements that the ground has no room for."""
    height = height_of(scene)
    for i, stage in enumerate(scene.stage):
        far = stage.until.displacement if stage.until is not None else None
        if far is not None and height and scene.grid is not None and far > height:
            what = f"stage {stage.name!r} waits for a displacement of {far:g} m, more than the height of the ground, {height:g} m"
            yield ("stage", i, "until", "displacement"), what, "give metres: one zone or so, for a slope that fails"


def seconds_of_too_many_steps(scene: Any) -> Iterator[Finding]:
    """Stages in real time that take more than MANY steps, by an estimate of the step."""
    for i, stage in enumerate(scene.stage):
        seconds = stage.until.time if stage.until is not None and stage.in_real_time else None
        if seconds is not None and (steps := seconds / _real_step(scene, stage)) > MANY and stage.until.steps is None:
            what = f"stage {stage.name!r} of {seconds:g} s takes about {steps:.1g} steps of {seconds / steps:.1g} s"
            yield ("stage", i, "until", "time"), what, f"use less than about {seconds * MANY / steps:.1g} s, or softer contacts"


def _real_step(scene: Any, stage: Any) -> float:
    """Step [s] in real time, approximately: zone over wave speed, and discs on their springs."""
    found = []
    if scene.grid is not None:
        speed = max(sqrt((m.elastic.bulk + 4.0 / 3.0 * m.elastic.shear) / m.density) for m in scene.material)
        found.append((stage.step_factor or 0.5) * least_zone(scene) / speed)
    for _, own in scenes_of_discs(scene) if scene.discs is not None else ():
        mass = own.discs.soil.density * pi * own.discs.radius**2
        found.append((stage.step_factor or own.discs.time_step) * sqrt(mass / own.discs.soil.spring.normal))
    return min(found)


def gravity_that_stops_on_its_way(scene: Any) -> Iterator[Finding]:
    """Stages whose steps end before their ramp of gravity."""
    for i, (stage, leg) in enumerate(zip(scene.stage, plan(scene), strict=True)):
        steps = stage.until.steps if stage.until is not None else None
        if steps is not None and steps < leg.over:
            reached = leg.factor(steps - 1)
            what = (
                f"stage {stage.name!r} ends after {steps} steps, within its ramp of gravity over {leg.over}: the factor reaches "
            )
            yield ("stage", i, "gravity_factor"), f"{what}{reached:.4g}, not {leg.end:g}", f"use at least {leg.over} steps"


RULES_OF_ENDINGS = (ratios_never_reached,)
DOUBTS_OF_ENDINGS = (
    ratios_below_round_off,
    only_at_rest,
    handovers_cut_short,
    displacements_beyond_the_ground,
    seconds_of_too_many_steps,
    gravity_that_stops_on_its_way,
)
