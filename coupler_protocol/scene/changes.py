"""Changes of materials from a stage on, and the scene as it is in a stage.

A stage has the tables of the scene with only the keys that change, in the same places: [[stage.material]] by name,
[stage.discs.soil], [stage.discs.stone], [[stage.discs.pair]], [stage.discs.damping], [stage.ring], [stage.record]. They last for
later stages; those of a discarded stage act only in it.
"""

from collections.abc import Iterator, Sequence
from types import NoneType
from typing import Any, get_args

from coupler_protocol.scene.declare import Effect
from coupler_protocol.scene.tables.changes import Change

GRAINS = ("soil", "stone")
CHANGING = ("material", "discs", "ring", "record")  # keys of a stage that are also keys of the scene, of which it changes a part
CANNOT = {  # keys of the scene that no stage changes: the remedy
    "density": "masses are those of the whole run: change gravity_factor, or compute another scene",
    "region": "zones keep their material: change the material itself, or give that part of the ground its own material",
    "top": "zones keep their material: change the material itself, or give that part of the ground its own material",
    "radius": "discs keep their sizes: change them in [discs], and compute the scene from its start",
    "wall": "walls change in [[stage.wall]]",
    "stiffness": "say in [discs] whether springs belong to discs or to contacts, for all stages",
    "trace": "give it in [record], for all stages",
    "energy": "give it in [record], for all stages",
}
FOR_ALL_STAGES = "give it in the table of the scene, for all stages"  # remedy for other keys


def in_stage(scene: Any, index: int) -> Any:
    """The scene with materials, discs and ring of the stage with this number."""
    return _changed(scene, [stage for i, stage in enumerate(scene.stage[: index + 1]) if i == index or not stage.discard])


def after_stage(scene: Any, index: int) -> Any:
    """The scene with materials, discs and ring that the stage after this number begins with, before it changes them."""
    return _changed(scene, [stage for stage in scene.stage[: index + 1] if not stage.discard])


def record_in(scene: Any, index: int) -> Any:
    """The record table of the stage with this number; those of discarded stages act only in them."""
    acting = [s.record for i, s in enumerate(scene.stage[: index + 1]) if s.record is not None and (i == index or not s.discard)]
    update = {key: value for table in acting for key, value in table.model_dump(exclude_none=True).items()}
    return scene.record.model_copy(update=update) if update else scene.record


def changes_discs(stage: Any) -> bool:
    """Whether a stage has tables that change discs or their contacts with the ring."""
    return stage.discs is not None or stage.ring is not None


def changes_anything_in(stage: Any) -> bool:
    """Whether a stage has tables that change materials, discs, ring or record."""
    return bool(stage.material) or changes_discs(stage) or stage.record is not None


def changes_anything(scene: Any) -> bool:
    """Whether any stage has such tables."""
    return any(map(changes_anything_in, scene.stage))


def changed(table: Effect | None, change: Change) -> Effect | None:
    """The table of an effect after a change; raises pydantic's ValidationError for keys that do not fit together."""
    if change.absent:
        return None
    before = {} if table is None else table.model_dump(exclude_none=True)
    return change.effect.model_validate(change.effect.after_change(before, change.given()))


def changes_in(table: Any) -> dict[str, Change]:
    """The Changes that a table of a stage holds directly, by the name of the effect."""
    if table is None:
        return {}
    return {name: value for name in type(table).model_fields if isinstance(value := getattr(table, name), Change)}


def _changed(scene: Any, stages: Sequence[Any]) -> Any:
    update: dict[str, Any] = {}
    for stage in stages:
        now = scene.model_copy(update=update)
        if stage.material:
            tables = {table.name: table for table in stage.material}
            update["material"] = [_with_effects(m, tables.get(m.name)) for m in now.material]
        if stage.ring is not None:
            update["ring"] = _with_effects(now.ring or _class_of(scene, "ring")(), stage.ring)
        if stage.discs is not None and now.discs is not None:
            update["discs"] = _discs(now.discs, stage.discs)
    return scene.model_copy(update=update) if update else scene


def _with_effects(owner: Any, table: Any) -> Any:
    """A table of the scene with the effects changed that a table of a stage names."""
    found = {name: changed(getattr(owner, name), change) for name, change in changes_in(table).items()}
    return owner.model_copy(update=found) if found else owner


def _discs(discs: Any, table: Any) -> Any:
    update: dict[str, Any] = {}
    for grain in GRAINS:
        if getattr(table, grain) is not None and getattr(discs, grain) is not None:
            update[grain] = _with_effects(getattr(discs, grain), getattr(table, grain))
    pairs = list(discs.pair)
    for own in table.pair:
        at = next((k for k, pair in enumerate(pairs) if set(pair.between) == set(own.between)), len(pairs))
        pair = pairs[at] if at < len(pairs) else _class_of(discs, "pair")(between=own.between)
        pairs[at : at + 1] = [_with_effects(pair, own)]
    if table.pair:
        update["pair"] = pairs
    return _with_effects(discs, table).model_copy(update=update)


def _class_of(owner: Any, name: str) -> Any:
    """The class of the tables under a key, alone or in a list."""
    return next(part for part in get_args(type(owner).model_fields[name].annotation) if part is not NoneType)


# -- in words --------------------------------------------------------------------------------------------------------------


def words(scene: Any, index: int) -> list[str]:
    """What changes at the start of the stage with this number, a text for each key."""
    before, now = _holders(after_stage(scene, index - 1)), _holders(in_stage(scene, index))
    found = [text for place, table in now.items() for text in _differences(place, before.get(place), table)]
    own, discs = scene.stage[index].record, scene.stage[index].discs
    found += [f"record.{key} {value}" for key, value in own.model_dump(exclude_none=True).items()] if own is not None else []
    if discs is not None and discs.bond_gap is not None:
        found.append(f"discs: bonds at all contacts with a gap up to {discs.bond_gap:g} m")
    return found


def _holders(scene: Any) -> dict[str, Any]:
    """All tables of a scene whose effects may change, by their place in words."""
    found = {f"material {m.name!r}": m for m in scene.material}
    discs = scene.discs
    if discs is not None:
        found |= {"discs": discs, "discs.soil": discs.soil}
        found |= {"discs.stone": discs.stone} if discs.stone is not None else {}
        found |= {f"discs.pair {' and '.join(sorted(pair.between))}": pair for pair in discs.pair}
    return found | ({"ring": scene.ring} if scene.ring is not None else {})


def _differences(place: str, before: Any, now: Any) -> Iterator[str]:
    for name in type(now).model_fields:
        a, b = getattr(before, name, None), getattr(now, name)
        if not isinstance(a or b, Effect) or a == b:
            continue
        if b is None:
            yield f"{place}: {name} ends"
        elif a is None:
            given = ", ".join(f"{key} {_said(value)}" for key, value in b.model_dump(exclude_none=True).items())
            yield f"{place}: {name} begins ({given})"
        else:
            yield from (f"{place}: {name}.{text}" for text in _of_keys(a, b))


def _of_keys(a: Any, b: Any) -> Iterator[str]:
    for key, field in type(b).model_fields.items():
        one, other = getattr(a, key), getattr(b, key)
        if one != other:
            extra: Any = field.json_schema_extra or {}
            unit = f" {extra['unit']}" if extra.get("unit", "-") != "-" else ""
            yield f"{key} {_said(one)} -> {_said(other)}{unit}"


def _said(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.6g}"
    return "none" if value is None else str(value).lower() if isinstance(value, bool) else str(value)
