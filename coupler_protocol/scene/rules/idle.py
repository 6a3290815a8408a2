"""Doubts about tables and keys that act on nothing, one a function: what they would act on is not there."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from coupler_protocol.problems import Finding
from coupler_protocol.scene.changes import in_stage
from coupler_protocol.scene.declare import Table
from coupler_protocol.scene.rules.window_tables import in_all_windows
from coupler_protocol.scene.schedule import plan
from coupler_protocol.scene.stage_kinds import of
from coupler_protocol.scene.used_materials import discs_used

PACKED = ("spread", "packing", "target", "porosity", "confinement")  # keys of [discs] that only a packing uses
FAR_WALL = 10.0  # times the size of the window
FALLING = 0.4  # local damping in real time: more slows what falls to less than 0.6 g


def changed(table: Table, *keys: str) -> list[str]:
    """Which of the keys have other values than by default."""
    fields = type(table).model_fields
    return [key for key in keys if getattr(table, key) != fields[key].get_default(call_default_factory=True)]


def tables_without_a_window(scene: Any) -> Iterator[Finding]:
    """Tables of the interface and of discs in a scene without discs."""
    if not scene.window and scene.grid is not None:
        for name in ("coupling", "link"):
            table = getattr(scene, name)
            for key in changed(table, *type(table).model_fields):
                yield (name, key), "the scene has no window, so that nothing is exchanged", "remove the key, or add a [[window]]"
    if scene.ring is not None and scene.discs is None:
        yield ("ring",), "the scene has no discs that a ring could touch", "remove the table, or add [[window]] and [discs]"
    if scene.grid is None:
        for name, table in (("coupling", scene.coupling), ("link", scene.link)):
            for key in changed(table, *type(table).model_fields):
                yield (name, key), "discs alone are one process, which exchanges nothing", "remove the key"


def ring_without_contacts(scene: Any) -> Iterator[Finding]:
    """Properties of contacts with control discs or walls, where there is neither."""
    if scene.grid is not None or scene.discs is None or scene.discs.wall:
        return
    why, remedy = "the scene has neither a grid nor walls: no disc touches the material ring", "remove it, or add [[discs.wall]]"
    if scene.ring is not None:
        yield ("ring",), why, remedy
    for i, pair in enumerate(scene.discs.pair):
        if "ring" in pair.between:
            yield ("discs", "pair", i), why, remedy


@in_all_windows
def keys_of_a_packing(scene: Any) -> Iterator[Finding]:
    """Keys that pack discs which come from a file, and keys of a file without one."""
    discs = scene.discs
    if discs is None:
        return
    if discs.file is not None:
        for key in changed(discs, *PACKED):
            yield ("discs", key), f"the discs come from {discs.file}: nothing is packed", "remove the key"
    elif discs.body != "clump":
        yield ("discs", "body"), "only stones of discs.file use this key", "use stones.body, or remove the key"
    real = any(stage.in_real_time for stage in scene.stage)
    if changed(discs, "time_step") and not real:
        yield ("discs", "time_step"), "no stage is in real time", 'remove the key, or give a stage time = "real"'


@in_all_windows
def spread_beside_a_grading(scene: Any) -> Iterator[Finding]:
    """Spread beside a grading: the grading says all sizes."""
    if scene.discs is not None and scene.discs.grading is not None and changed(scene.discs, "spread"):
        yield ("discs", "spread"), "discs.grading gives the sizes of the discs", "remove spread, or the grading"


@in_all_windows
def material_without_stones(scene: Any) -> Iterator[Finding]:
    """A material of stones in a scene that has none; the file of discs alone may have them."""
    discs = scene.discs
    if discs is not None and discs.stone is not None and discs_used(scene).stone is None:
        yield ("discs", "stone"), "no stones use this material", "add a [stones] table, or leave it for a scene with stones"


def factors_without_gravity(scene: Any) -> Iterator[Finding]:
    """A factor of gravity where there is none."""
    for i, (stage, leg) in enumerate(zip(scene.stage, plan(scene), strict=True)):
        if stage.gravity_factor is not None and leg.gravity == 0.0:
            what = f"stage {stage.name!r} multiplies a gravity of 0"
            yield ("stage", i, "gravity_factor"), what, "set gravity = 9.81 in this stage or in an earlier one"


def level_without_change(scene: Any) -> Iterator[Finding]:
    """The height at which a uniform stress holds."""
    table = scene.initial_stress
    if table is not None and table.level != 0.0 and table.gradient is None and table.k0 is None:
        yield ("initial_stress", "level"), "the stress is the same at all heights", "add a gradient, or remove the key"


def damping_of_falling_bodies(scene: Any) -> Iterator[Finding]:
    """Local damping in stages in real time: it slows what falls and slides as well as what vibrates."""
    for i, (stage, leg) in enumerate(zip(scene.stage, plan(scene), strict=True)):
        if not stage.in_real_time:
            continue
        of_scene = scene.damping if scene.grid is not None else scene.discs and in_stage(scene, i).discs.damping
        table = stage.damping or of_scene
        alpha = getattr(table, "local", None) or 0.0
        if scene.grid is None and alpha > 0.0 and leg.gravity > 0.0:
            what = f"local damping {alpha:g} acts in real time in stage {stage.name!r}: bodies fall at {1 - alpha:.2g} g"
            remedy = "give the stage damping = { local = 0.0 }, and the discs a dashpot"
            yield ("stage", i, "damping"), what, remedy
        elif scene.grid is not None and alpha > FALLING:
            what = f"local damping {alpha:g} acts in real time in stage {stage.name!r}, on motion as on vibration"
            remedy = "give the stage damping = { rayleigh = { fraction = 0.05, frequency = .. } }, or { local = 0.0 }"
            yield ("stage", i, "damping"), what, remedy


def keys_of_a_grid(scene: Any) -> Iterator[Finding]:
    """Keys for the grid in a scene of discs alone."""
    if scene.grid is not None:
        return
    for key in changed(scene.fos, *type(scene.fos).model_fields):
        yield ("fos", key), "discs alone have no factor of safety", "remove the key"
    if scene.record.energy:
        why = "discs alone always record their energies (elastic_energy, kinetic_energy, weight_energy)"
        yield ("record", "energy"), why, "remove the key"


def bonds_with_walls(scene: Any) -> Iterator[Finding]:
    """Bonds of contacts with walls: walls are never bonded."""
    if scene.grid is not None or scene.discs is None or not scene.discs.wall:
        return
    holders: list[tuple[tuple[str | int, ...], Any]] = [(("ring",), scene.ring)]
    holders += [(("discs", "pair", i), pair) for i, pair in enumerate(scene.discs.pair) if "ring" in pair.between]
    for path, table in holders:
        for law in ("bond", "parallel_bond"):
            if getattr(table, law, None) is not None:
                yield (*path, law), "discs alone touch walls as ring, and no bond holds a disc to a wall", "remove the table"


def sides_that_change_nothing(scene: Any) -> Iterator[Finding]:
    """Boundaries that free what nothing held, and ramps of what is free at once."""
    held: set[tuple[str, str]] = set()
    tables: list[tuple[tuple[str | int, ...], Any]] = [(("boundary", k), b) for k, b in enumerate(scene.boundary)]
    tables += [(("stage", i, "boundary", k), b) for i, stage in enumerate(scene.stage) for k, b in enumerate(stage.boundary)]
    for path, b in tables:
        if b.free is not None:
            never = [axis for axis in b.free if (b.on, axis) not in held]
            if never:
                what = f"nothing before has fixed or moved {' and '.join(never)} of {b.on}"
                yield (*path, "free"), what, "remove the table: sides are free unless a table holds them"
        at_once = next((key for key in ("free", "quiet", "shaking") if getattr(b, key) is not None), None)
        if b.over is not None and at_once:
            yield (*path, "over"), f"{at_once} acts at once, without a ramp", "remove the key"
        held |= {(b.on, axis) for axis in b.fix or ""}
        held |= {(b.on, axis) for axis in "xy" if b.velocity is not None and getattr(b.velocity, axis) is not None}
        if b.shaking is not None and b.shaking.base == "rigid":
            held |= {(b.on, axis) for axis in b.shaking.factors}


def histories_without_a_point(scene: Any) -> Iterator[Finding]:
    """An interval of histories that is longer than the run."""
    stages = [stage for stage in scene.stage if of(stage).computes]
    steps = [stage.until.steps if stage.until is not None else None for stage in stages]
    if steps and None not in steps and sum(steps) < scene.record.history:  # type: ignore[arg-type]
        what = f"the stages have {sum(steps)} steps, so that histories have no point"  # type: ignore[arg-type]
        yield ("record", "history"), what, f"use record.history of {max(1, sum(steps) // 100)} or so"  # type: ignore[arg-type]


def walls_out_of_reach(scene: Any) -> Iterator[Finding]:
    """Walls so far from the discs that they are probably given in other coordinates."""
    if scene.discs is None or not scene.window or scene.window[0].polygon is None:
        return
    corners = np.array(scene.window[0].polygon)
    low, high = corners.min(axis=0), corners.max(axis=0)
    size = float(np.ptp(corners, axis=0).max())
    for k, wall in enumerate(scene.discs.wall):
        far = _distance(np.array(wall.ends), low, high)
        if far > FAR_WALL * size and not wall.moves:
            what = f"wall {wall.name or k + 1} is {far:.3g} m away from the discs, whose window is {size:.3g} m large"
            yield ("discs", "wall", k, "ends"), what, "are both in the same coordinates and in metres?"


def _distance(ends: Any, low: Any, high: Any) -> float:
    """Distance of a segment, by points on it, from a rectangle."""
    points = ends[0] + np.linspace(0.0, 1.0, 1001)[:, None] * (ends[1] - ends[0])
    return float(np.hypot(*np.maximum(np.maximum(low - points, points - high), 0.0).T).min())


DOUBTS_OF_IDLE = (
    tables_without_a_window,
    ring_without_contacts,
    keys_of_a_packing,
    spread_beside_a_grading,
    material_without_stones,
    factors_without_gravity,
    level_without_change,
    damping_of_falling_bodies,
    keys_of_a_grid,
    bonds_with_walls,
    sides_that_change_nothing,
    histories_without_a_point,
    walls_out_of_reach,
)
