"""Rules between the stages of a scene, one function each, as in between_tables.py."""

from collections.abc import Iterator
from typing import Any

from coupler_protocol.geometry import spot_on
from coupler_protocol.problems import Finding
from coupler_protocol.scene.changes import record_in
from coupler_protocol.scene.schedule import acting_boundaries, large_strain, new_boundaries
from coupler_protocol.scene.stage_kinds import KINDS, coupled, named, number_of, of


def stages_follow_each_other(scene: Any) -> Iterator[Finding]:
    """Stages have a valid order (fill before couple, each once) and only keys that their kind uses."""
    done, joined = set(), False
    for i, stage in enumerate(scene.stage):
        at, kind = ("stage", i), of(stage)
        if kind.window and not scene.window:
            yield at, f"stage {stage.name!r} needs a window", "add a [[window]] table or remove the stage"
        if kind.needs and kind.needs not in done:
            yield at, f"a stage of kind {kind.name} needs discs", f'add a stage with kind = "{kind.needs}" before it'
        if kind.before_couple and joined:
            yield at, f"a stage of kind {stage.kind!r} cannot follow couple", "move it before the couple stage"
        if kind.window and stage.kind in done:
            yield at, f"a second stage of kind {stage.kind!r}", "use kinds fill and couple once each"
        if not kind.computes and (stage.until or stage.gravity_factor or stage.gravity is not None):
            yield at, f"a stage of kind {kind.name} computes no steps", "remove until, gravity and gravity_factor here"
        if kind.computes and never_ends(stage):
            yield at, f"stage {stage.name!r} would never end", "add until = { ratio = 1e-5, steps = .. }"
        if stage.handover is not None and "handover" not in kind.keys:
            yield (*at, "handover"), "only a stage of kind couple has a hand-over", "remove the key"
        if stage.insitu is not None and "insitu" not in kind.keys:
            yield (*at, "insitu"), "only a stage of kind fill packs discs", "remove the key"
        if stage.discard and not kind.discard:
            yield (*at, "discard"), "only stages of the grid alone can be discarded", "remove the key"
        done.add(stage.kind)
        joined |= kind.couples
    if scene.window and not joined:
        yield ("window",), "no stage couples the window", 'add stages with kind = "fill" and kind = "couple"'


def never_ends(stage: Any) -> bool:
    """Whether nothing ends a stage."""
    return stage.until is None or not any(value is not None for value in stage.until.__dict__.values())


def large_strain_begins_in_the_shape_drawn(scene: Any) -> Iterator[Finding]:
    """Stages that need the shape drawn in the scene precede stages in large strain, which change it."""
    moved = None
    for i, stage in enumerate(scene.stage):
        if stage.large_strain and of(stage).drawn:
            yield ("stage", i, "large_strain"), f"a stage of kind {stage.kind!r} computes in the initial shape", "remove the key"
        if moved and of(stage).begins_drawn:
            why = f"a stage of kind {stage.kind!r} needs the initial shape, which stage {moved!r} has changed (large strain)"
            yield ("stage", i), why, f"move it before {moved!r}, or give that stage discard = true"
        if large_strain(scene, stage) and not of(stage).begins_drawn and not stage.discard and not moved:
            moved = stage.name


def loads_have_their_stages(scene: Any) -> Iterator[Finding]:
    """Excavations and surcharges are in stages of their kind, which last long enough and do not change gravity."""
    for i, stage in enumerate(scene.stage):
        for kind in (kind.table for kind in KINDS if kind.table):
            load = getattr(stage, kind)
            if stage.kind != kind:
                if load is not None:
                    remedy = f'add kind = "{kind}" or remove the table'
                    yield ("stage", i, kind), f"stage {stage.name!r} is of kind {stage.kind!r}", remedy
                continue
            if load is None:
                yield ("stage", i), f"stage {stage.name!r} of kind {kind!r} has no table {kind!r}", f"add {kind} = {{ .. }}"
            elif stage.until is not None and stage.until.steps is not None and stage.until.steps < (load.over or 1):
                why = f"the stage ends after {stage.until.steps} steps, before the {load.over} steps of {kind}"
                yield ("stage", i, "until", "steps"), why, f"use at least {load.over} steps"
            if stage.gravity is not None or stage.gravity_factor is not None:
                yield ("stage", i), f"gravity cannot change in a stage of kind {kind!r}", "change it in a separate stage"


def loads_wait_where_rest_is(scene: Any) -> Iterator[Finding]:
    """Only a gradual load in a static stage can wait for rest."""
    for i, stage in enumerate(scene.stage):
        own = [(("stage", i, kind.table), getattr(stage, kind.table)) for kind in KINDS if kind.table]
        tables: list[tuple[tuple[str | int, ...], Any]] = [(path, table) for path, table in own if table is not None]
        tables += [(_boundary_at(scene, i, b), b) for b in new_boundaries(scene, i) if b.loads]
        for path, table in tables:
            if table.ratio and stage.in_real_time:
                why = f"stage {stage.name!r} computes in real time, where a load does not wait for rest"
                yield (*path, "ratio"), why, "remove the key, or use a static stage"
            elif table.ratio and table.over == 1:
                yield (*path, "ratio"), "a load that is applied at once does not wait for rest", "use over > 1"


def _boundary_at(scene: Any, i: int, boundary: Any) -> tuple[str | int, ...]:
    """Path of a boundary that begins in stage i."""
    for k, own in enumerate(scene.boundary):
        if own is boundary:
            return "boundary", k
    return "stage", i, "boundary", next(k for k, own in enumerate(scene.stage[i].boundary) if own is boundary)


def real_time_exchanges_every_step(scene: Any) -> Iterator[Finding]:
    """Only static stages exchange less than every step: held forces add energy, which only static damping removes."""
    every = scene.coupling.exchange_every
    if every > 1 and not scene.window:
        yield ("coupling", "exchange_every"), "the scene has no window, so nothing is exchanged", "remove the key"
    for stage in coupled(scene.stage) if every > 1 else ():
        if stage.in_real_time:
            why = f"in stage {stage.name!r}, in real time, forces held over {every} steps would add energy to the motion"
            yield ("coupling", "exchange_every"), why, 'use 1, or time = "static" in all coupled stages'
            return


def substeps_belong_to_real_time(scene: Any) -> Iterator[Finding]:
    """Sub-steps need a coupled stage in real time: in static mode the steps of both sides are 1."""
    if scene.coupling.substeps > 1 and not any(stage.in_real_time for stage in coupled(scene.stage)):
        yield ("coupling", "substeps"), "no coupled stage is in real time", 'remove the key, or give a stage time = "real"'


def surcharges_lie_on_the_ground(scene: Any) -> Iterator[Finding]:
    """A surcharge has a width and is on the ground."""
    for i, stage in enumerate(scene.stage):
        if stage.surcharge is not None and scene.grid.kind == "ring":
            yield ("stage", i, "surcharge"), "a ring has no ground surface", "use a [[boundary]] with pressure on inner or outer"
        elif stage.surcharge is not None:
            first, last = stage.surcharge.x
            if not 0.0 <= first < last <= scene.grid.length:
                start = scene.origin[0]
                why = f"[{spot_on(first, start)}, {spot_on(last, start)}] is not on the ground"
                remedy = f"use [first, last] between {start:.12g} and {spot_on(scene.grid.length, start)} m"
                yield ("stage", i, "surcharge", "x"), why, remedy


def boundaries_change_with_steps_enough(scene: Any) -> Iterator[Finding]:
    """Boundaries change in stages that compute the grid; no stage ends during a ramp."""
    allowed = named(boundaries=True)
    for i, stage in enumerate(scene.stage):
        if stage.boundary and stage.kind not in allowed:
            remedy = f"move it to a stage of kind {', '.join(allowed)}"
            yield ("stage", i, "boundary"), f"boundaries cannot change in a stage of kind {stage.kind!r}", remedy
        for boundary in new_boundaries(scene, i):
            path = _boundary_at(scene, i, boundary)
            if stage.until is not None and stage.until.steps is not None and stage.until.steps < (boundary.over or 1):
                why = f"stage {stage.name!r} ends after {stage.until.steps} steps, before this ramp of {boundary.over}"
                yield (*path, "over"), why, f"use at most {stage.until.steps}, or give the stage more steps"


def quiet_sides_belong_to_real_time(scene: Any) -> Iterator[Finding]:
    """Quiet sides begin, and act, in stages in real time."""
    for i, stage in enumerate(scene.stage):
        if not stage.in_real_time and of(stage).computes and any(b.is_quiet for b in acting_boundaries(scene, i)):
            why = f"a quiet side acts in static stage {stage.name!r}: it would move without end"
            yield ("stage", i), why, 'give the stage time = "real", or start the quiet side in a later stage: [[stage.boundary]]'


def shaking_begins_in_real_time(scene: Any) -> Iterator[Finding]:
    """A motion over seconds begins in a stage in real time, and no two sides shake the same place in one stage."""
    for i, stage in enumerate(scene.stage):
        begun = [b for b in new_boundaries(scene, i) if b.shaking is not None] if of(stage).computes else []
        for k, boundary in enumerate(begun):
            path = (*_boundary_at(scene, i, boundary), "shaking")
            if not stage.in_real_time:
                why = f"stage {stage.name!r} is static: its steps have no seconds"
                yield path, why, 'give the stage time = "real", or move the table to the [[stage.boundary]] of one in real time'
            if any(boundary.place == other.place for other in begun[:k]):
                yield path, f"a second motion of {boundary.place} in stage {stage.name!r}", "use one file with both columns"


def weight_needs_gravity(scene: Any) -> Iterator[Finding]:
    """Initial stress from weight needs gravity in the first stage."""
    if scene.initial_stress is not None and scene.initial_stress.k0 is not None and not scene.stage[0].gravity:
        why = f"the first stage, {scene.stage[0].name!r}, has no gravity, which the weight of the ground needs"
        yield ("initial_stress", "k0"), why, "add gravity = 9.81 to it, or give a gradient in place of k0"


def is_level(scene: Any) -> bool:
    """Whether the ground is level, without toe, crest and a band between them."""
    return scene.grid is None or scene.grid.profile is None or len({y for _, y in scene.grid.profile}) == 1


def bands_end_stages_that_may_have_one(scene: Any) -> Iterator[Finding]:
    """A band is checked at frames, between toe and crest of a slope; its states at a window need a coupled window."""
    for i, stage in enumerate(scene.stage):
        band, at = stage.until and stage.until.band, ("stage", i, "until", "band")
        if not band:
            continue
        if not of(stage).band:
            why = f"a stage of kind {stage.kind!r} cannot end by a band"
            yield at, why, f"use it in stages of kind {', '.join(named(band=True))}"
        if is_level(scene):
            yield at, "level ground has neither toe nor crest", "use ratio, steps or displacement"
        if band != "complete" and number_of(scene.stage[:i], couples=True) is None:
            yield at, f"{band!r} needs a coupled window", 'couple one in an earlier stage, or use band = "complete"'
        if stage.until.steps is None:
            yield at, "the band may never form", "add steps as a second limit"
        elif stage.until.steps < record_in(scene, i).every:
            why = f"the band is checked at frames, and the stage ends after {stage.until.steps} steps, before its first frame"
            yield at, why, f"use record.every of at most {stage.until.steps}"


STAGE_RULES = (
    stages_follow_each_other,
    large_strain_begins_in_the_shape_drawn,
    loads_have_their_stages,
    loads_wait_where_rest_is,
    real_time_exchanges_every_step,
    substeps_belong_to_real_time,
    surcharges_lie_on_the_ground,
    boundaries_change_with_steps_enough,
    quiet_sides_belong_to_real_time,
    shaking_begins_in_real_time,
    weight_needs_gravity,
    bands_end_stages_that_may_have_one,
)
