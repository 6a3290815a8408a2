"""What must hold between sizes, walls and files of discs and the rest of a scene: one rule a function, as in scene_rules.py."""

import numpy as np

LEAST = 4.0  # largest discs that must fit side by side into the shorter side of a window


def largest_discs_fit(scene):
    """A window is at least four of the largest discs across, where a grading says how large they are."""
    if scene.discs is None or scene.discs.grading is None:
        return
    for i, window in enumerate(scene.window):
        across, largest = across_of(scene, window), scene.discs.grading.largest
        if across < 2.0 * LEAST * largest:
            why = f"window {window.name!r} is {across:g} m across: too small for its largest discs, of {2.0 * largest:g} m"
            yield ("window", i), why, f"largest diameter at most {across / LEAST:.3g} m, or a larger window"


def across_of(scene, window):
    """Shorter side of the rectangle round a window [m]; infinite where it is not said."""
    if window.polygon is not None:
        return float(np.ptp(np.array(window.polygon), axis=0).min())
    if scene.grid is None or not scene.grid.zone_size or window.columns is None or window.rows is None:
        return np.inf
    return min(
        (last - first + 1) * d for (first, last), d in zip((window.columns, window.rows), scene.grid.zone_size, strict=True)
    )


DISC_RULES = (largest_discs_fit,)
