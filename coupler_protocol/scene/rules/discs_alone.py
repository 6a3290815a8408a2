"""Rules for scenes without a grid, and for keys of such scenes only: one function each, as in between_tables.py."""

from collections.abc import Iterator
from typing import Any

from coupler_protocol.problems import Finding
from coupler_protocol.scene.of_window import of_windows
from coupler_protocol.scene.rules.stages import never_ends
from coupler_protocol.scene.stage_kinds import of
from coupler_protocol.scene.tables.discs import names_of_walls


def discs_alone_need(scene: Any) -> Iterator[Finding]:
    """Discs alone need springs, and one polygon or a file of discs."""
    if scene.discs is None:
        yield ("discs",), "the scene has neither a grid nor discs", "add a [grid] or a [discs] table"
        return
    if scene.discs.soil.spring is None:
        yield ("discs", "soil"), "the discs have no stiffness", "add spring = { normal = .., shear = .. }"
    if scene.discs.file is not None and (scene.window or scene.stones):
        yield ("discs", "file"), "the discs come from a file", "remove [[window]] and [stones], or the file"
    if scene.discs.file is None and len(scene.window) != 1:
        yield ("window",), "discs alone fill one window", "add one [[window]] with a polygon, or discs.file"
    for i, window in enumerate(scene.window):
        if window.polygon is None or window.columns is not None or window.rows is not None:
            yield ("window", i), "columns and rows need a grid", "polygon = [[x, y], ..]"


def tables_of_the_grid(scene: Any) -> Iterator[Finding]:
    """Scenes without a grid have no tables that only a grid uses."""
    for name in ("material", "boundary"):
        if getattr(scene, name):
            yield (name,), "this needs a grid", f"add a [grid] table or remove [[{name}]]"
    if scene.initial_stress is not None:
        yield ("initial_stress",), "this needs a grid", "remove the table: discs start with the stress of their packing"
    if scene.record.trace is not None:
        yield ("record", "trace"), "a single process has nothing to wait for", "remove the key"
    if scene.damping is not None:
        yield ("damping",), "this table damps the grid, and the scene has none", "use [discs.damping]"


def stages_of_discs_alone(scene: Any) -> Iterator[Finding]:
    """The first stage packs the discs, the others move them."""
    for i, stage in enumerate(scene.stage):
        at = ("stage", i)
        if not of(stage).alone:
            yield (*at, "kind"), f"a stage of kind {stage.kind!r} needs a grid", 'use kind = "fill", then kind = "discs"'
        elif of(stage).computes != (i > 0):
            yield at, "discs are packed once, in the first stage", 'use one stage of kind "fill" and put it first'
        elif not of(stage).computes:
            if stage.until or stage.gravity_factor or stage.gravity is not None or stage.insitu is not None:
                yield at, "a stage of kind fill computes no steps", "remove until, gravity, gravity_factor and insitu here"
        elif never_ends(stage):
            yield at, f"stage {stage.name!r} would never end", "add until = { ratio = 1e-4, steps = .. }"
        if stage.until is not None and stage.until.band is not None:
            yield (*at, "until", "band"), "only a grid has a shear band", "use ratio, steps, time or displacement"
        for key in ("handover", "excavate", "surcharge", "large_strain"):
            if getattr(stage, key) is not None:
                yield (*at, key), "this needs a grid", "remove the key"
        if stage.damping is not None and stage.damping.local is None:
            yield (*at, "damping"), "discs have local damping only", "damping = { local = 0.7 }"
        if stage.boundary:
            yield (*at, "boundary"), "this needs a grid", "hold discs with [[discs.wall]]"
        if stage.discard:
            yield (*at, "discard"), "only stages of the grid alone can be discarded", "remove the key"


def walls_have_a_length(scene: Any) -> Iterator[Finding]:
    """A wall has two different ends and a unique name."""
    walls = scene.discs.wall if scene.discs else []
    names = names_of_walls(walls)
    for i, wall in enumerate(walls):
        if wall.ends[0] == wall.ends[1]:
            yield ("discs", "wall", i, "ends"), "both ends are the same point", "ends = [[x0, y0], [x1, y1]]"
        if names[i] in names[:i]:
            yield ("discs", "wall", i, "name"), f"two walls are named {names[i]!r}", "give each wall its own name"


def walls_move_in_one_kind_of_time(scene: Any) -> Iterator[Finding]:
    """Stages change only existing walls; a speed is either in m/s or in m a step."""
    walls = scene.discs.wall if scene.discs else []
    names = names_of_walls(walls)
    acting: dict[str, tuple[tuple, Any]] = {
        name: (("discs", "wall", i), wall) for i, (name, wall) in enumerate(zip(names, walls, strict=True))
    }
    times: dict[tuple, tuple[Any, set[str]]] = {}
    for i, stage in enumerate(scene.stage):
        for j, table in enumerate(stage.wall):
            path: tuple = ("stage", i, "wall", j)
            if table.name not in names:
                yield (*path, "name"), f"no wall is named {table.name!r}", f"walls: {', '.join(names) or 'none'}"
            elif of(stage).grid:
                yield path, f"walls cannot change in a stage of kind {stage.kind!r}", "use a stage of kind discs"
            else:
                acting[table.name] = path, table
        if not of(stage).grid:
            for path, table in acting.values():
                times.setdefault(path, (table, set()))[1].add(stage.time)
    for path, (table, kinds) in times.items():
        if table.moves and len(kinds) > 1:
            key = "velocity" if table.servo is None else "servo"
            why = "its velocity would be in m/s in some stages and in m a step in others"
            yield (*path, key), why, "give it again where time changes ([[stage.wall]]), or use one kind of time in all stages"


def only_without_a_grid(scene: Any) -> Iterator[Finding]:
    """Scenes with a grid have no keys for discs alone."""
    if scene.discs and scene.discs.wall:
        yield ("discs", "wall"), "only scenes without a grid have this", "remove it, or remove [grid]"
    files = [own.discs.file for _, own in of_windows(scene)] if scene.discs else []
    for path in dict.fromkeys(file for file in files if file is not None and files.count(file) > 1):
        i = files.index(path)
        given = scene.window[i].discs is not None and scene.window[i].discs.file is not None
        remedy = "keep one [[window]], or give each window its own file: [window.discs] file = .."
        yield (("window", i) if given else ()) + ("discs", "file"), f"one file cannot fill {files.count(path)} windows", remedy
    for i, stage in enumerate(scene.stage):
        if stage.wall:
            yield ("stage", i, "wall"), "only scenes without a grid have this", "remove it, or remove [grid]"
        if not of(stage).grid:
            yield ("stage", i, "kind"), "only scenes without a grid have this", 'use kind = "couple"'


ALONE_RULES = (
    discs_alone_need,
    tables_of_the_grid,
    stages_of_discs_alone,
    walls_have_a_length,
    walls_move_in_one_kind_of_time,
)
