"""Lines inside the ground that zones follow: tops of materials that are not level.

A line is a path of gridpoints of the net like the ground surface: these gridpoints move onto the line, and diagonal steps cut
cells into two triangles. At an outcrop the profile gets an additional point. Zones do not follow a line that would make them too
flat; then the material that contains their centre counts.
"""

import numpy as np
import shapely

OUTCROP = 0.75  # distance in zones within which an outcrop moves to a point of the profile


def pieces_below(line, profile, size):
    """Parts [(n,2)] of a line below the profile (P,2), from left to right, and the profile with the points of their outcrops.

    line: points, level beyond its ends; size [m]: of a zone in x and y.
    """
    line = np.asarray(line, dtype=np.float64)
    (x0, x1), y = profile[[0, -1], 0], line[:, 1]
    x = np.concatenate([[x0], line[(line[:, 0] > x0) & (line[:, 0] < x1), 0], [x1]])
    whole = shapely.LineString(np.column_stack([x, np.interp(x, line[:, 0], y)]))
    ground = shapely.Polygon([*profile, (x1, 0.0), (x0, 0.0)])
    found = [
        part[np.argsort(part[:, 0], kind="stable")]
        for part in (shapely.get_coordinates(p) for p in shapely.get_parts(shapely.intersection(whole, ground)))
        if len(part) > 1 and np.ptp(part[:, 0]) > size[0]
    ]
    surface = shapely.LineString(profile)
    for part in found:
        for end in (0, -1):
            if surface.distance(shapely.Point(part[end])) < 1e-9 * (x1 - x0):
                profile = _with_outcrop(profile, part, end, size)
    return found, profile


def _with_outcrop(profile, part, end, size):
    """The profile with a point at the end of a part of a line; the end moves to a point of the profile within OUTCROP."""
    distance = np.abs((profile - part[end]) / np.asarray(size)).max(axis=1)
    nearest = distance.argmin()
    if distance[nearest] < OUTCROP:
        part[end] = profile[nearest]
        return profile
    along = [shapely.LineString(profile).project(shapely.Point(p)) for p in profile]
    here = shapely.LineString(profile).project(shapely.Point(part[end]))
    return np.insert(profile, np.searchsorted(along, here), part[end], axis=0)


def cut_cells(corners, column, row, path):
    """Corners (Z,4), column and row (Z,) after a path (P,2) of columns and rows has cut cells in two by its diagonal steps."""
    (i0, j0), (i1, j1) = path[:-1].T, path[1:].T
    diagonal = (i0 != i1) & (j0 != j1)
    left, low = np.minimum(i0, i1)[diagonal], np.minimum(j0, j1)[diagonal]
    rising = ((i1 - i0) * (j1 - j0))[diagonal] > 0
    steps = {(i, j): up for i, j, up in zip(left.tolist(), low.tolist(), rising.tolist(), strict=True)}
    rows = []
    for (a, b, c, d), i, j in zip(corners.tolist(), column.tolist(), row.tolist(), strict=True):
        up = steps.get((i, j)) if c != d else None
        if up is None:
            rows.append((a, b, c, d, i, j))
        elif up:
            rows += [(a, b, c, c, i, j), (a, c, d, d, i, j)]
        else:
            rows += [(a, b, d, d, i, j), (b, c, d, d, i, j)]
    table = np.array(rows, dtype=np.int64)
    return table[:, :4], table[:, 4].copy(), table[:, 5].copy()
