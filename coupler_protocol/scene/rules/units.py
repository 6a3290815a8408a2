"""Values that no soil or rock has, with the unit that was probably meant: doubts, and together a refusal.

A value is doubted against what its key declares as usual (coupler_protocol.scene.declare.quantity), and against the scene:

    strength and loads against the weight of the highest column of the ground, rho g H
    moduli by the shortening rho g H / (K + 4G/3) of that column, springs of discs by the overlap rho g H / k under it
    speeds in static stages against the size of zones and discs, for they are metres a step

A scene with two different quantities in doubt, or whose ground would shorten to nothing under its weight, is refused unless
it says units = "any": one odd value can be meant, two together are a scene in kPa or in t/m3.
"""

from collections.abc import Iterator
from math import degrees, log10, pi, radians, tan
from typing import Any, NamedTuple

import numpy as np
from pydantic.fields import FieldInfo

from coupler_protocol.problems import Finding, KeyPath, dotted
from coupler_protocol.scene import stage_kinds
from coupler_protocol.scene.changes import in_stage
from coupler_protocol.scene.declare import Table
from coupler_protocol.scene.rules.window_tables import in_all_windows
from coupler_protocol.scene.schedule import plan

ANY = 'If these values are meant, say units = "any" (--set units=any)'
LEAST_COHESION = 1e-3  # of the weight of the highest column: less is no strength beside it
LEAST_TENSION, LEAST_LOAD = 1e-4, 1e-3  # of the same weight
LEAST_STRESS = 1e-6  # of the bulk modulus, where nothing has weight
SHORTENING = 0.2  # of the highest column under its weight, and overlap of discs: more is doubted
NOTHING_LEFT = 1.0
GENTLE = 0.01  # of a zone, or of the smallest radius: largest motion in a static step that is not doubted
STEEPEST = 3.0  # largest friction and rolling coefficient that is not doubted
EARTH, LEAST_GRAVITY, LARGEST_GRAVITY = 9.81, 1.5, 500.0  # [m/s2] from the moon to centrifuges
OTHERS = {
    "Pa": ((1e3, "kPa"), (1e6, "MPa"), (1e9, "GPa")),
    "kg/m3": ((1e3, "t/m3"), (1e3 / EARTH, "kN/m3")),
    "N/m": ((1e3, "kN/m"), (1e6, "MN/m")),
    "deg": ((180.0 / pi, "radians"),),
    "m/s2": ((0.01, "cm/s2"), (0.001, "mm/s2")),
}  # units in which values of SI units are often given: what a value in them is multiplied by, and their name


class Suspect(NamedTuple):
    """A value that is probably given in another unit."""

    path: KeyPath
    what: str
    remedy: str
    quantity: str
    impossible: bool = False  # nothing that is computed with it could be meant


def doubts_of_units(scene: Any) -> Iterator[Finding]:
    """Doubts (path, what, remedy) about values in probably other units."""
    if scene.units == "any":
        return
    for found in (*suspects(scene), *speeds(scene)):
        yield found.path, found.what, found.remedy


def units_are_si(scene: Any) -> Iterator[Finding]:
    """No scene is computed that is written in other units, in more than one quantity."""
    if scene.units == "any":
        return
    found = list(suspects(scene))
    if len({suspect.quantity for suspect in found}) > 1 or any(suspect.impossible for suspect in found):
        for suspect in found:
            yield suspect.path, suspect.what, f"{suspect.remedy}. {ANY}".replace("?.", "?")


def suspects(scene: Any) -> Iterator[Suspect]:
    """All Suspects of a scene."""
    yield from _unusual(scene)
    yield from _weak(scene)
    yield from _soft(scene)
    yield from _soft_discs(scene)
    yield from _weak_bonds(scene)
    yield from _coefficients(scene)
    yield from _small_loads(scene)
    yield from _gravity(scene)


# -- against what soil and rock have -------------------------------------------------------------------------------------


def _unusual(scene: Any) -> Iterator[Suspect]:
    """Numbers outside of what their key declares as usual; not moduli that `_soft` doubts."""
    soft = {suspect.path for suspect in _soft(scene)}
    for path, value, field in _numbers(scene, ()):
        extra: Any = field.json_schema_extra or {}
        if "usual" not in extra or value == 0.0 or path[:-1] in soft:
            continue
        low, high = extra["usual"]
        if not low <= value <= high:
            unit = extra["unit"]
            name = next(part for part in reversed(path) if isinstance(part, str))
            what = f"{name} of {_owner(scene, path)} is {as_written(value)} {unit}: soil and rock have {as_written(low)} .. "
            remedy = meant(value, unit, low, high) or f"give {name} in {unit}"
            yield Suspect(path, f"{what}{as_written(high)}", remedy, "stiffness" if unit == "Pa" else unit)


def _numbers(table: Table, path: KeyPath) -> Iterator[tuple[KeyPath, float, FieldInfo]]:
    """(path, value, field) of every number that tables declare directly."""
    for name, field in type(table).model_fields.items():
        value = getattr(table, name)
        if isinstance(value, Table):
            yield from _numbers(value, (*path, name))
        elif isinstance(value, list):
            for k, item in enumerate(value):
                if isinstance(item, Table):
                    yield from _numbers(item, (*path, name, k))
                elif isinstance(item, float):
                    yield (*path, name, k), item, field
        elif isinstance(value, float):
            yield (*path, name), value, field


def meant(value: float, unit: str, low: float, high: float) -> str:
    """What a value of the unit probably is in other units, in words; "" if none of them brings it between low and high."""
    found = [(value * factor, name) for factor, name in OTHERS.get(unit, ()) if low <= value * factor <= high]
    return f"did you mean {' or '.join(f'{as_written(v)} ({value:g} {name})' for v, name in found)}?" if found else ""


def as_written(value: float) -> str:
    """A number as one writes it in a scene: 12.4e3, 100e6, 2000."""
    if value == 0.0 or 1e-3 <= abs(value) < 1e4:
        return f"{value:.4g}"
    power = 3 * int(log10(abs(value)) // 3)
    return f"{value / 10.0**power:.4g}e{power}"


def _owner(scene: Any, path: KeyPath) -> str:
    """Whose value a path leads to, in words."""
    if path[0] in ("material", "stage", "window"):
        return f"{path[0]} {getattr(scene, path[0])[path[1]].name!r}"
    return dotted(path[:-1])


# -- against the weight of the ground ------------------------------------------------------------------------------------


def _density(table: Any) -> float:
    """Density [kg/m3] of a table, as it was probably meant."""
    return next((table.density * f for f, _ in ((1.0, ""), *OTHERS["kg/m3"]) if 300.0 <= table.density * f <= 1e4), table.density)


def height_of(scene: Any) -> float:
    """Height [m] of the highest column of ground or discs; 0 where none stands."""
    if scene.grid is None:
        return max((float(np.ptp(np.array(w.polygon)[:, 1])) for w in scene.window if w.polygon), default=0.0)
    if scene.grid.kind == "ring":
        return 0.0
    return max(y for _, y in scene.grid.profile) if scene.grid.profile else scene.grid.height


def overburden(scene: Any) -> float:
    """Weight of the highest column [Pa] under the largest gravity of the stages (factors apart); 0 where nothing weighs."""
    tables = scene.material if scene.grid else [scene.discs.soil]
    gravity = max(leg.gravity for leg in plan(scene))
    gravity = gravity if gravity == 0.0 or LEAST_GRAVITY < gravity < LARGEST_GRAVITY else EARTH
    return gravity * max(map(_density, tables), default=0.0) * height_of(scene)


def _stress_scale(scene: Any, share: float) -> float:
    """Stress [Pa] below which one is negligible: a share of the overburden, or of the stiffness where nothing weighs."""
    bulk = max((m.elastic.bulk for m in scene.material), default=0.0)
    return overburden(scene) * share or bulk * LEAST_STRESS


def _beside(scene: Any) -> str:
    weight = overburden(scene)
    return (
        f"beside the weight of the ground, {as_written(weight)} Pa at {height_of(scene):g} m" if weight else "beside the moduli"
    )


def materials_in_stages(scene: Any) -> Iterator[tuple[KeyPath, Any]]:
    """(path, material) of the scene, and of every stage that changes one."""
    yield from ((("material", i), material) for i, material in enumerate(scene.material))
    for s, stage in enumerate(scene.stage):
        now = {material.name: material for material in in_stage(scene, s).material} if stage.material else {}
        yield from ((("stage", s, "material", k), now[table.name]) for k, table in enumerate(stage.material))


def _weak(scene: Any) -> Iterator[Suspect]:
    """Strengths that are nothing beside the weight of the ground."""
    for path, m in materials_in_stages(scene):
        for table, key, share in (("mohr_coulomb", "cohesion", LEAST_COHESION), ("tension", "strength", LEAST_TENSION)):
            value = getattr(getattr(m, table, None), key, 0.0)
            if 0.0 < value < _stress_scale(scene, share):
                what = f"{key} of material {m.name!r} is {as_written(value)} Pa: nothing {_beside(scene)}"
                remedy = f"did you mean {value:g}e3 ({value:g} kPa)? Use 0 for no {key}"
                yield Suspect((*path, table, key), what, remedy, "strength")
        for key, share in (("cohesion", LEAST_COHESION), ("tension", LEAST_TENSION)):
            largest = max(getattr(getattr(m, "softening", None), key, None) or [0.0])
            if 0.0 < largest < _stress_scale(scene, share):
                what = f"{key} of material {m.name!r} softens to at most {as_written(largest)} Pa: nothing {_beside(scene)}"
                remedy = f"did you mean {largest:g}e3 ({largest:g} kPa)? Use 0 for no {key}"
                yield Suspect((*path, "softening", key), what, remedy, "strength")


def _soft(scene: Any) -> Iterator[Suspect]:
    """Moduli under which the ground would shorten like nothing on earth."""
    weight = overburden(scene)
    for path, m in materials_in_stages(scene):
        modulus = m.elastic.bulk + 4.0 / 3.0 * m.elastic.shear
        if weight > SHORTENING * modulus:
            what = f"material {m.name!r} would shorten by {100 * weight / modulus:.0f} % under the weight of the ground, "
            what += f"{as_written(weight)} Pa at {height_of(scene):g} m: bulk {as_written(m.elastic.bulk)} Pa"
            remedy = f"did you mean bulk = {as_written(1e3 * m.elastic.bulk)}, shear = {as_written(1e3 * m.elastic.shear)} (kPa)?"
            yield Suspect((*path, "elastic"), what, remedy, "stiffness", weight > NOTHING_LEFT * modulus)


def _grains_in_stages(scene: Any) -> Iterator[tuple[KeyPath, str, Any]]:
    """(path, name, material of discs) of the scene, and of every stage that changes one."""
    yield from ((("discs", key), key, getattr(scene.discs, key)) for key in ("soil", "stone") if scene.discs)
    for s, stage in enumerate(scene.stage):
        for key in ("soil", "stone") if stage.discs is not None else ():
            if getattr(stage.discs, key) is not None:
                yield ("stage", s, "discs", key), key, getattr(in_stage(scene, s).discs, key)


@in_all_windows
def _soft_discs(scene: Any) -> Iterator[Suspect]:
    """Springs under which discs would lie in each other."""
    discs = scene.discs
    if discs is None:
        return
    load = max(overburden(scene), discs.confinement if discs.file is None else 0.0)
    for place, key, table in _grains_in_stages(scene):
        spring = getattr(table, "spring", None)
        stiffness = (spring.normal if discs.stiffness == "contact" else 0.5 * spring.normal) if spring else np.inf
        if spring and load > SHORTENING * stiffness:
            what = f"discs of {key} would overlap by {100 * load / stiffness:.0f} % of their diameter under {as_written(load)} Pa"
            remedy = f"did you mean normal = {as_written(1e3 * spring.normal)} ({spring.normal:g} kN/m)?"
            path = (*place, "spring", "normal")
            yield Suspect(path, what, remedy, "springs", load > NOTHING_LEFT * stiffness)


@in_all_windows
def _weak_bonds(scene: Any) -> Iterator[Suspect]:
    """Bonds whose strength is nothing beside the stress on the discs: forces in kN, stresses in kPa."""
    discs = scene.discs
    stress = max(overburden(scene), discs.confinement) if discs is not None and discs.file is None else 0.0
    for place, key, grain in _grains_in_stages(scene) if stress else ():
        for law, unit, scale in (("bond", "N", 2.0 * discs.radius * stress), ("parallel_bond", "Pa", stress)):
            table = getattr(grain, law, None)
            values = [(name, getattr(table, name)) for name in ("tension", "shear") if table is not None]
            for name, value in values:
                if 0.0 < value < LEAST_COHESION * scale:
                    what = (
                        f"{name} of discs.{key}.{law} is {as_written(value)} {unit}: nothing beside {as_written(scale)} {unit} "
                    )
                    what += "that contacts carry"
                    yield Suspect((*place, law, name), what, f"did you mean {value:g}e3 ({value:g} k{unit})?", "strength")


@in_all_windows
def _coefficients(scene: Any) -> Iterator[Suspect]:
    """Angles in degrees where discs have coefficients."""
    grains = {"soil": scene.discs and scene.discs.soil, "stone": scene.discs and scene.discs.stone}
    holders: list[tuple[KeyPath, Any]] = [(("discs", key), table) for key, table in grains.items()] + [(("ring",), scene.ring)]
    holders += [(("discs", "pair", k), pair) for k, pair in enumerate(scene.discs.pair if scene.discs else [])]
    for s, stage in enumerate(scene.stage):
        holders += [(("stage", s, "ring"), stage.ring)]
        if stage.discs is not None:
            holders += [(("stage", s, "discs", key), getattr(stage.discs, key)) for key in grains]
            holders += [(("stage", s, "discs", "pair", k), pair) for k, pair in enumerate(stage.discs.pair)]
    for path, holder in holders:
        for law in ("friction", "rolling"):
            value = getattr(getattr(holder, law, None), "coefficient", None) or 0.0
            if value > STEEPEST:
                name = dotted(path)
                what = f"the {law} coefficient of {name} is {value:g}: that of {degrees(np.arctan(value)):.0f} degrees"
                remedy = f"did you mean tan({value:g} deg) = {tan(radians(value)):.3g}?" if value < 80.0 else "use tan(phi)"
                yield Suspect((*path, law, "coefficient"), what, remedy, f"{law} coefficient")


def _small_loads(scene: Any) -> Iterator[Suspect]:
    """Loads of static stages, and initial stresses, that are nothing beside the weight of the ground."""
    if scene.grid is None:
        return
    least = _stress_scale(scene, LEAST_LOAD)
    for path, table in _loads(scene):
        values = {key: getattr(table, key, None) or 0.0 for key in ("pressure", "shear", "xx", "yy", "zz", "xy")}
        largest = max(values, key=lambda key: abs(values[key]))
        if 0.0 < abs(values[largest]) < least:
            what = f"{largest} of {dotted(path)} is {as_written(values[largest])} Pa: nothing {_beside(scene)}"
            remedy = f"did you mean {values[largest]:g}e3 ({values[largest]:g} kPa)?"
            yield Suspect((*path, largest), what, remedy, "loads")


def _loads(scene: Any) -> Iterator[tuple[KeyPath, Any]]:
    """(path, table) of every load on the ground in static stages."""
    stages = [(("stage", i), stage) for i, stage in enumerate(scene.stage) if not stage.in_real_time]
    boundaries: list[tuple[KeyPath, Any]] = [
        (("boundary", k), b) for k, b in enumerate(scene.boundary) if not scene.stage[0].in_real_time
    ]
    for path, stage in stages:
        boundaries += [((*path, "boundary", k), b) for k, b in enumerate(stage.boundary)]
        if stage.surcharge is not None:
            yield (*path, "surcharge"), stage.surcharge
    for path, boundary in boundaries:
        if boundary.loads:
            yield (path, boundary) if boundary.stress is None else ((*path, "stress"), boundary.stress)
    if scene.initial_stress is not None:
        yield ("initial_stress",), scene.initial_stress


def _gravity(scene: Any) -> Iterator[Suspect]:
    """Gravity as a multiple of g, or its factor as an acceleration."""
    for i, stage in enumerate(scene.stage):
        at = ("stage", i)
        if stage.gravity is not None and 0.0 < stage.gravity < LEAST_GRAVITY:
            what = f"gravity of stage {stage.name!r} is {stage.gravity:g} m/s2, {stage.gravity / EARTH:.2g} of that of the earth"
            yield Suspect((*at, "gravity"), what, f"did you mean {EARTH:g}? Multiples of it are gravity_factor", "gravity")
        if stage.gravity is not None and stage.gravity > LARGEST_GRAVITY:
            what = f"gravity of stage {stage.name!r} is {stage.gravity:g} m/s2, {stage.gravity / EARTH:.4g} times the earth's"
            remedy = meant(stage.gravity, "m/s2", 9.5, 10.1) or "use 9.81; multiples of it are gravity_factor"
            yield Suspect((*at, "gravity"), what, remedy, "gravity")
        if stage.gravity_factor is not None and 9.75 < stage.gravity_factor.to < 9.85:
            what = f"gravity_factor of stage {stage.name!r} is {stage.gravity_factor.to:g}: it multiplies gravity"
            yield Suspect((*at, "gravity_factor"), what, f"did you mean gravity = {stage.gravity_factor.to:g}?", "gravity")


# -- speeds in static stages ---------------------------------------------------------------------------------------------


def speeds(scene: Any) -> Iterator[Suspect]:
    """Motions that are metres a step, and look like metres a second or like a whole displacement."""
    rows: list[tuple[KeyPath, tuple[float, float], Any]]
    if scene.grid is not None:
        size, what = least_zone(scene), "a zone"
        moving: list[tuple[KeyPath, Any, Any]] = [(("boundary", k), b, scene.stage[0]) for k, b in enumerate(scene.boundary)]
        moving += [(("stage", i, "boundary", k), b, s) for i, s in enumerate(scene.stage) for k, b in enumerate(s.boundary)]
        rows = [(p, (b.velocity.x or 0.0, b.velocity.y or 0.0), s) for p, b, s in moving if b.velocity is not None]
    else:
        from coupler_protocol.scene.tables.grading import grading_of

        size, what = grading_of(scene.discs).smallest, "the smallest radius"
        first = next((stage for stage in scene.stage if stage_kinds.of(stage).computes), scene.stage[0])
        walls: list[tuple[KeyPath, Any, Any]] = [(("discs", "wall", k), wall, first) for k, wall in enumerate(scene.discs.wall)]
        walls += [(("stage", i, "wall", k), wall, s) for i, s in enumerate(scene.stage) for k, wall in enumerate(s.wall)]
        rows = [(p, wall.velocity, s) for p, wall, s in walls]
    for path, velocity, stage in rows:
        speed = float(np.hypot(*velocity))
        if stage.in_real_time or speed <= GENTLE * size:
            continue
        found = f"the velocity of {dotted(path)} is {speed:g} m a step in static stage {stage.name!r}: "
        found += f"{speed / size:.2g} times {what} ({size:.3g} m)"
        steps = stage.until.steps if stage.until is not None and stage.until.steps else 1
        remedy = f"use at most {GENTLE * 0.1 * size:.1g} m a step"
        if speed / steps <= GENTLE * size:
            remedy += f"; for {speed:g} m in all, {speed / steps:.2g} m a step over {steps} steps"
        yield Suspect((*path, "velocity"), found, remedy + ', or time = "real" for m/s', "speed")


def least_zone(scene: Any) -> float:
    """Size [m] of the smallest zones."""
    grid = scene.grid
    if grid.kind != "ring":
        return min(grid.zone_size)
    return {"full": 2.0, "half": 1.0, "quarter": 0.5}[grid.part] * pi * grid.inner / grid.around
