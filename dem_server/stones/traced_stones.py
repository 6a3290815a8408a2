"""Rules and doubts for files of traced stones; found through `colluvium.rules` and `colluvium.doubts`."""

import numpy as np

from coupler_protocol.geometry import NOWHERE, polygon_area
from coupler_protocol.scene.rules.window_tables import in_all_windows
from dem_server.stones.outlines import OutlineError, overlapping, read_outlines

LISTED = 8  # names of stones a message lists


@in_all_windows
def outlines_can_be_read(scene):
    """Files of stones exist and contain simple polygons, and those of a map do not overlap."""
    for key in ("shapes", "file") if scene.stones is not None else ():
        if getattr(scene.stones, key) is None:
            continue
        try:
            outlines = outlines_of(scene.stones, key, scene.origin)
        except OutlineError as error:
            for why, remedy in error.problems:
                yield ("stones", key), why, remedy
            continue
        for a, b, shared in overlapping(outlines) if key == "file" else ():
            yield ("stones", key), f"{a} and {b} overlap by {shared:.3g} m2", "draw stones side by side, or as one"


def outlines_of(stones, key="file", start=NOWHERE):
    """Outlines of the file named by a key of the [stones] table; those of a map count from `start` (2,) [m] of the scene."""
    return read_outlines(getattr(stones, key), stones.scale, stones.origin, stones.flip_y, start if key == "file" else NOWHERE)


@in_all_windows
def stones_too_small_for_discs(scene):
    """Mapped stones smaller than a disc."""
    if scene.stones is None or scene.stones.file is None:
        return
    smallest = np.pi * scene.discs.radius**2
    try:
        outlines = outlines_of(scene.stones, "file", scene.origin)
    except OutlineError:  # the file is on another machine: outlines_can_be_read says what is wrong with it where it is needed
        return
    small = [outline.name for outline in outlines if polygon_area(outline.corners) < smallest]
    if small:
        names = ", ".join(small[:LISTED]) + (" .." if len(small) > LISTED else "")
        what = f"{len(small)} stones are smaller than a disc, so that they have one disc or none: {names}"
        yield ("stones", "file"), what, "smaller discs, or a map without these stones"
