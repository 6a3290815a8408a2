"""Scenes of a coupled search: the slope at rest that all trials begin with, and one trial; what cannot be searched, in words."""

import json
from collections.abc import Iterator
from typing import Any

from colluvium.safety.reduction import changes, unknown
from coupler_protocol.problems import Problem
from coupler_protocol.scene.reader import build_scene
from coupler_protocol.scene.stage_kinds import number_of, of
from fdm_server.fos.flow_rule import SCENE, with_flow

NAME = "trial"  # stage in which strength is reduced


def is_coupled(scene: Any) -> bool:
    """Whether a scene couples discs with its grid."""
    return scene.grid is not None and number_of(scene.stage, couples=True) is not None


def kept_stages(scene: Any) -> list[Any]:
    """Stages before the strength is reduced: all but discarded ones and overload."""
    return [stage for stage in scene.stage if not stage.discard and not of(stage).overloads]


def problems_of(scene: Any, path: str, options: Any) -> list[Problem]:
    """Reasons for which a coupled scene, or these options of the command, cannot be searched."""
    return [Problem(path, None, *found) for found in (*_of_options(scene, options), *_of_scene(scene))]


def _of_options(scene: Any, options: Any) -> Iterator[tuple[str, str, str]]:
    grid_alone = "add --grid: only the grid is then computed"
    if (options.by or scene.fos.by) == "gravity":
        yield "fos.by", "the gravity of a coupled slope grows in a stage of kind overload", f"colluvium run, or {grid_alone}"
    if options.meshes or scene.fos.zone_sizes:
        yield "fos.zone_sizes", "a window belongs to the zones of one mesh", f"remove the key and --meshes, or {grid_alone}"
    if options.flow == "both":
        yield "fos.flow", "a coupled search has one flow rule", f"--flow zero, then --flow associated, or {grid_alone}"


def _of_scene(scene: Any) -> Iterator[tuple[str, str, str]]:
    kept = kept_stages(scene)
    first = number_of(scene.stage, overloads=True)
    late = [] if first is None else [stage.name for stage in scene.stage[first:] if stage in kept]
    if late:
        yield "stage", f"stage {late[0]!r} follows an overload, which is no part of the search", "move it before the overload"
    for stage in kept:
        if stage.in_real_time:
            yield f"stage {stage.name}.time", "trials of a factor of safety are static", 'use time = "static"'
        if stage.large_strain or scene.grid.large_strain:
            yield f"stage {stage.name}.large_strain", "trials compute in the shape drawn, also at the interface", "remove the key"
        if stage.until is not None and stage.until.ratio is None and of(stage).rests:
            yield f"stage {stage.name}.until", "trials begin with a slope at rest", "add a ratio: until = { ratio = 1e-5, .. }"
    if any(window.discs is not None for window in scene.window):
        yield "window.discs", "a stage changes the discs of all windows alike", "give all windows the strengths of [discs]"
    if scene.fos.flow != SCENE and any(stage.material for stage in kept):
        yield "fos.flow", "stages change materials, whose dilation cannot be replaced", 'use flow = "scene"'
    for place, name in unknown(scene.discs, scene.ring):
        yield f"{place}.{name}", "the factor cannot divide it: it is a law of another distribution", "remove the table"


def base_tables(scene: Any) -> dict[str, Any]:
    """Tables of the scene that brings the coupled slope to rest."""
    drawn = with_flow(scene.drawn)
    plain: dict[str, Any] = drawn.model_dump(mode="json", exclude_none=True)
    kept = [stage.name for stage in kept_stages(drawn)]
    return plain | {"stage": [stage for stage in plain["stage"] if stage["name"] in kept]}


def trial_tables(base: Any, tables: dict[str, Any], factor: float, steps: int) -> dict[str, Any]:
    """Tables of the trial of a factor; base: the scene of `tables`, steps: its budget."""
    stage = {
        "name": trial_name(base),
        "kind": "load",
        "until": {"steps": steps},
        "record": {"every": steps},  # frames: the first and the last
    }
    return tables | {"stage": [*tables["stage"], stage | changes(base, factor)]}


def trial_name(base: Any) -> str:
    """Name of the stage of a trial, which no stage of the scene has."""
    taken, name = {stage.name for stage in base.stage}, NAME
    while name in taken:
        name += "_"
    return name


def checked(tables: dict[str, Any]) -> Any:
    """The scene of tables; raises SceneError."""
    return build_scene(json.loads(json.dumps(tables)))
