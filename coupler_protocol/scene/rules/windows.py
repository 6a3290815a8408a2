"""Rules for windows that need only the scene, not its grid: one function each, as in between_tables.py.

Rules that need the zones in a polygon are in fdm_server/checks/grid_can_be_built.py.
"""

from collections.abc import Iterator
from typing import Any

from coupler_protocol.problems import Finding
from coupler_protocol.scene.of_window import of_windows
from coupler_protocol.scene.rules.window_tables import in_all_windows

ACROSS = 8  # discs that a window must be wide


def windows_of_whole_zones(scene: Any) -> Iterator[Finding]:
    """A window gives its zones in exactly one way."""
    for i, w in enumerate(scene.window):
        given = [key for key in ("columns", "rows") if getattr(w, key) is not None]
        if w.polygon is not None:
            if given:
                yield ("window", i), f"the window has a polygon and {' and '.join(given)}", "remove one of them"
            continue
        for key in ("columns", "rows"):
            if given and key not in given:
                yield ("window", i, key), "missing", f"{key} = [first, last] zone, from 0"
        if not given:
            remedy = "columns and rows = [first, last] zone, from 0, or polygon = [[x, y], ..]"
            yield ("window", i), "the window does not say which zones it takes", remedy


def windows_lie_inside(scene: Any) -> Iterator[Finding]:
    """Columns and rows keep at least one zone between themselves and every side of the grid."""
    if not scene.grid.regular:
        return
    columns = round(scene.grid.length / scene.grid.zone_size[0])
    rows = round(scene.grid.height / scene.grid.zone_size[1])
    for i, w in enumerate(scene.window):
        if w.columns is None or w.rows is None:
            continue
        if w.columns[0] < 1 or w.columns[1] > columns - 2:
            yield ("window", i, "columns"), f"{list(w.columns)} reaches a side of the grid", f"stay within 1..{columns - 2}"
        if w.rows[0] < 1 or w.rows[1] > rows - 1:
            yield ("window", i, "rows"), f"{list(w.rows)} reaches a side of the grid", f"stay within 1..{rows - 1}"


def windows_need_discs(scene: Any) -> Iterator[Finding]:
    """Windows are filled with discs."""
    if scene.window and scene.discs is None:
        yield ("window",), "nothing fills the windows", "add a [discs] table"
    if scene.discs is not None and not scene.window:
        yield ("discs",), "the scene has no window for the discs", "add a [[window]] or remove [discs]"


@in_all_windows
def discs_have_springs(scene: Any) -> Iterator[Finding]:
    """Discs have springs."""
    if scene.discs is not None and scene.discs.soil.spring is None:
        yield ("discs", "soil"), "the discs have no stiffness", "add spring = { normal = .., shear = .. }"


def discs_fit_into_windows(scene: Any) -> Iterator[Finding]:
    """A window of equal zones is at least eight discs across; the grid's server checks other zones and polygons."""
    for i, (w, own) in enumerate(of_windows(scene) if scene.discs and scene.grid.regular else []):
        if w.columns is None or w.rows is None:
            continue
        across = (w.columns[1] - w.columns[0] + 1) * scene.grid.zone_size[0]
        up = (w.rows[1] - w.rows[0] + 1) * scene.grid.zone_size[1]
        if 2.0 * ACROSS * own.discs.radius > min(across, up):
            why = f"window {w.name!r} is {across:g} x {up:g} m: too small for discs of radius {own.discs.radius:g} m"
            yield ("window", i), why, f"radius at most {min(across, up) / (2.0 * ACROSS):.3g} m, or a larger window"


WINDOW_RULES = (windows_of_whole_zones, windows_lie_inside, windows_need_discs, discs_have_springs, discs_fit_into_windows)
