"""Young's modulus of a window, estimated from its contacts without a run, beside that of the zones that it replaces.

Discs of a packing do not move as its mean strain says: contacts give way where they are weak, above all by sliding and turning
where their shear spring is soft. The modulus of windows is therefore below that of colluvium/forecast/packing_moduli.py, by

    E / E_estimate = min(0.9, 1.45 (ks / kn)^(1/4))                             (1)

within 20 % in windows of slopes and in biaxial tests of samples with as many contacts (docs/window.md, *Estimate of check*). All
moduli are those of three dimensions in plane strain.
"""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
import shapely

from colluvium.forecast.packing_moduli import Solid, estimate, solid_of_plane
from coupler_protocol.geometry import polygon_area
from coupler_protocol.scene.of_window import of_windows as each_window
from coupler_protocol.scene.rules.units import as_written

FACTOR = 2.0  # between window and zones from which on a window is doubted
LOOSE, POWER, MOST = 1.45, 0.25, 0.9  # of Eq (1)
SOFTEST = 0.01  # ks / kn, below which Eq (1) takes no less


class Stiffness(NamedTuple):
    """Young's moduli [Pa] of the window `name`, estimated, and of the zones that it replaces."""

    name: str
    window: float
    zones: float


def of_windows(scene: Any, grid: Any) -> Iterator[Stiffness]:
    """Yields the stiffness of each window whose discs have springs; `scene` in local coordinates."""
    from fdm_server.effects.elastic import young_modulus
    from fdm_server.mesh.grid import areas
    from fdm_server.mesh.window_zones import window_rim, window_zones

    if scene.discs is None:
        return
    young = np.array([young_modulus(material.elastic) for material in scene.material])
    size = areas(grid.xy, grid.zones)
    for window, own in each_window(scene):
        if own.discs.soil is None or own.discs.soil.spring is None:
            continue
        mask = window_zones(grid, window)
        zones = float(np.average(young[grid.material[mask]], weights=size[mask]))
        yield Stiffness(window.name, solid(own.discs, content(own, grid.xy[window_rim(grid, mask).outline])).young, zones)


def solid(discs: Any, stones: float) -> Solid:
    """Moduli of a packing of the table `discs` with a content of stones, Eq (1)."""
    found = estimate(discs, stones)
    plane = (found.bulk - found.shear) / (found.bulk + found.shear)
    young, poisson = solid_of_plane(found.young_plane, plane)
    springs = max(2.0 * found.shear / found.bulk - 1.0, SOFTEST)  # ks / kn of Eqs (1) of packing_moduli
    return Solid(min(MOST, LOOSE * springs**POWER) * young, poisson)


def content(scene: Any, rim: Any) -> float:
    """Content of stones [-] of the window with this rim (K, 2): that of the scene, or that of its map."""
    if scene.stones is None:
        return 0.0
    if scene.stones.content is not None:
        return float(scene.stones.content)
    from dem_server.stones.outlines import OutlineError
    from dem_server.stones.traced_stones import outlines_of

    try:
        outlines = outlines_of(scene.stones, "file", scene.origin)
    except OutlineError:  # the file is on another machine
        return 0.0
    region = shapely.Polygon(rim)
    inside = sum(shapely.Polygon(outline.corners).intersection(region).area for outline in outlines)
    return min(inside / float(polygon_area(rim)), 0.95)


def doubts(scene: Any, found: list[Stiffness]) -> Iterator[dict[str, str]]:
    """A doubt, as a row of `listed_doubts`, for each window that is softer or stiffer than its zones by more than FACTOR."""
    windows = {window.name: (number, own) for number, (window, own) in enumerate(each_window(scene))}
    for one in found:
        times = one.zones / one.window
        if 1.0 / FACTOR <= times <= FACTOR:
            continue
        word = f"{times:.2g} times softer" if times > 1.0 else f"{1.0 / times:.2g} times stiffer"
        what = (
            f"window {one.name!r} is {word} than the zones it replaces: its contacts give E {as_written(one.window)} Pa, "
            f"the zones have E {as_written(one.zones)} Pa"
        )
        number, own = windows[one.name]
        springs = ", ".join(_springs(own.discs, times))
        remedy = f"fit the discs with colluvium calibrate, or multiply all springs by {times:.3g}: {springs}"
        yield {"key": f"window[{number}]", "what": what, "remedy": remedy}


def _springs(discs: Any, times: float) -> Iterator[str]:
    """Yields the springs of materials and pairs, multiplied, as a scene has them."""
    holders = [(f"discs.{name}", getattr(discs, name)) for name in ("soil", "stone")]
    holders += [(f"discs.pair {' and '.join(pair.between)}", pair) for pair in discs.pair]
    for name, holder in holders:
        if holder is not None and holder.spring is not None:
            normal, shear = (as_written(times * value) for value in (holder.spring.normal, holder.spring.shear))
            yield f"{name}.spring = {{ normal = {normal}, shear = {shear} }}"
