"""What must hold between tables: one rule a function. Each yields (path, what is wrong, what would be right).

Rules that only a server knows come through the entry-point group `colluvium.rules`.
"""

from importlib.metadata import entry_points

from coupler_protocol.scene import GRID_ONLY, STAGE_KINDS


def broken_rules(scene):
    """All broken rules of a scene whose single tables are right."""
    broken = [found for rule in RULES for found in rule(scene)]
    if broken:
        return broken
    return [found for point in entry_points(group="colluvium.rules") for found in point.load()(scene)]


def grid_needs_material(scene):
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
    if scene.material and all(m.region for m in scene.material):
        yield ("material", 0), "every material has a region", "let the first one fill the grid: leave out its region"


def names_are_unique(scene):
    """Materials, windows and stages are called by their names."""
    for table in ("material", "window", "stage"):
        seen = set()
        for i, item in enumerate(getattr(scene, table)):
            if item.name in seen:
                yield (table, i, "name"), f"{item.name!r} stands twice", "give each its own name"
            seen.add(item.name)


def windows_lie_inside(scene):
    """A window keeps at least one zone between itself and every side of the grid, and one to the next window."""
    columns = round(scene.grid.length / scene.grid.zone_size[0])
    rows = round(scene.grid.height / scene.grid.zone_size[1])
    for i, w in enumerate(scene.window):
        if w.columns[0] < 1 or w.columns[1] > columns - 2:
            yield ("window", i, "columns"), f"{list(w.columns)} reaches the grid's side", f"stay within 1..{columns - 2}"
        if w.rows[0] < 1 or w.rows[1] > rows - 2:
            yield ("window", i, "rows"), f"{list(w.rows)} reaches the grid's side", f"stay within 1..{rows - 2}"
        for other in scene.window[:i]:
            apart = (
                w.columns[0] > other.columns[1] + 1
                or other.columns[0] > w.columns[1] + 1
                or w.rows[0] > other.rows[1] + 1
                or other.rows[0] > w.rows[1] + 1
            )
            if not apart:
                yield ("window", i), f"touches window {other.name!r}", "leave at least one zone between windows"


def windows_need_discs(scene):
    """Windows are filled with discs that have springs."""
    if scene.window and scene.discs is None:
        yield ("window",), "nothing fills the windows", "add a [discs] table"
    if scene.discs is not None and not scene.window:
        yield ("discs",), "there is no window for the discs", "add a [[window]] or remove [discs]"
    if scene.discs is not None and scene.discs.soil.spring is None:
        yield ("discs", "soil"), "the discs have no stiffness", "add spring = { normal = .., shear = .. }"


def discs_fit_into_windows(scene):
    """A window is at least eight discs across."""
    for i, w in enumerate(scene.window if scene.discs else []):
        across = (w.columns[1] - w.columns[0] + 1) * scene.grid.zone_size[0]
        up = (w.rows[1] - w.rows[0] + 1) * scene.grid.zone_size[1]
        if 16.0 * scene.discs.radius > min(across, up):
            why = f"window {w.name!r} is {across:g} x {up:g} m: too small for discs of radius {scene.discs.radius:g} m"
            yield ("window", i), why, f"radius at most {min(across, up) / 16.0:.3g} m, or a larger window"


def stages_follow_each_other(scene):
    """Fill before couple, couple once, and what a kind of stage can use."""
    done = set()
    for i, stage in enumerate(scene.stage):
        at = ("stage", i)
        if stage.kind in ("fill", "couple") and not scene.window:
            yield at, f"stage {stage.name!r} needs a window", "add a [[window]] table or remove the stage"
        if stage.kind == "couple" and "fill" not in done:
            yield at, "couple without discs", 'add a stage with kind = "fill" before it'
        if stage.kind in (*GRID_ONLY, "fill") and "couple" in done:
            yield at, f"a stage of kind {stage.kind!r} cannot follow couple", "move it before the couple stage"
        if stage.kind in ("fill", "couple") and stage.kind in done:
            yield at, f"a second stage of kind {stage.kind!r}", "fill and couple once"
        if stage.kind == "fill" and (stage.until or stage.gravity_factor or stage.gravity is not None):
            yield at, "fill computes no steps of the grid", "remove until, gravity and gravity_factor here"
        if stage.kind != "fill" and (stage.until is None or not any(v is not None for v in stage.until.__dict__.values())):
            yield at, f"stage {stage.name!r} would never end", "add until = { ratio = 1e-5, steps = .. }"
        if stage.handover is not None and stage.kind != "couple":
            yield (*at, "handover"), "only a stage of kind couple hands over", "remove the key"
        if stage.insitu is not None and stage.kind != "fill":
            yield (*at, "insitu"), "only a stage of kind fill packs discs", "remove the key"
        if stage.discard and stage.kind not in GRID_ONLY:
            yield (*at, "discard"), "only stages of the grid alone can be discarded", "remove the key"
        done.add(stage.kind)
    if scene.window and "couple" not in done:
        yield ("window",), "no stage couples the window", 'add stages with kind = "fill" and kind = "couple"'


RULES = (
    grid_needs_material,
    names_are_unique,
    windows_lie_inside,
    windows_need_discs,
    discs_fit_into_windows,
    stages_follow_each_other,
)
assert set(GRID_ONLY) < set(STAGE_KINDS)
