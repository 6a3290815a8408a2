"""Rules for tables of a stage that change materials, discs and records: one function each, as in between_tables.py."""

from collections.abc import Iterator
from typing import Any

from pydantic import ValidationError

from coupler_protocol.problems import Finding, KeyPath, reason_and_remedy
from coupler_protocol.scene.changes import GRAINS, changed, changes_in
from coupler_protocol.scene.rules.window_tables import in_all_windows, in_no_window
from coupler_protocol.scene.stage_kinds import number_of, of
from coupler_protocol.scene.tables.changes import Change, StageDiscs
from coupler_protocol.scene.tables.grading import grading_of

NEEDED = {"material": ("elastic",), "soil": ("spring",), "stone": ("spring",)}  # effects that a table cannot do without
BONDS = ("bond", "parallel_bond")
REACH = 0.25  # of the smallest radius: largest gap that a bond closes


def changes_have_their_stage(scene: Any) -> Iterator[Finding]:
    """Materials change in stages that compute the grid, discs in stages that move them."""
    for i, stage in enumerate(scene.stage):
        at = ("stage", i)
        if stage.material and scene.grid is None:
            yield (*at, "material"), "this needs a grid", "change the discs: [stage.discs.soil]"
        elif stage.material and not of(stage).computes:
            yield (*at, "material"), f"a stage of kind {stage.kind} computes no steps", "move the change to the stage after it"
        if stage.record is not None and not of(stage).computes:
            yield (*at, "record"), f"a stage of kind {stage.kind} computes no steps", "move the change to the stage after it"
        for key in ("discs", "ring"):
            if getattr(stage, key) is None:
                continue
            if scene.discs is None:
                yield (*at, key), "the scene has no discs", "remove the table, or add [[window]] and [discs]"
            elif not _moves_discs(scene, i):
                first = "couple" if scene.grid is not None else "discs"
                why = f"no disc moves in stage {stage.name!r} of kind {stage.kind!r}"
                yield (*at, key), why, f"give these values in [{key}], or in the first stage of kind {first}, or later"


def _moves_discs(scene: Any, index: int) -> bool:
    if scene.grid is None:
        return of(scene.stage[index]).computes
    first = number_of(scene.stage, couples=True)
    return first is not None and index >= first


def changes_name_what_there_is(scene: Any) -> Iterator[Finding]:
    """A table of a stage names a material of the scene, once."""
    names = [material.name for material in scene.material]
    for i, stage in enumerate(scene.stage):
        seen: set[str] = set()
        for k, table in enumerate(stage.material):
            path = ("stage", i, "material", k, "name")
            if table.name not in names:
                yield path, f"no material is named {table.name!r}", f"materials: {', '.join(names) or 'none'}"
            elif table.name in seen:
                yield path, f"two tables for material {table.name!r}", "give each material one table in a stage"
            seen.add(table.name)
        if stage.discs is None or scene.discs is None:
            continue
        pairs: set[frozenset[str]] = set()
        for k, pair in enumerate(stage.discs.pair):
            at: KeyPath = ("stage", i, "discs", "pair", k, "between")
            between = frozenset(pair.between)
            if between in pairs:
                yield at, f"two tables for the pair {' and '.join(pair.between)}", "give each pair of materials one table"
            elif between == {"ring"}:
                yield at, "control discs have no contacts with each other", "remove the pair"
            pairs.add(between)


@in_no_window
def changes_of_stones_have_stones(scene: Any) -> Iterator[Finding]:
    """A table of a stage for the material of stones needs that material in a window."""
    for i, stage in enumerate(scene.stage if scene.discs is not None and scene.discs.stone is None else ()):
        if stage.discs is not None and stage.discs.stone is not None:
            yield ("stage", i, "discs", "stone"), "the scene has no material stone", "add [discs.stone], or remove the table"
        for k, pair in enumerate(stage.discs.pair if stage.discs is not None else ()):
            if "stone" in pair.between:
                remedy = "add a [discs.stone] table or remove the pair"
                yield ("stage", i, "discs", "pair", k, "between"), "the scene has no material stone", remedy


@in_all_windows
def changes_fit_their_effects(scene: Any) -> Iterator[Finding]:
    """Every change sets something and leaves a table that its effect accepts; what all kinds need stays."""
    yield from (found for found, of_nothing in _misfits(scene) if not of_nothing)


@in_no_window
def effects_that_end_are_there(scene: Any) -> Iterator[Finding]:
    """An effect that ends acts before, in one window at least."""
    yield from (found for found, of_nothing in _misfits(scene) if of_nothing)


def _misfits(scene: Any) -> Iterator[tuple[Finding, bool]]:
    """(finding, whether it is about the end of an effect that does not act) of all tables of stages."""
    now: dict[Any, Any] = {("material", m.name): m for m in scene.material} | {"ring": scene.ring}
    if scene.discs is not None:
        now |= {"discs": scene.discs} | {grain: getattr(scene.discs, grain) for grain in GRAINS}
        now |= {frozenset(pair.between): pair for pair in scene.discs.pair}
    effects: dict[Any, dict[str, Any]] = {}  # tables as changed so far, by their holder
    for i, stage in enumerate(scene.stage):
        kept = {holder: dict(tables) for holder, tables in effects.items()}
        for path, holder, table in _tables(i, stage):
            owner, found = now.get(holder), effects.setdefault(holder, {})
            changes = changes_in(table)
            if not changes and not _says_more(table):
                yield (path, "this table changes nothing", "give the effects that change, with the keys that change"), False
            for name, change in changes.items():
                before = found.get(name, getattr(owner, name, None))
                if change.absent and before is None and not change.given():
                    yield ((*path, name), f"there is no {name} that could end", "remove the key"), True
                    continue
                broken = list(_faults((*path, name), holder, name, before, change))
                yield from ((one, False) for one in broken)
                found[name] = before if broken else changed(before, change)
        if stage.discard:
            effects = kept


def _says_more(discs: Any) -> bool:
    """Whether a table is a [stage.discs] that holds tables of its materials, or a key of its own."""
    own: Any = discs if isinstance(discs, StageDiscs) else None
    return own is not None and (own.bond_gap is not None or bool(own.pair) or any(getattr(own, grain) for grain in GRAINS))


def _tables(i: int, stage: Any) -> Iterator[tuple[KeyPath, Any, Any]]:
    """(path, holder, table) of all tables with changes of a stage."""
    for k, table in enumerate(stage.material):
        yield ("stage", i, "material", k), ("material", table.name), table
    if stage.ring is not None:
        yield ("stage", i, "ring"), "ring", stage.ring
    if stage.discs is not None:
        at = ("stage", i, "discs")
        yield at, "discs", stage.discs
        yield from (((*at, grain), grain, getattr(stage.discs, grain)) for grain in GRAINS if getattr(stage.discs, grain))
        yield from (((*at, "pair", k), frozenset(pair.between), pair) for k, pair in enumerate(stage.discs.pair))


def _faults(path: KeyPath, holder: Any, name: str, before: Any, change: Change) -> Iterator[Finding]:
    given = change.given()
    if change.absent:
        needed = NEEDED.get(holder[0] if isinstance(holder, tuple) else holder, ()) if not isinstance(holder, frozenset) else ()
        if given:
            yield path, "the effect ends and changes", "give false to end it, or the keys that change"
        elif name in needed:
            yield path, f"nothing holds without {name}", "give it other values"
        return
    if not given:
        yield path, "this table changes nothing", f"give the keys that change, or {name} = false to end the effect"
        return
    try:
        changed(before, change)
    except ValidationError as error:
        for one in error.errors():
            at = (*path, *one["loc"])
            if one["type"] == "missing":
                yield at, "missing", f"{name} begins in this stage: give all keys that it needs"
            else:
                fits = one["ctx"]["remedy"] if one["type"] == "refused" else "the values after the change must fit together"
                reason, remedy = reason_and_remedy(one["msg"].removeprefix("Value error, "), fits)
                yield at, reason, remedy


@in_no_window
def bonds_that_can_be_made(scene: Any) -> Iterator[Finding]:
    """A gap for new bonds needs materials that bond."""
    bonding = _bonds(scene)
    for i, stage, _ in _gaps(scene):
        if not bonding[i]:
            why = f"no material of discs has bonds in stage {stage.name!r}"
            yield ("stage", i, "discs", "bond_gap"), why, "add bond or parallel_bond to one, or remove the key"


@in_all_windows
def gaps_of_bonds_are_small(scene: Any) -> Iterator[Finding]:
    """A gap for new bonds is small beside the discs."""
    for i, _, gap in _gaps(scene):
        least = grading_of(scene.discs).smallest
        if scene.discs.file is None and gap > REACH * least:
            why = f"a gap of {gap:g} m is more than a quarter of the smallest radius, {least:.3g} m"
            yield ("stage", i, "discs", "bond_gap"), why, f"at most {REACH * least:.2g} m"


def _gaps(scene: Any) -> Iterator[tuple[int, Any, float]]:
    """(number, stage, gap) of the stages that bond discs across a gap."""
    for i, stage in enumerate(scene.stage if scene.discs is not None else ()):
        if stage.discs is not None and stage.discs.bond_gap is not None:
            yield i, stage, stage.discs.bond_gap


def _bonds(scene: Any) -> list[bool]:
    """Whether any material or pair of discs has bonds, in each stage."""
    holders: dict[Any, Any] = {"ring": scene.ring}
    if scene.discs is not None:
        holders |= {grain: getattr(scene.discs, grain) for grain in GRAINS}
        holders |= {frozenset(pair.between): pair for pair in scene.discs.pair}
    there = {(holder, name): getattr(table, name, None) is not None for holder, table in holders.items() for name in BONDS}
    found = []
    for i, stage in enumerate(scene.stage):
        for _, holder, table in _tables(i, stage):
            there |= {(holder, name): not change.absent for name, change in changes_in(table).items() if name in BONDS}
        found.append(any(there.values()))
    return found


CHANGE_RULES = (
    changes_have_their_stage,
    changes_name_what_there_is,
    changes_of_stones_have_stones,
    effects_that_end_are_there,
    changes_fit_their_effects,
    bonds_that_can_be_made,
    gaps_of_bonds_are_small,
)
