"""Rules between tables, one function each. Each function yields (path, problem, remedy).

Rules of the servers are added through the entry-point group `colluvium.rules`.
"""

from collections.abc import Iterator
from typing import Any
from unicodedata import normalize

import numpy as np

from coupler_protocol.problems import Finding, dotted
from coupler_protocol.scene.installed import installed, loaded
from coupler_protocol.scene.local_origin import local
from coupler_protocol.scene.of_window import of_windows
from coupler_protocol.scene.rules.changes import CHANGE_RULES
from coupler_protocol.scene.rules.discs_alone import ALONE_RULES, only_without_a_grid
from coupler_protocol.scene.rules.endings import DOUBTS_OF_ENDINGS, RULES_OF_ENDINGS
from coupler_protocol.scene.rules.idle import DOUBTS_OF_IDLE
from coupler_protocol.scene.rules.measures import MEASURE_RULES
from coupler_protocol.scene.rules.polygons import polygons_are_outlines
from coupler_protocol.scene.rules.signs import DOUBTS_OF_SIGNS
from coupler_protocol.scene.rules.sizes import fewer_than_memory_holds, many_frames, meshes_of_a_search_fit
from coupler_protocol.scene.rules.stages import STAGE_RULES
from coupler_protocol.scene.rules.units import doubts_of_units, units_are_si
from coupler_protocol.scene.rules.walls import DOUBTS_OF_WALLS
from coupler_protocol.scene.rules.window_tables import in_all_windows, own_tables_fit, without_misfits
from coupler_protocol.scene.rules.windows import WINDOW_RULES
from coupler_protocol.scene.scene import declared_effects, distribution_of
from coupler_protocol.scene.tables.stages import STOPPED

NAMED = {"measure": "region"}  # tables whose items have another name than the table
LEAST = 4.0  # largest discs that must fit side by side into the shorter side of a window


def broken_rules(scene: Any) -> list[Finding]:
    """All broken rules of a scene whose single tables are valid: (path, problem, remedy). Rules get the local scene."""
    misfits = list(own_tables_fit(scene))
    here = without_misfits(local(scene), misfits)
    for rules in (COMMON_RULES + (GRID_RULES if scene.grid else ALONE_RULES), RULES_OF_VALUES):
        broken = misfits + [found for rule in rules for found in rule(here)]
        if broken:
            return broken
    return [found for point in installed("colluvium.rules") for found in loaded(point)(here)]


def doubts(scene: Any) -> list[Finding]:
    """Doubts about a valid scene, (path, what, remedy): of this package and of the entry-point group `colluvium.doubts`.

    They get the local scene.
    """
    here = local(scene)
    own = [found for doubt in DOUBTS for found in doubt(here)]
    return own + [found for point in installed("colluvium.doubts") for found in loaded(point)(here)]


def listed_doubts(scene: Any) -> list[dict[str, str]]:
    """Doubts as rows {"key", "what", "remedy"} of run.json, fos.json and `colluvium check`."""
    return [{"key": dotted(path), "what": what, "remedy": remedy} for path, what, remedy in doubts(scene)]


def grid_needs_material(scene: Any) -> Iterator[Finding]:
    """A grid has a material everywhere, and every material is elastic at least."""
    if not scene.material:
        yield ("material",), "the grid has no material", "add a [[material]] table"
    for i, material in enumerate(scene.material):
        if material.elastic is None:
            yield (
                ("material", i),
                f"material {material.name!r} has no stiffness",
                "add elastic = { bulk = .., shear = .. }",
            )
        if material.region is not None and material.top is not None:
            yield ("material", i), f"material {material.name!r} has a region and a top", "remove one of them"
    if scene.material and all(m.region or m.top for m in scene.material):
        yield ("material", 0), "every material has a region or a top", "let the first one fill the grid: remove its region or top"


@in_all_windows
def effects_of_discs_are_ours(scene: Any) -> Iterator[Finding]:
    """Laws of discs are those of this distribution: the kernels of discs compute no others."""
    discs = scene.discs
    grains = {"soil": discs and discs.soil, "stone": discs and discs.stone}
    holders: list[tuple[tuple, str, Any]] = [(("discs", key), "grain", table) for key, table in grains.items()]
    holders += [(("ring",), "grain", scene.ring), (("discs",), "discs", discs)]
    holders += [(("discs", "pair", i), "grain", pair) for i, pair in enumerate(discs.pair if discs else [])]
    for s, stage in enumerate(scene.stage):
        changes = stage.discs
        holders += [(("stage", s, "discs", key), "grain", getattr(changes, key)) for key in grains if changes is not None]
        holders += [(("stage", s, "discs", "pair", i), "grain", pair) for i, pair in enumerate(changes.pair if changes else [])]
        holders += [(("stage", s, "ring"), "grain", stage.ring), (("stage", s, "discs"), "discs", changes)]
    for path, parent, table in holders:
        for place in declared_effects() if table is not None else ():
            key, owner = place.removeprefix(parent + "."), distribution_of(place)
            if place.startswith(parent + ".") and owner not in ("", "colluvium") and getattr(table, key, None) is not None:
                why = f"no kernel computes {place}, which distribution {owner!r} declares"
                yield (*path, key), why, "remove the table; other distributions can add laws of material.NAME only"


def names_are_unique(scene: Any) -> Iterator[Finding]:
    """No two materials, windows, regions or stages have one name; those of stages also differ where case does not count."""
    for table in ("material", "window", "measure", "stage"):
        seen: dict[str, str] = {}
        for i, item in enumerate(getattr(scene, table)):
            name = normalize("NFC", item.name).casefold() if table == "stage" else item.name
            if name in seen:
                same = f"two {NAMED.get(table, table)}s are named {item.name!r}"
                alike = f"{seen[name]!r} and {item.name!r} name the same files on some disks"
                why = same if seen[name] == item.name else alike
                yield (table, i, "name"), why, "give each its own name"
            seen[name] = item.name
    for i, stage in enumerate(scene.stage):
        if stage.name.casefold() == STOPPED:
            why = f"files named {STOPPED!r} hold the State of a run that failed"
            yield ("stage", i, "name"), why, "give the stage another name"


@in_all_windows
def stones_need_their_material(scene: Any) -> Iterator[Finding]:
    """Stones need a material with springs, and a cluster also bonds; a material without stones waits for a scene with them."""
    grain = scene.discs.stone if scene.discs else None
    if scene.stones is not None and grain is None:
        yield ("stones",), "stones without a material", "add a [discs.stone] table or remove [stones]"
    of_file = grain is not None and scene.grid is None and scene.discs.file is not None
    if grain is None or (scene.stones is None and not of_file):
        return
    body = scene.discs.body if of_file else scene.stones.body
    if grain.spring is None:
        yield ("discs", "stone"), "the stones have no stiffness", "add spring = { normal = .., shear = .. }"
    if body == "cluster" and grain.bond is None and grain.parallel_bond is None:
        yield ("discs", "stone"), "nothing holds the discs of a cluster together", "add bond = { tension = .., shear = .. }"
    if scene.stones is not None and scene.stones.size is not None and scene.stones.size.min < 2.0 * scene.discs.radius:
        smallest = f"at least {2.0 * scene.discs.radius:g} m, the size of a disc"
        yield ("stones", "size", "min"), f"stones of {scene.stones.size.min:g} m are smaller than a disc", smallest


@in_all_windows
def stones_are_drawn_or_mapped(scene: Any) -> Iterator[Finding]:
    """Random stones have a content and sizes; mapped stones have neither, nor other keys that would have no effect."""
    stones = scene.stones
    if stones is None:
        return
    if stones.file is None:
        for key in ("content", "size"):
            if getattr(stones, key) is None:
                remedy = "content = .., size = { mean = .., sigma = .., min = .., max = .. }, or file = .. with traced stones"
                yield ("stones", key), "missing", remedy
        idle = stones.changed("scale", "origin", "outside"), "only stones from `file` use this key"
    else:
        idle = stones.changed("content", "size", "gap", "azimuth", "shapes"), "stones from `file` do not use this key"
    shaped = "shapes" if stones.shapes is not None else "file" if stones.file is not None else None
    for key in idle[0]:
        yield ("stones", key), idle[1], "remove the key"
    for key in stones.changed("vertices", "flatness") if shaped else stones.changed("flip_y"):
        why = f"the outlines come from `{shaped}`" if shaped else "the scene has no file of outlines"
        yield ("stones", key), why, "remove the key"


@in_all_windows
def pairs_name_what_there_is(scene: Any) -> Iterator[Finding]:
    """Each pair of materials has one table, both materials exist, and they can touch."""
    seen = set()
    for i, pair in enumerate(scene.discs.pair if scene.discs else []):
        at, names = ("discs", "pair", i), " and ".join(pair.between)
        if frozenset(pair.between) in seen:
            yield (*at, "between"), f"two tables for the pair {names}", "give each pair of materials one table"
        seen.add(frozenset(pair.between))
        if "stone" in pair.between and scene.discs.stone is None:
            yield (*at, "between"), "the scene has no material stone", "add a [discs.stone] table or remove the pair"
        if set(pair.between) == {"ring"}:
            yield (*at, "between"), "control discs have no contacts with each other", "remove the pair"
        if not pair.model_fields_set - {"between"}:
            yield at, f"this table sets nothing for {names}", "add a table, for example friction = { coefficient = .. }"


def largest_discs_fit(scene: Any) -> Iterator[Finding]:
    """With a grading, a window is at least four of the largest discs across."""
    for i, (window, own) in enumerate(of_windows(scene)):
        if own.discs is None or own.discs.grading is None:
            continue
        across, largest = across_of(scene, window), own.discs.grading.largest
        if across < 2.0 * LEAST * largest:
            why = f"window {window.name!r} is {across:g} m across: too small for its largest discs, of {2.0 * largest:g} m"
            yield ("window", i), why, f"largest diameter at most {across / LEAST:.3g} m, or a larger window"


def across_of(scene: Any, window: Any) -> float:
    """Shorter side of the bounding rectangle of a window [m]; infinite if it is not given."""
    if window.polygon is not None:
        return float(np.ptp(np.array(window.polygon), axis=0).min())
    if scene.grid is None or not scene.grid.zone_size or window.columns is None or window.rows is None:
        return np.inf
    return min(
        (last - first + 1) * d for (first, last), d in zip((window.columns, window.rows), scene.grid.zone_size, strict=True)
    )


COMMON_RULES = (
    names_are_unique,
    polygons_are_outlines,
    effects_of_discs_are_ours,
    stones_need_their_material,
    stones_are_drawn_or_mapped,
    pairs_name_what_there_is,
    largest_discs_fit,
    *CHANGE_RULES,
    *MEASURE_RULES,
)
GRID_RULES = (
    grid_needs_material,
    *WINDOW_RULES,
    only_without_a_grid,
    *STAGE_RULES,
)
RULES_OF_VALUES = (
    units_are_si,
    fewer_than_memory_holds,
    meshes_of_a_search_fit,
    *RULES_OF_ENDINGS,
)  # of scenes whose tables fit together
DOUBTS = (doubts_of_units, *DOUBTS_OF_SIGNS, *DOUBTS_OF_WALLS, *DOUBTS_OF_IDLE, *DOUBTS_OF_ENDINGS, many_frames)
