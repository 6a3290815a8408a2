"""What the ground feels of a window: displacements of its crest and of the rim, and the mean stress inside.

    settlement   -u_y of the crest, the highest gridpoint at the end of the face
    rim          sqrt(sum |u - u_alone|^2 / sum |u_alone|^2) over the gridpoints of the rim
    stress       mean over the windows' area: of zones by their area, of discs Eq (1) of colluvium/results/averages.py
    strain       mean over the windows' area, (1/A) sum sym(u n) over the segments of the rim

Displacements count from the level under 1 g. The moduli of the windows in the slope are those of the changes from 1 g,

    K2 = (xx + yy)/2 / (exx + eyy),    G = (xx - yy)/2 / (exx - eyy)                      (1)

which gives those of the zones exactly where they are elastic.
"""

from typing import Any, NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy.spatial import cKDTree

import colluvium
from colluvium.forecast.packing_moduli import Estimate, solid_of_plane
from coupler_protocol.geometry import polygon_area
from fdm_server.mesh.grid import areas, build_grid
from fdm_server.mesh.window_zones import rim_of, window_zones
from felt.levels import Course, Level

Array = NDArray[np.float64]
NEAR = 1e-6  # [m] from the place of a gridpoint


class Places(NamedTuple):
    """Where a scene is measured: its crest (2,) and the rim (K, 2) of each window, before any displacement [m]."""

    crest: Array
    rims: list[Array]


class Reading(NamedTuple):
    """Displacements of the crest (2,) and of all rims (K, 2) [m], mean stress xx, yy, xy (3,) [Pa] and strain xx, yy (2,) [-]."""

    crest: Array
    rim: Array
    stress: Array
    strain: Array


def places_of(scene: Any) -> Places:
    """Crest and rims of a coupled scene."""
    grid = build_grid(scene)
    return Places(crest_of(grid.xy), [grid.xy[rim_of(grid, window_zones(grid, window))] for window in scene.window])


def crest_of(xy: Array) -> Array:
    """The highest gridpoint (2,), of several that at the end towards the lower side of the ground."""
    top = xy[np.isclose(xy[:, 1], xy[:, 1].max())]
    left, right = (xy[np.isclose(xy[:, 0], x), 1].max() for x in (xy[:, 0].min(), xy[:, 0].max()))
    return top[top[:, 0].argmin() if left <= right else top[:, 0].argmax()]


def read(level: Level, places: Places) -> Reading:
    """The last frame of a level, of a run with or without discs in the windows."""
    with colluvium.open_run(level.folder) as run:
        frame = run.last_frame(level.stage)
        points = run.gridpoints(frame)
        moved = points.displacement
        rims = [index_of(points.xy, rim) for rim in places.rims]
        shapes = [rim + moved[own] for rim, own in zip(places.rims, rims, strict=True)]
        if run.windows:
            means = [run.average_stress(frame, shape, rank) for rank, shape in zip(run.windows, shapes, strict=True)]
        else:
            zones = run.zones(frame)
            size = areas(points.xy, zones.corners)
            means = [mean_of_zones(zones, size, rim) for rim in places.rims]
        weights = [polygon_area(shape) for shape in shapes]
        crest = moved[index_of(points.xy, places.crest[None, :])[0]]
        strains = [mean_strain(rim, moved[own]) for rim, own in zip(places.rims, rims, strict=True)]
        stress, strain = (np.average(values, axis=0, weights=weights) for values in (means, strains))
        return Reading(crest, moved[np.concatenate(rims)], stress, strain)


def index_of(xy: Array, wanted: Array) -> NDArray[np.intp]:
    """Rows (K,) of the gridpoints at the places `wanted` (K, 2); raises ValueError if one has none."""
    distance, index = cKDTree(xy).query(wanted)
    if (distance > NEAR).any():
        x, y = wanted[distance.argmax()]
        raise ValueError(f"the run has no gridpoint at ({x:g}, {y:g}) m: it is a run of another mesh")
    return index


def mean_of_zones(zones: Any, size: Array, rim: Array) -> Array:
    """Mean stress xx, yy, xy (3,) [Pa] of the zones with their centre in a polygon, by their areas."""
    inside = shapely.contains_xy(shapely.Polygon(rim), zones.xy[:, 0], zones.xy[:, 1])
    return np.average(zones.stress[inside][:, [0, 1, 3]], axis=0, weights=size[inside])


def mean_strain(rim: Array, moved: Array) -> Array:
    """Mean strain xx, yy (2,) [-] inside a rim (K, 2) whose gridpoints moved by `moved` (K, 2)."""
    x, y = (np.roll(rim, -1, axis=0) - rim).T
    u, v = (0.5 * (moved + np.roll(moved, -1, axis=0))).T
    return np.array([u @ y, -v @ x]) / polygon_area(rim)


def solid_between(first: Reading, last: Reading) -> dict[str, float]:
    """Moduli [Pa] of the windows between two levels, Eq (1), and E and nu in three dimensions, in plane strain."""
    (xx, yy, _), (exx, eyy) = last.stress - first.stress, last.strain - first.strain
    found = Estimate(0.5 * (xx + yy) / (exx + eyy), 0.5 * (xx - yy) / (exx - eyy), 0.0, 0.0)
    plane = (found.bulk - found.shear) / (found.bulk + found.shear)
    young, poisson = solid_of_plane(found.young_plane, plane)
    return {"K2": float(found.bulk), "G": float(found.shear), "E": float(young), "nu": float(poisson)}


def compare(alone: Course, coupled: Course, places: Places, gravity: float) -> dict[str, float]:
    """Differences of a coupled run from the continuum alone, both at rest under a gravity [g].

    crest: of the settlements from 1 g, over that alone; rim: as above; xx, yy: of the mean stresses, each over its own alone;
    xy: over the mean yy alone.
    """
    bases, ends = ([read(course.level(g), places) for course in (alone, coupled)] for g in (1.0, gravity))
    crests = [float(base.crest[1] - end.crest[1]) for base, end in zip(bases, ends, strict=True)]
    rims = [end.rim - base.rim for base, end in zip(bases, ends, strict=True)]
    own, other = (end.stress for end in ends)
    over = own[[0, 1, 1]]
    return {
        "crest_alone": crests[0],
        "crest_coupled": crests[1],
        "crest": crests[1] / crests[0] - 1.0,
        "rim": float(np.sqrt(((rims[1] - rims[0]) ** 2).sum() / (rims[0] ** 2).sum())),
        **{f"alone_{name}": float(value) for name, value in zip(("xx", "yy", "xy"), own, strict=True)},
        **{name: float(value) for name, value in zip(("xx", "yy", "xy"), (other - own) / over, strict=True)},
        **solid_between(bases[1], ends[1]),
    }
