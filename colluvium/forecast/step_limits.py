"""Limits of a coupled step, for a scene before it is computed and at the ends of a run's stages.

Before a run, the grid is that of the scene with its windows open, at rest. The windows are packed as in a run, bonded, with stiff
rigid or bonded stones, at the pressure of the packing. A run brings them to the slope's stress first, which closes and opens some
contacts; at the end of each coupled stage it reports its safe limits. The exact limit needs both sides in one process: after a
run it is computed from the saved States.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from coupler_protocol.criteria.stable_step import Limit, as_text
from coupler_protocol.scene.local_origin import local
from coupler_protocol.scene.of_window import of_window, of_windows
from coupler_protocol.scene.stage_kinds import coupled

if TYPE_CHECKING:
    from colluvium.forecast.linearised_step import Window


def couples_discs(scene: Any) -> bool:
    """Whether the scene couples a grid with discs."""
    return scene.grid is not None and bool(coupled(scene.stage))


def limits_of_scene(scene: Any, exact: bool = False, note: Callable[..., None] | None = None) -> dict[str, Limit]:
    """Limits (criteria.stable_step.limit) by "grid", "interface", "discs"; exact: also the limit of all together."""
    from colluvium.forecast import linearised_step
    from dem_server.observe.stable_limit import safe_limit
    from fdm_server.observe.stable_limit import safe_limits

    model, state, windows = open_model(scene, note)
    nodes = np.concatenate([window.nodes for window in windows])
    found = safe_limits(model, state, nodes, state.added_mass[nodes])
    each = [safe_limit(window.model, window.state, window.rim, model.grid.origin) for window in windows]
    if any(each):
        found["discs"] = min(filter(None, each), key=lambda limit: limit["share"])
    if exact:
        found["exact"] = linearised_step.exact_limit(model, state, windows)
    return found


def open_model(scene: Any, note: Callable[..., None] | None = None) -> tuple[Any, Any, list["Window"]]:
    """Model and State of the grid with its windows open, and its windows (colluvium.forecast.linearised_step.Window) filled."""
    from colluvium.forecast.linearised_step import Window
    from coupler_protocol.scene.changes import in_stage
    from coupler_protocol.scene.stage_kinds import number_of
    from dem_server.insitu.takeover import take_over
    from dem_server.packing.coupled_window import drawn_stones, packed_window
    from fdm_server.ground.removed_zones import cut_window
    from fdm_server.mesh.grid import build_grid
    from fdm_server.mesh.window_zones import window_rim, window_zones
    from fdm_server.model import build_model, new_state

    first = number_of(scene.stage, couples=True) or 0
    now = local(in_stage(scene, first))
    grid = build_grid(now)
    model = build_model(now, grid)
    state, windows = new_state(model), []
    for rank, window in enumerate(scene.window, start=1):
        mask = window_zones(grid, window)
        nodes, surface = window_rim(grid, mask)
        own = in_stage(of_window(scene, rank), first)
        xy, top = grid.xy[nodes], None if surface is None else grid.xy[surface]
        stones = drawn_stones(own, rank, xy if top is None else np.concatenate([xy, top]), note)
        discs, packed, rim, _ = packed_window(own, rank, xy, stones, note, top)
        body = own.stones and own.stones.body
        discs, _ = take_over(discs, packed, None, 0.0, stones, body, matching=False, stressed=False)
        model, state, _ = cut_window(model, state, mask)
        windows.append(Window(nodes, discs, packed, rim))
    for window in windows:
        state.added_mass[window.nodes] = window.rim.stiffness_sums(window.model, window.state)
    return model, state, windows


def exact_of_run(scene: Any, folder: str | Path) -> dict[str, Limit]:
    """Exact limits {name of the stage: limit} at the ends of coupled stages of the run in `folder` with saved States.

    They are for one leap-frog, so stages with sub-steps of the discs (dem_server/step/clock.py) are left out.
    """
    from colluvium.forecast import linearised_step
    from coupler_protocol.files import restart

    found = {}
    for index, stage in enumerate(scene.stage):
        if stage.in_real_time and scene.coupling.substeps > 1:
            continue
        paths = [Path(folder) / f"{name}.{stage.name}.h5" for name in restart.processes(scene, index)]
        if restart.coupled(scene, index) and all(path.is_file() for path in paths):
            found[stage.name] = linearised_step.exact_limit(*saved_model(scene, index, paths))
    return found


def saved_model(scene: Any, index: int, paths: Sequence[Path]) -> tuple[Any, Any, list["Window"]]:
    """Result of `open_model` from the checkpoints `paths` (grid, then windows) of the stage with number `index`."""
    from colluvium.forecast.linearised_step import Window
    from coupler_protocol.files import checkpoint
    from coupler_protocol.interface.ring import build_ring
    from dem_server.coupling.rim import Rim
    from dem_server.procedure.restart import WindowState
    from fdm_server.effects import with_damping
    from fdm_server.mesh.grid import build_grid
    from fdm_server.mesh.window_zones import window_rim, window_zones
    from fdm_server.procedure.restart import GridState, model_at

    scene = local(scene)
    grid, stage, windows = build_grid(scene), scene.stage[index], []
    saved, *discs = (checkpoint.load(path)[0] for path in paths)
    saved = checkpoint.rebuild(GridState, saved)
    model = model_at(scene, grid, saved.zone, index)
    damping = scene.damping if stage.damping is None else stage.damping
    model = replace(model, law=with_damping(model.law, damping))
    for (window, own), fields in zip(of_windows(scene), discs, strict=True):
        (nodes, surface), found = window_rim(grid, window_zones(grid, window)), checkpoint.rebuild(WindowState, fields)
        top = None if surface is None else grid.xy[surface]
        rim = Rim(build_ring(grid.xy[nodes], own.discs.radius, top), scene.coupling.mapping, found.rim)
        windows.append(Window(nodes, found.model, found.discs, rim))
    return model, saved.grid, windows


def sentences(found: dict[str, Limit]) -> Iterator[str]:
    """Yields sentences with the limits."""
    named = ", ".join(f"{name} {as_text(found[name])}" for name in ("grid", "interface", "discs"))
    yield f"step limits as multiples of the step in use; safe: {named}"
    if "exact" in found:
        yield f"exact step limit as a multiple of the step in use: {as_text(found['exact'])}"
