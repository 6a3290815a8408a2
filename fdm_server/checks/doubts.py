"""Doubts about scenes that can be computed, with remedies; found through `colluvium.doubts`, shown by `colluvium check`."""

from itertools import combinations

import numpy as np
import shapely

from coupler_protocol.geometry import spot
from coupler_protocol.scene.of_window import of_window
from coupler_protocol.scene.stage_kinds import of
from coupler_protocol.scene.tables.grading import grading_of
from fdm_server.checks.materials import doubts_of_materials
from fdm_server.checks.motions import doubts_of_motions
from fdm_server.checks.places import doubts_of_places
from fdm_server.effects.elastic import poisson_ratio
from fdm_server.ground.excavation import all_held
from fdm_server.mesh.grid import build_grid, centroids
from fdm_server.mesh.grid_sides import fixed_components
from fdm_server.mesh.window_zones import window_rim, window_zones

POISSON = 0.49  # above: slow
ASPECT = 5.0  # longest over shortest side of a zone, above: slow and inexact


def doubts(scene):
    """Yields all doubts about the continuum's side: (path, what, remedy); none without a grid."""
    if scene.grid is None:
        return []
    grid = build_grid(scene)
    of_grid = [*doubts_of_materials(scene, grid), *doubts_of_places(scene, grid)]
    of_grid += [*_shapes(grid), *_supports(scene, grid), *_rims(scene, grid), *doubts_of_motions(scene, grid)]
    return [*_stiffness(scene), *_overlaps(scene), *of_grid, *_restless(scene)]


def _stiffness(scene):
    for i, m in enumerate(scene.material):
        nu = poisson_ratio(m.elastic)
        if nu > POISSON or nu < 0.0:
            what = f"material {m.name!r} has Poisson's ratio {nu:.4g}" + (
                ": the stages need many more steps to rest" if nu > POISSON else ""
            )
            most, least = (f"{m.elastic.shear * (2 * (1 + v)) / (3 * (1 - 2 * v)):.4g}" for v in (POISSON, 0.0))
            remedy = f"with this shear modulus, a bulk modulus of {least} .. {most} Pa gives 0 .. {POISSON}"
            yield ("material", i, "elastic"), what, remedy


def _overlaps(scene):
    regions = [(i, m.name, shapely.Polygon(m.region)) for i, m in enumerate(scene.material) if m.region]
    for (_, first, a), (i, last, b) in combinations(regions, 2):
        area = a.intersection(b).area
        if area > 1e-9 * min(a.area, b.area):
            what = f"the regions of {first!r} and {last!r} overlap by {area:.4g} m2, where the later one, {last!r}, applies"
            yield ("material", i, "region"), what, "let regions only touch, unless this is intended"


def _shapes(grid):
    corners = grid.xy[grid.zones]
    side = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    shortest = np.where(side > 0.0, side, np.inf).min(axis=1)
    aspect = side.max(axis=1) / shortest
    bad = np.flatnonzero(aspect > ASPECT)
    if len(bad):
        worst = bad[aspect[bad].argmax()]
        worst = f"one at {spot(centroids(grid.xy, grid.zones[[worst]])[0], grid.origin)} {aspect[worst]:.3g} times"
        what = f"{len(bad)} zones are more than {ASPECT:g} times as long as wide, {worst}"
        yield ("grid", "zone_size"), what + ": inaccurate in bending, and more steps to rest", "use more similar zone sizes"


def _supports(scene, grid):
    loose = len(grid.xy) - len(np.unique(grid.zones))
    if loose:
        yield ("grid",), f"{loose} gridpoints belong to no zone: they are fixed", "remove them from the mesh"
    if not all_held(grid.zones, fixed_components(grid, scene.boundary)):
        what = "the grid has no support in x or in y: it falls or drifts as a whole"
        yield ("boundary",), what, 'add [[boundary]] tables, for example on = "bottom", fix = "xy"'


def _rims(scene, grid):
    """Yields doubts about discs larger than zones: such a disc touches several segments, whose control discs are much smaller."""
    for i, window in enumerate(scene.window):
        if scene.discs is None:
            continue
        rim = window_rim(grid, window_zones(grid, window))
        xy = grid.xy[rim.nodes]
        side = (np.roll(xy, -1, axis=0) - xy)[: len(xy) - (rim.surface is not None)]
        length, largest = np.hypot(*side.T), 2.0 * grading_of(of_window(scene, i + 1).discs).largest
        shortest = int(length.argmin())
        if largest > length[shortest] * (1.0 + 1e-9):
            what = f"discs of up to {largest:.4g} m are larger than zones on the rim of {window.name!r}: one side of it, at "
            what += f"{spot(xy[shortest] + 0.5 * side[shortest], grid.origin)}, is {length[shortest]:.4g} m long"
            yield ("window", i), what, f"discs of at most {length[shortest]:.4g} m, or larger zones there"


def _restless(scene):
    for i, stage in enumerate(scene.stage):
        damping = scene.damping if stage.damping is None else stage.damping
        undamped = damping is None or damping.local == 0.0
        waits = of(stage).computes and stage.until and stage.until.ratio is not None
        if undamped and waits and not stage.in_real_time:
            what = f"stage {stage.name!r} waits for rest without damping"
            yield ("stage", i, "until", "ratio"), what, "add [damping] local = 0.8, or end the stage by steps"
