"""What a scene without a grid must fulfil, and what only such a scene may hold: one rule a function, as in scene_rules.py."""

KINDS = ("fill", "discs")


def discs_alone_need(scene):
    """Discs with springs, and one polygon or a file that says where they are."""
    if scene.discs is None:
        yield ("discs",), "there is neither a grid nor a disc", "add a [grid] or a [discs] table"
        return
    if scene.discs.soil.spring is None:
        yield ("discs", "soil"), "the discs have no stiffness", "add spring = { normal = .., shear = .. }"
    if scene.discs.file is not None and (scene.window or scene.stones):
        yield ("discs", "file"), "the discs come from a file", "remove [[window]] and [stones], or the file"
    if scene.discs.file is None and len(scene.window) != 1:
        yield ("window",), "discs alone fill one window", "add one [[window]] with a polygon, or discs.file"
    for i, window in enumerate(scene.window):
        if window.polygon is None or window.columns is not None or window.rows is not None:
            yield ("window", i), "without a grid there are no columns and rows", "polygon = [[x, y], ..]"


def tables_of_the_grid(scene):
    """Tables that only a grid could use."""
    for name in ("material", "boundary"):
        if getattr(scene, name):
            yield (name,), "there is no grid", f"add a [grid] table or remove [[{name}]]"
    if scene.initial_stress is not None:
        yield ("initial_stress",), "there is no grid", "discs begin as they are packed: remove the table"
    if scene.damping is not None:
        yield ("damping",), "there is no grid to damp", "discs have theirs in [discs.damping]"


def stages_of_discs_alone(scene):
    """First the discs are made, then they move."""
    for i, stage in enumerate(scene.stage):
        at = ("stage", i)
        if stage.kind not in KINDS:
            yield (*at, "kind"), f"a stage of kind {stage.kind!r} needs a grid", 'use kind = "fill", then kind = "discs"'
        elif (stage.kind == "fill") != (i == 0):
            yield at, "discs are made once, at the start", 'begin with one stage of kind "fill"'
        elif stage.kind == "fill":
            if stage.until or stage.gravity_factor or stage.gravity is not None or stage.insitu is not None:
                yield at, "fill computes no steps", "remove until, gravity, gravity_factor and insitu here"
        elif stage.until is None or not any(value is not None for value in stage.until.__dict__.values()):
            yield at, f"stage {stage.name!r} would never end", "add until = { ratio = 1e-4, steps = .. }"
        if stage.until is not None and stage.until.band is not None:
            yield (*at, "until", "band"), "a band runs through a slope with a grid", "use ratio, steps, time or displacement"
        for key in ("handover", "excavate", "surcharge", "large_strain"):
            if getattr(stage, key) is not None:
                yield (*at, key), "this needs a grid", "remove the key"
        if stage.damping is not None and stage.damping.local is None:
            yield (*at, "damping"), "discs know local damping only", "damping = { local = 0.7 }"
        if stage.boundary:
            yield (*at, "boundary"), "there is no grid", "discs are held by [[discs.wall]]"
        if stage.discard:
            yield (*at, "discard"), "only stages of the grid alone can be discarded", "remove the key"


def walls_have_a_length(scene):
    """A wall runs from one point to another, and moves in one kind of time."""
    for i, wall in enumerate(scene.discs.wall if scene.discs else []):
        if wall.velocity != (0.0, 0.0) and len({stage.time for stage in scene.stage if stage.kind == "discs"}) > 1:
            why = "its velocity would be in m/s in some stages and in m a step in others"
            yield ("discs", "wall", i, "velocity"), why, "let all stages compute in real time, or all in static mode"
        if wall.ends[0] == wall.ends[1]:
            yield ("discs", "wall", i, "ends"), "both ends are the same point", "ends = [[x0, y0], [x1, y1]]"


def only_without_a_grid(scene):
    """Keys for discs alone in a scene with a grid."""
    for key in ("wall", "file") if scene.discs else ():
        if getattr(scene.discs, key):
            yield ("discs", key), "this is for discs alone, in scenes without a grid", "remove it, or the [grid]"
    for i, stage in enumerate(scene.stage):
        if stage.kind == "discs":
            yield ("stage", i, "kind"), "this is for discs alone, in scenes without a grid", 'use kind = "couple"'


ALONE_RULES = (discs_alone_need, tables_of_the_grid, stages_of_discs_alone, walls_have_a_length)
