"""Failure of a slope, and whether its band crosses the window, by a reproducible rule for the recorded frames.

The *level* of a frame is the highest shear strain L such that cells strained by at least L connect the toe (ground surface in the
lowest quarter of the slope's height) with the crest (level ground on top); coupler_protocol.criteria.shear_band has the rule. The
slope has failed from the first frame whose level reaches FAILED. The band crosses the windows if the level is lower without their
bins; else it passes around them.

Strains count from the end of the stage `equilibrium`.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from colluvium.results import window_fields
from colluvium.results.run import Run
from coupler_protocol.criteria import shear_band as band
from coupler_protocol.criteria import strain_bins
from coupler_protocol.criteria.shear_band import Cells, Surface

FAILED = band.COUNTED


class Level(NamedTuple):
    """Highest shear strain that connects toe and crest in one frame, and the same around the windows."""

    frame: int
    gravity_factor: float
    step: int
    through: float
    around: float

    @property
    def crosses(self) -> bool:
        """Whether the band needs the window."""
        return self.through > self.around


def levels(run: Run) -> list[Level]:
    """Level of every frame of the stages in which gravity grows until the slope fails."""
    return list(_in_order(run))


def levels_to_failure(run: Run, threshold: float = FAILED) -> list[Level]:
    """`levels` up to the first that counts as failed; later frames are not read."""
    found = []
    for one in _in_order(run):
        found.append(one)
        if failure([one], threshold):
            break
    return found


def _in_order(run: Run) -> Iterator[Level]:
    """Yields `levels`."""
    stages, surface = run.stages_where(overloads=True), ground(run)
    for number, frame in enumerate(run.frames):
        if frame.stage in stages and run.has(number, 0):
            yield level(run, number, surface)


def failure(found: list[Level], threshold: float = FAILED) -> Level | None:
    """First level that counts as failed, or None."""
    return next((one for one in found if one.through >= threshold), None)


def summary(run: Run, threshold: float = FAILED) -> dict | None:
    """Result of the rule for run.json and the closing table; None without frames of an overload."""
    found = levels_to_failure(run, threshold)
    if not found:
        return None
    failed = failure(found, threshold)
    shown = failed or found[-1]
    before = found[found.index(failed) - 1] if failed and failed is not found[0] else None
    return {
        "threshold": threshold,
        "failed_at": failed.gravity_factor if failed else None,
        "not_failed_at": before.gravity_factor if failed and before else None if failed else shown.gravity_factor,
        "step": shown.step,
        "level_through": shown.through,
        "level_around": shown.around,
        "crosses_window": shown.crosses,
    }


def as_text(found: dict) -> str:
    """Text of one or two sentences about the result of `summary`."""
    level = f"strongest path {100 * found['level_through']:.2g} %, around the window {100 * found['level_around']:.2g} %"
    if found["failed_at"] is None:
        band = f"no band of {100 * found['threshold']:g} % shear strain"
        return f"not failed up to {found['not_failed_at']:.2f} g: {band} connects toe and crest ({level})"
    since = f" (not at {found['not_failed_at']:.2f} g)" if found["not_failed_at"] is not None else ""
    way = "through the window" if found["crosses_window"] else "around the window"
    return (
        f"failed at {found['failed_at']:.2f} g{since}: a band of {100 * found['threshold']:g} % shear strain "
        f"connects toe and crest {way} ({level})"
    )


def ground(run: Run) -> Surface:
    """Toe and crest from the first frame, whose grid has no hole yet."""
    return band.ground(run.gridpoints(0).xy, run.zones(0).corners)


def level(run: Run, frame: int, surface: Surface) -> Level:
    """Level of one frame."""
    found, info = cells(run, frame), run.frames[frame]
    through, around = band.levels(found, surface, None, found.rank > 0)
    return Level(frame, info.gravity_factor, info.step, through, around)


def cells(run: Run, frame: int) -> Cells:
    """Zones and bins of one frame."""
    zones, xy = run.zones(frame), run.gridpoints(frame).xy
    ranks = [rank for rank in run.windows if run.has(frame, rank)]
    length = window_fields.zone_length(xy, zones.corners) if ranks else 0.0
    windows = []
    for rank in ranks:
        discs = run.discs(frame, rank)
        bins = strain_bins.bins_over(window_fields.outline_around(run, discs, rank), length)
        inside = strain_bins.shear(window_fields.starting_places(discs), discs.displacement, bins)
        use = bins.used & np.isfinite(inside)
        windows.append((rank, bins.middles[use], inside[use]))
    return band.cells(xy, zones.corners, zones.shear_strain, windows)
