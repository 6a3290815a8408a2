"""How many zones and discs a scene asks for, estimated from its tables before anything is meshed or packed."""

from collections.abc import Iterator
from math import log, log1p, pi
from typing import Any

import numpy as np

from coupler_protocol.geometry import polygon_area
from coupler_protocol.problems import Finding
from coupler_protocol.scene.of_window import of_windows
from coupler_protocol.scene.tables.grading import grading_of

MOST_ZONES, MOST_DISCS = 4_000_000, 1_000_000
MANY_FRAMES = 100_000
ZONE_FRAME, DISC_FRAME = 100.0, 190.0  # bytes of a zone and of a disc with its contacts in a frame: 8 a number, 4 a whole number
ZONE_STATE, DISC_STATE = 320.0, 400.0  # and in a checkpoint; measured
INSIDE = 100.0  # bytes of a zone more in a checkpoint inside of a stage: watches and loads of the stage
STAY = 2  # checkpoints inside of stages that stay on the disk (coupler_protocol/files/saved_moments.py)
ZONE_BYTES, DISC_BYTES = 1.1e3, 1.5e3  # measured: resident memory of 160,000 zones, and from 4,000 to 16,000 discs


def zones_of(scene: Any) -> float:
    """Zones [-] of the grid, approximately; 0 without a grid."""
    grid = scene.grid
    if grid is None:
        return 0.0
    if grid.kind == "ring":
        return grid.around * _circles(grid)
    columns, rows = (_lines(grid, axis) for axis in range(2))
    return columns * rows * _ground_area(grid) / (grid.length * grid.height)


def _ground_area(grid: Any) -> float:
    """Area [m2] of the ground."""
    if grid.profile is None:
        return grid.length * grid.height
    x, y = np.transpose(grid.profile)
    return abs(float(np.sum(0.5 * (y[1:] + y[:-1]) * np.diff(x))))


def _lines(grid: Any, axis: int) -> float:
    """Zones along an axis; outside of the graded rectangle their sizes grow (fdm_server/mesh/graded_lines.py)."""
    extent, size = (grid.length, grid.height)[axis], grid.zone_size[axis]
    fine = None if grid.graded is None else (grid.graded.x, grid.graded.y)[axis]
    if fine is None:
        return max(extent / size, 1.0)
    first, last = max(fine[0], 0.0), min(fine[1], extent)
    growth = grid.graded.ratio - 1.0
    outside = sum(log1p(growth * max(far, 0.0) / size) / log(grid.graded.ratio) for far in (first, extent - last))
    return max((last - first) / size, 0.0) + outside


def _circles(grid: Any) -> float:
    """Rows of zones of a ring (fdm_server/mesh/hole_ring.py)."""
    angle = {"full": 2.0, "half": 1.0, "quarter": 0.5}[grid.part] * pi / grid.around
    if grid.growth is None:
        return log(grid.outer / grid.inner) / angle
    depth = (grid.outer - grid.inner) / (grid.inner * angle)
    return depth if grid.growth == 1.0 else log1p(depth * (grid.growth - 1.0)) / log(grid.growth)


def all_discs_of(scene: Any) -> float:
    """Discs [-] of all windows, as `discs_of` estimates them."""
    return sum(discs_of(own, window) for window, own in of_windows(scene))


def discs_of(scene: Any, window: Any) -> float:
    """Discs [-] of a window that is packed, approximately; 0 where they come from a file. scene: that of the window."""
    if scene.discs is None or scene.discs.file is not None:
        return 0.0
    if window.polygon is not None:
        area = abs(polygon_area(np.array(window.polygon)))
    elif scene.grid is None or scene.grid.zone_size is None or window.columns is None or window.rows is None:
        return 0.0
    else:
        counts = [last - first + 1 for first, last in (window.columns, window.rows)]
        area = float(np.prod(counts) * np.prod(scene.grid.zone_size))
    return (1.0 - scene.discs.porosity) * area / (0.25 * pi * grading_of(scene.discs).moment(2))


def fewer_than_memory_holds(scene: Any) -> Iterator[Finding]:
    """Refusals: more zones or discs than MOST_ZONES, MOST_DISCS."""
    zones = zones_of(scene)
    if zones > MOST_ZONES:
        what = f"the grid would have about {zones:.3g} zones, {_memory(zones * ZONE_BYTES)} of memory: at most {MOST_ZONES:,}"
        if scene.grid.kind == "ring":
            yield ("grid", "around"), what, f"use around = {int(scene.grid.around * (MOST_ZONES / zones) ** 0.5)} or less"
        else:
            factor = (zones / MOST_ZONES) ** 0.5
            size = " x ".join(f"{_up(factor * d):.2g}" for d in dict.fromkeys(scene.grid.zone_size))
            yield ("grid", "zone_size"), what, f"use zones of at least {size} m; graded makes them large far from the slope"
    for i, (window, own) in enumerate(of_windows(scene)):
        discs = discs_of(own, window)
        if discs > MOST_DISCS:
            what = f"window {window.name!r} would have about {discs:.3g} discs, {_memory(discs * DISC_BYTES)} of memory: "
            remedy = f"use a radius of at least {_up(own.discs.radius * (discs / MOST_DISCS) ** 0.5):.2g} m, or a smaller window"
            yield ("window", i), f"{what}at most {MOST_DISCS:,}", remedy


def meshes_of_a_search_fit(scene: Any) -> Iterator[Finding]:
    """Refusals: meshes of the table [fos] with more than MOST_ZONES."""
    if scene.grid is None or scene.grid.kind == "ring":
        return
    for k, size in enumerate(scene.fos.zone_sizes or ()):
        zones = zones_of(scene) * (scene.grid.zone_size[0] / size) ** 2
        if zones > MOST_ZONES:
            what = (
                f"a mesh with zones of {size:g} m would have about {zones:.3g} zones, {_memory(zones * ZONE_BYTES)} of memory: "
            )
            remedy = f"use sizes of at least {_up(size * (zones / MOST_ZONES) ** 0.5):.2g} m"
            yield ("fos", "zone_sizes", k), f"{what}at most {MOST_ZONES:,}", remedy


def frames_of(scene: Any) -> int:
    """Largest number of frames that stages with `until.steps` record; stages that only rest or time ends are left out."""
    steps = [stage.until.steps for stage in scene.stage if stage.until is not None and stage.until.steps is not None]
    return sum(count // scene.record.every + 1 for count in steps)


def files_of(scene: Any) -> float:
    """Size [MB] of the frames of `frames_of` and of all checkpoints that stay, before compression."""
    zones, discs = zones_of(scene), all_discs_of(scene)
    frames = frames_of(scene) * (zones * ZONE_FRAME + discs * DISC_FRAME)
    return (frames + len(scene.stage) * (zones * ZONE_STATE + discs * DISC_STATE)) / 1e6 + STAY * checkpoint_of(scene)


def checkpoint_of(scene: Any) -> float:
    """Size [MB] of the checkpoints of all sides inside of a stage, on the disk and in memory; 0 if there are none."""
    if not scene.record.checkpoint and scene.record.checkpoint_steps is None:
        return 0.0
    discs = all_discs_of(scene)
    return (zones_of(scene) * (ZONE_STATE + INSIDE) + discs * DISC_STATE) / 1e6


def many_frames(scene: Any) -> Iterator[Finding]:
    """Doubts: more frames than anybody looks at."""
    frames = frames_of(scene)
    if frames > MANY_FRAMES:
        what = f"the stages would record up to {frames:,} frames, about {_memory(1e6 * files_of(scene))}"
        yield ("record", "every"), what, f"use record.every of {scene.record.every * frames // 1000} or so"


def _up(value: float) -> float:
    """A size rounded up to two digits."""
    power = 10.0 ** (np.floor(np.log10(value)) - 1)
    return float(np.ceil(value / power) * power)


def _memory(size: float) -> str:
    return f"{size / 1e9:.3g} GB" if size >= 1e9 else f"{size / 1e6:.3g} MB"


def memory_of(scene: Any) -> dict[str, float]:
    """Memory [MB] that the zones and the discs of a scene take, approximately: {"grid", "discs"}, beside 0.2 GB a process."""
    discs = all_discs_of(scene)
    return {"grid": zones_of(scene) * ZONE_BYTES / 1e6, "discs": discs * DISC_BYTES / 1e6}
