"""A net of quadrilaterals whose columns run along the faces of a slope: no zone is cut, and rows are level.

Row by row from the top, the gridpoints of a row are those of the row above, moved in proportion between the ends of the ground at
this height. So columns are inclined like the face near it and vertical at the far side. Columns begin at level parts of the
ground. The factor of safety is too high by half as much as with triangles on the face (docs/accuracy.md).
"""

from itertools import pairwise

import numpy as np

from fdm_server.mesh.diagonal_net import check_extent
from fdm_server.mesh.fitted_net import aspects, sides_of
from fdm_server.mesh.graded_lines import net_lines

WORST = 8.0  # largest aspect of a zone (fdm_server/mesh/fitted_net.py)


def along_face_mesh(g, levels=()):
    """Gridpoints xy (N,2) [m], zones (Z,4), column and row (Z,) of the table [grid]; levels [m]: heights that zones follow.

    Raises ValueError for a ground surface that falls and rises again, whose top is a point, or that is too shallow.
    """
    profile = np.asarray(g.profile, dtype=np.float64)
    check_extent(profile, g, g.zone_size)
    profile[[0, -1], 0] = 0.0, g.length
    left, right = _sides(profile)
    y = net_lines(left[-1, 1], g.zone_size[1], [*left[:, 1], *right[:, 1], *levels])
    lines, begins = _lines(left, right, y, g.zone_size[0])
    mesh = _numbered(lines, begins, y)
    worst = aspects(*mesh[:2]).max()
    if worst > WORST:
        why = f"columns would lean too much, zones like rectangles of {sides_of(worst):.3g} to 1 (at most {sides_of(WORST):.2g})"
        raise ValueError(f'{why}: use fit = "profile", or zones that are less high than wide')
    return mesh


def _sides(profile):
    """Points (n,2) of the ground surface from the bottom to its top, on the left and on the right."""
    if np.any(np.diff(profile[:, 0]) < 0.0):
        raise ValueError("profile turns back in x: overhangs cannot be meshed")
    top = profile[:, 1].max()
    highest = np.flatnonzero(profile[:, 1] >= top * (1.0 - 1e-9))
    left, right = profile[: highest[0] + 1], profile[highest[-1] :][::-1]
    rises = np.all(np.diff(left[:, 1]) >= 0.0) and np.all(np.diff(right[:, 1]) >= 0.0)
    if not rises or np.any(profile[highest[0] : highest[-1], 1] < top * (1.0 - 1e-9)):
        raise ValueError('fit = "face" needs a ground surface that rises, stays level and falls: use fit = "profile"')
    if right[-1, 0] - left[-1, 0] <= 0.0:
        raise ValueError('the top of the ground is a point, where columns of fit = "face" cannot end: use fit = "profile"')
    return left, right


def _ends(side, y, outward):
    """x of the end of the ground at height y: end of the face above, and beginning of the face below."""
    level = side[np.abs(side[:, 1] - y) < 1e-9 * side[-1, 1], 0]
    if len(level):
        return (level.max(), level.min()) if outward < 0 else (level.min(), level.max())
    x = side[0, 0] if y < side[0, 1] else np.interp(y, side[:, 1], side[:, 0])
    return x, x


def _lines(left, right, y, size):
    """x of the gridpoints of every line from the bottom up (list of arrays), and the column in which each line begins."""
    lines, begins, x, begin = [], [], None, 0
    for height in y[::-1]:
        (inner_left, outer_left), (inner_right, outer_right) = _ends(left, height, -1), _ends(right, height, 1)
        if x is None:
            foot = next((h for h in y[-2::-1] if _ends(left, h, -1)[0] > _ends(left, h, -1)[1] or
                         _ends(right, h, 1)[0] < _ends(right, h, 1)[1]), y[0])  # fmt: skip
            width = 0.5 * (outer_right - outer_left + _ends(right, foot, 1)[0] - _ends(left, foot, -1)[0])
            x = np.linspace(outer_left, outer_right, max(1, round(width / size)) + 1)
        else:
            x = inner_left + (x - x[0]) * ((inner_right - inner_left) / (x[-1] - x[0]))
            before, after = _level(outer_left, inner_left, size)[:-1], _level(inner_right, outer_right, size)[1:]
            begin -= len(before)
            x = np.concatenate([before, x, after])
        lines.append(x)
        begins.append(begin)
    return lines[::-1], np.array(begins[::-1]) - begin


def _level(first, last, size):
    """Gridpoints of a level part from first to last, both included."""
    count = max(1, round((last - first) / size)) if last > first else 0
    return np.linspace(first, last, count + 1)


def _numbered(lines, begins, y):
    """Gridpoints and zones of the lines from the bottom up; the columns between two lines are those of the upper one."""
    start = np.concatenate([[0], np.cumsum([len(x) for x in lines])])
    xy = np.column_stack([np.concatenate(lines), np.repeat(y, [len(x) for x in lines])])
    zones, column, row = [], [], []
    for j, (below, above) in enumerate(pairwise(range(len(lines)))):
        columns = begins[above] + np.arange(len(lines[above]) - 1)
        a, d = start[below] + columns - begins[below], start[above] + columns - begins[above]
        zones.append(np.column_stack([a, a + 1, d + 1, d]))
        column.append(columns)
        row.append(np.full(len(columns), j))
    return xy, np.concatenate(zones).astype(np.int64), np.concatenate(column), np.concatenate(row)
