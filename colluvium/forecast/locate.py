"""Position of the band relative to the windows of a scene, from a stage of kind `locate`, the grid alone under other gravity.

The band's level is the highest shear strain that connects toe and crest (coupler_protocol.criteria.shear_band);
colluvium.results.band_line gives its line. The band crosses a window if the level is lower without the zones that become the
hole: the band needs them. The line gives the points where the band enters and leaves, and its distances from the ends of the
window, the two short sides.
"""

from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple, cast

import numpy as np
import shapely

from colluvium.results import band_line
from colluvium.results import failure as recorded
from colluvium.results.run import Run, open_run
from coupler_protocol.criteria import shear_band
from coupler_protocol.exits import RunEnded
from coupler_protocol.scene.local_origin import in_the_scene, local
from coupler_protocol.scene.rules.between_tables import broken_rules
from coupler_protocol.scene.rules.stages import is_level
from coupler_protocol.scene.stage_kinds import of


class Band(NamedTuple):
    """The band of a grid alone."""

    cells: shear_band.Cells
    surface: shear_band.Surface
    level: float
    line: np.ndarray  # (p, 2) [m], from the toe to the crest

    def level_without(self, box: shapely.Polygon) -> float:
        """Level of the connection around the zones in a box."""
        xy = self.cells.xy
        return shear_band.toe_to_crest(self.cells, self.surface, shapely.contains_xy(box, xy[:, 0], xy[:, 1]))


def stage_of(scene: Any) -> int | None:
    """Number of the last stage of kind locate, or None; level ground has no band to locate."""
    found = [i for i, stage in enumerate(scene.stage) if of(stage).locates]
    return found[-1] if found and not is_level(scene) else None


def grid_alone(scene: Any) -> Any:
    """The scene for the grid alone: up to the last stage of kind locate, without windows, discs and stones."""
    last = cast(int, stage_of(scene))
    kept = [stage for stage in scene.stage[: last + 1] if not of(stage).fills]
    return scene.model_copy(update={"window": [], "discs": None, "stones": None, "ring": None, "stage": kept})


def compute(scene: Any, picture: Callable[[dict[str, Any]], None] | None = None) -> dict | None:
    """Runs `grid_alone` in a separate process, reported to `picture`; returns `band_and_windows`. Raises RunEnded if it fails."""
    from colluvium.running import processes

    with TemporaryDirectory(prefix="colluvium-") as folder:
        path = Path(folder) / "scene.toml"
        path.write_text(processes.as_toml(grid_alone(scene).model_dump(mode="json", exclude_none=True)), encoding="utf-8")
        code = processes.run_files(path, folder, 0, picture=picture)
        if code:
            error = RunEnded("the grid alone could not be computed; --no-locate leaves it out")
            error.code = code
            raise error
        with open_run(folder) as run:
            return band_and_windows(run, scene)


def band_and_windows(run: Run, scene: Any) -> dict | None:
    """Band at the end of the last stage of kind locate, and its position relative to each window of `scene`.

    None if the run has recorded no such stage. Without a band `line` and `windows` are empty.
    """
    number = stage_of(scene)
    if number is None or scene.stage[number].name not in run.stages:
        return None
    name = scene.stage[number].name
    frame = run.last_frame(name)
    here = local(scene)
    cells, surface = _local(recorded.cells(run, frame), recorded.ground(run), np.array(here.origin))
    level = shear_band.toe_to_crest(cells, surface)
    found = {"stage": name, "gravity_factor": run.frames[frame].gravity_factor, "level": level, "counted": shear_band.COUNTED}
    if level < shear_band.COUNTED:
        return found | {"line": [], "windows": []}
    there = Band(cells, surface, level, band_line.line_of_band(cells, surface, level))
    windows = [_in_the_scene(_beside(there, here, _grid(here), i), here.origin) for i in range(len(scene.window))]
    return found | {"line": in_the_scene(there.line, here.origin).tolist(), "windows": windows}


def _local(cells: shear_band.Cells, surface: shear_band.Surface, origin: np.ndarray) -> tuple[Any, Any]:
    """Cells and surface of a run, counted from the local origin of its scene."""
    if not origin.any():
        return cells, surface
    return cells._replace(xy=cells.xy - origin), shear_band.Surface(*(xy - origin for xy in surface))


def _in_the_scene(found: dict[str, Any], origin: tuple[float, float]) -> dict[str, Any]:
    """A row of `_beside` with its points in the coordinates of the scene."""
    return found | {key: in_the_scene(np.array(found[key]), origin).tolist() for key in ("enters", "leaves") if found[key]}


def _grid(scene: Any) -> Any:
    from fdm_server.mesh.grid import build_grid

    return build_grid(scene)


def _beside(there: Band, scene: Any, grid: Any, number: int) -> dict:
    """Position of the band relative to one window."""
    window = scene.window[number]
    box = outline(grid, window)
    around, way = there.level_without(box), band_line.crossing(there.line, box)
    found = {"name": window.name, "crosses": around < there.level, "level_around": around}
    found |= {"enters": way and list(way[0]), "leaves": way and list(way[1]), "ends": _ends(there.line, box)}
    found["distance"] = float(shapely.distance(shapely.LineString(there.line), box))
    return found if found["crosses"] else found | {"better": _better(there, scene, grid, number)}


def outline(grid: Any, window: Any) -> shapely.Polygon:
    """The rim of a window in a fdm_server.mesh.grid.Grid [m]."""
    from fdm_server.mesh.window_zones import window_rim, window_zones

    return shapely.Polygon(grid.xy[window_rim(grid, window_zones(grid, window)).outline])


def _cell(scene: Any) -> np.ndarray:
    """Width and height of a zone [m], in whole numbers over the grid."""
    extent = np.array([scene.grid.length, scene.grid.height])
    return extent / np.rint(extent / scene.grid.zone_size)


def _ends(line: np.ndarray, box: shapely.Polygon) -> dict[str, float]:
    """Distances [m] of a window's ends from the band: of the corners on the two short sides of its bounding box."""
    x0, y0, x1, y1 = box.bounds
    corners, axis = np.array(box.exterior.coords), int(x1 - x0 <= y1 - y0)
    found, near = {}, 1e-9 * max(x1 - x0, y1 - y0)
    for name, value in zip((("left", "right"), ("lower", "upper"))[axis], (box.bounds[axis], box.bounds[axis + 2]), strict=True):
        side = corners[np.abs(corners[:, axis] - value) < near]
        found[name] = float(shapely.distance(shapely.LineString(line), shapely.LineString([side.min(axis=0), side.max(axis=0)])))
    return found


def _better(there: Band, scene: Any, grid: Any, number: int) -> dict | None:
    """Columns and rows of a window of the same size that the band crosses, if possible through the middle; None if none fits.

    Of the windows that fulfil all rules of a scene it is the one whose middle is nearest to the band (`off` [m]; half a zone
    counts as zero), and of those the one nearest to the present window. For a polygon: its displacement (`by` [m]).
    """
    window, size = scene.window[number], _cell(scene)
    box = outline(grid, window)
    for off, *corner in _places(there, box, size):
        moved, place = _moved(window, np.array(corner), size, np.array(box.bounds[:2]))
        others = [moved if i == number else other for i, other in enumerate(scene.window)]
        if broken_rules(scene.model_copy(update={"window": others})):
            continue
        if there.level_without(outline(grid, moved)) < there.level:
            return place | {"off": off}
    return None


def _moved(window: Any, corner: np.ndarray, size: np.ndarray, now: np.ndarray) -> tuple[Any, dict[str, Any]]:
    """The window moved so that the lower left corner of its box is in column and row `corner`, not at `now` [m]; its keys."""
    if window.polygon is not None:
        by = corner * size - now
        polygon = [(x, y) for x, y in (np.array(window.polygon) + by).tolist()]
        return window.model_copy(update={"polygon": polygon}), {"by": by.tolist()}
    (c0, c1), (r0, r1) = window.columns, window.rows
    column, row = corner.tolist()
    place = {"columns": [column, column + c1 - c0], "rows": [row, row + r1 - r0]}
    return window.model_copy(update={key: tuple(span) for key, span in place.items()}), place


def _places(there: Band, box: shapely.Polygon, size: np.ndarray) -> list[tuple[float, int, int]]:
    """Possible positions of a box across the band, best first: distance of its middle from the band [m], first column and row."""
    x0, y0, x1, y1 = box.bounds
    line, half = shapely.LineString(there.line), 0.5 * np.array([x1 - x0, y1 - y0])
    corners = np.stack(np.meshgrid(*(np.arange(1, n) for n in np.ptp(there.cells.xy, axis=0) // size)), axis=-1).reshape(-1, 2)
    middles = corners * size + half
    off = shapely.distance(line, shapely.points(middles))
    near = np.flatnonzero(off < np.hypot(*half))
    moved = np.hypot(*(middles - (x0, y0) - half).T)
    order = near[np.lexsort((moved[near], np.maximum(off[near] - 0.5 * size.max(), 0.0)))]
    return [(float(off[i]), int(corners[i, 0]), int(corners[i, 1])) for i in order]


# -- texts ---------------------------------------------------------------------------------------------------------------


def as_text(found: dict) -> list[str]:
    """One sentence about the band and one about each window; problems begin with "warning"."""
    begin = f"{found['stage']}: at {found['gravity_factor']:.2f} g, the grid alone:"
    if not found["line"]:
        much = f"no band of {100 * found['counted']:g} % shear strain connects toe and crest"
        much += f" (strongest path {100 * found['level']:.2g} %)"
        return [f"warning: {begin} {much}: increase gravity or steps of this stage"]
    points = " ".join(f"({x:.1f}, {y:.1f})" for x, y in band_line.even_points(np.array(found["line"]), 6))
    said = [f"{begin} a band of {100 * found['level']:.2g} % shear strain connects toe and crest, through {points} m"]
    return said + [_window_as_text(window) for window in found["windows"]]


def _window_as_text(window: dict) -> str:
    ends = ", ".join(f"{name} side {distance:.1f} m" for name, distance in window["ends"].items())
    around = f"the strongest path around the window reaches {100 * window['level_around']:.2g} % shear strain"
    way = ""
    if window["enters"]:
        way = " at ({:.2f}, {:.2f}) and leaves it at ({:.2f}, {:.2f}) m".format(*window["enters"], *window["leaves"])
    if window["crosses"]:
        return f"the band crosses window {window['name']}: it enters{way}; {around}; distance from the band: {ends}"
    does = f"misses window {window['name']}: it passes {window['distance']:.1f} m from it"
    if way:
        does = f"does not need window {window['name']}: it enters{way}, but also connects toe and crest around it ({around})"
    remedy = "the grid has no room for a window of this size that the band would cross"
    better = window["better"]
    if better:
        where = "the window moved by ({:.4g}, {:.4g}) m".format(*better["by"]) if "by" in better else _spans(better)
        remedy = f"with {where} it would cross {better['off']:.1f} m from the middle"
    return f"warning: the band {does}; {remedy}"


def _spans(better: dict) -> str:
    return f"columns = {better['columns']}, rows = {better['rows']}"
