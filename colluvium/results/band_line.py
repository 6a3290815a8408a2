"""The line of a band, from toe to crest, and its path through a window.

Of all paths through cells strained by the band's level or more, the line is the one with the smallest integral of ds / strain^2,
so it follows the largest strains. Each point is then moved to the mean of its cell and the cells that share a corner with it,
weighted by the square of their strains.
"""

import numpy as np
import scipy
import shapely

from coupler_protocol.criteria import shear_band


def line_of_band(cells: shear_band.Cells, surface: shear_band.Surface, level: float) -> np.ndarray:
    """Points (p, 2) of the line [m] from toe to crest; cells strained by `level` or more must connect them."""
    count, strong = len(cells.xy), cells.strain >= level
    toe, crest = (found[strong[found]] for found in (shear_band.nearest(cells.xy, points) for points in surface))
    a, b = cells.pairs[strong[cells.pairs].all(axis=1)].T
    length = np.hypot(*(cells.xy[a] - cells.xy[b]).T) * 0.5 * (cells.strain[a] ** -2.0 + cells.strain[b] ** -2.0)
    ways = scipy.sparse.coo_array((length, (a, b)), shape=(count, count)).tocsr()
    far, before, _ = scipy.sparse.csgraph.dijkstra(ways, directed=False, indices=toe, return_predecessors=True, min_only=True)
    way = [int(crest[np.argmin(far[crest])])]
    while before[way[-1]] >= 0:
        way.append(int(before[way[-1]]))
    return _ridge(cells)[way[::-1]]


def _ridge(cells: shear_band.Cells) -> np.ndarray:
    """(n, 2) mean of each cell and its neighbours, weighted by their strains squared."""
    count = len(cells.xy)
    low, high = cells.pairs.T
    near = scipy.sparse.coo_array((np.ones(len(low)), (low, high)), shape=(count, count))
    near = near + near.T + scipy.sparse.eye_array(count)
    weight = cells.strain**2
    total = near @ weight
    mean = near @ (weight[:, None] * cells.xy) / np.where(total > 0.0, total, 1.0)[:, None]
    return np.where(total[:, None] > 0.0, mean, cells.xy)


def crossing(line: np.ndarray, box: shapely.Polygon) -> tuple[tuple[float, float], tuple[float, float]] | None:
    """First and last point [m] of the line (p, 2) in the box; None if it stays outside."""
    whole = shapely.LineString(line)
    points = shapely.get_coordinates(shapely.intersection(whole, box))
    if not len(points):
        return None
    place = shapely.line_locate_point(whole, shapely.points(points))
    first, last = points[np.argmin(place)], points[np.argmax(place)]
    return (float(first[0]), float(first[1])), (float(last[0]), float(last[1]))


def even_points(line: np.ndarray, count: int) -> np.ndarray:
    """(count, 2) points at equal distances along the line [m]."""
    shares = np.linspace(0.0, 1.0, count)
    return shapely.get_coordinates(shapely.line_interpolate_point(shapely.LineString(line), shares, normalized=True))
