"""Walls as one surface: where walls meet, a disc has the contacts that it would have with a surface drawn in one piece.

With c_w the point of wall w nearest to the disc's centre x, d_w = |c_w - x|, P the point nearest to x that two walls share, and

    u_w = r - d_w,   u_P = r - |P - x|                                           (1)

the overlaps with the walls and with P (zero where negative), the normal springs of the disc store

    U = kn/2 (sum u_w^2 - sum u_P^2)                                             (2)

over walls and shared points: what both walls of a pair contain counts once. Eq (2) and its force are continuous wherever the
disc is. (In acute corners, where only overlaps of more than 0.29 r reach P, u_P counts as zero, which is continuous as well.)
Along a straight joint, at a T, and around an edge (more than 180 degrees on the disc's side), the nearest point of the farther
wall is P itself or lies behind the nearer wall: the nearer wall has the only contact. In a corner (less than 180 degrees on the
disc's side) P lies between both nearest points, P - x = |P - x| (a n_v + b n_w), and each contact keeps the share

    q_v = 1 - a u_P / u_v,   q_w = 1 - b u_P / u_w                                (3)

of its springs and dashpots: all of them where the disc does not reach P, so that it has two contacts; together those of one
contact where the corner is so flat that the overlap of the disc contains it. Shear force and rolling moment of contacts with one
surface are shared in proportion to the normal forces. Where the contact moves over a joint or an edge, its history moves with it
in the same step.

Nothing of this is kept from step to step: walls that move are one surface where and as long as they touch each other.
"""

from typing import NamedTuple

import numpy as np

from coupler_protocol.compiled.jit import jit
from dem_server.model import RADIUS, X, Y

SAME = 1e-6  # of the disc's radius: points of walls nearer than this to each other are one point
CROSSED = 1.01  # of the disc's radius: a shared point within this can have been crossed in a step that ended a contact there
LEAST = 1e-9  # smallest share of a contact


class Touching(NamedTuple):
    """Scratch memory for the contacts of one disc, one a place, with walls in rising order.

    wall (W,): number of the wall; heir (W,): place of the contact with which it shares friction, or -1; share (W,): q of Eq (3),
    0 where there is no contact; overlap (W,): r - d_w [m], negative at walls that the disc has left in this step.
    """

    wall: np.ndarray
    heir: np.ndarray
    share: np.ndarray
    overlap: np.ndarray


@jit
def room_for(ends):
    """Allocates scratch memory for the contacts of one disc with the walls `ends` (W, 4)."""
    count = len(ends)
    return Touching(np.empty(count, np.int64), np.empty(count, np.int64), np.empty(count), np.empty(count))


@jit
def nearest(ends, w, x, y):
    """Vector from (x, y) to the nearest point of wall `w`."""
    x0, y0 = ends[w, 0], ends[w, 1]
    ex, ey = ends[w, 2] - x0, ends[w, 3] - y0
    share = min(max(((x - x0) * ex + (y - y0) * ey) / (ex * ex + ey * ey), 0.0), 1.0)
    return x0 + share * ex - x, y0 + share * ey - y


@jit(borrows=True)
def shared_point(ends, v, w, x, y, tolerance):
    """Vector from (x, y) to the nearest point that walls v and w share, and its length: infinite where they share none."""
    px, py, least = 0.0, 0.0, np.inf
    for turn in range(2):
        a, b = (v, w) if turn == 0 else (w, v)
        for end in range(0, 4, 2):
            ex, ey = ends[a, end], ends[a, end + 1]
            gx, gy = nearest(ends, b, ex, ey)
            length = ((ex - x) ** 2 + (ey - y) ** 2) ** 0.5
            if gx * gx + gy * gy <= tolerance * tolerance and length < least:
                px, py, least = ex - x, ey - y, length
    if least < np.inf:
        return px, py, least
    ax, ay = ends[w, 0] - ends[v, 0], ends[w, 1] - ends[v, 1]
    ex, ey = ends[v, 2] - ends[v, 0], ends[v, 3] - ends[v, 1]
    fx, fy = ends[w, 2] - ends[w, 0], ends[w, 3] - ends[w, 1]
    cross = ex * fy - ey * fx
    if cross != 0.0:
        along_v, along_w = (ax * fy - ay * fx) / cross, (ax * ey - ay * ex) / cross
        if 0.0 < along_v < 1.0 and 0.0 < along_w < 1.0:
            px, py = ends[v, 0] + along_v * ex - x, ends[v, 1] + along_v * ey - y
            least = (px * px + py * py) ** 0.5
    return px, py, least


@jit(borrows=True)
def share_out(ends, x, y, r, count, wall, heir, share, overlap):
    """Sets overlaps, shares and heirs of `count` contacts of a disc by Eqs (2) and (3): fields of Touching; `wall` is given.

    Returns sum u_w^2 - sum u_P^2 of Eq (2) minus sum (q u_w)^2 [m2]: exactly 0 without a corner that the disc reaches.
    """
    for t in range(count):
        dx, dy = nearest(ends, wall[t], x, y)
        overlap[t], heir[t] = r - (dx * dx + dy * dy) ** 0.5, -1
        share[t] = 1.0 if overlap[t] > 0.0 else 0.0
    for t in range(1, count):
        for u in range(t):
            cover(ends, x, y, r, t, u, wall, heir, share, overlap)
    common = 0.0
    for t in range(1, count):
        for u in range(t):
            if share[t] > 0.0 and share[u] > 0.0:
                common += blend(ends, x, y, r, t, u, wall, heir, share, overlap)
    rest = 0.0
    if common > 0.0:
        rest = -common
        for t in range(count):
            if share[t] > 0.0:
                rest += overlap[t] ** 2 * (1.0 - share[t] ** 2)
    return rest


@jit(borrows=True)
def cover(ends, x, y, r, t, u, wall, heir, share, overlap):
    """Ends the contact with one of two walls (places t > u) that the other one covers: the nearer, or of lower number."""
    near, far = (t, u) if overlap[t] > overlap[u] else (u, t)
    if not overlap[near] > 0.0:
        return
    px, py, length = shared_point(ends, wall[t], wall[u], x, y, SAME * r)
    if overlap[far] > 0.0:
        covered = length < np.inf and not in_corner(ends, x, y, px, py, wall[t], wall[u], SAME * r)
    else:
        covered = length < CROSSED * r
    if covered:
        share[far], heir[far] = 0.0, near


@jit(borrows=True)
def in_corner(ends, x, y, px, py, v, w, tolerance):
    """Whether the shared point, at (px, py) from (x, y), lies between the nearest points of walls v and w, and is neither."""
    vx, vy = nearest(ends, v, x, y)
    wx, wy = nearest(ends, w, x, y)
    if min((px - vx) ** 2 + (py - vy) ** 2, (px - wx) ** 2 + (py - wy) ** 2) <= tolerance * tolerance:
        return False
    return (px * vy - py * vx) * (px * wy - py * wx) < 0.0


@jit(borrows=True)
def blend(ends, x, y, r, t, u, wall, heir, share, overlap):
    """Reduces the shares of two contacts in an obtuse corner whose point the disc reaches, Eq (3); returns u_P^2 [m2]."""
    px, py, length = shared_point(ends, wall[t], wall[u], x, y, SAME * r)
    tx, ty = nearest(ends, wall[t], x, y)
    ux, uy = nearest(ends, wall[u], x, y)
    if length >= r or tx * ux + ty * uy <= 0.0:
        return 0.0
    along_t, along_u = ((px - tx) ** 2 + (py - ty) ** 2) ** 0.5, ((px - ux) ** 2 + (py - uy) ** 2) ** 0.5
    common = (r - length) * length / (along_t * (r - overlap[u]) + along_u * (r - overlap[t]))
    share[t] = max(share[t] - along_u * common / overlap[t], LEAST)
    share[u] = max(share[u] - along_t * common / overlap[u], LEAST)
    heir[t] = u
    return (r - length) ** 2


@jit(borrows=True)
def hand_on(history, i, count, wall, heir, share, overlap):
    """Divides the history (n, W) of disc i at walls of one surface in proportion to the normal forces."""
    for t in range(count):
        h = heir[t]
        if h < 0:
            continue
        while share[h] == 0.0:  # covered itself: by a nearer wall
            h = heir[h]
        mine, other = share[t] * overlap[t], share[h] * overlap[h]
        total = history[i, wall[t]] + history[i, wall[h]]
        history[i, wall[t]] = total * (mine / (mine + other))
        history[i, wall[h]] = total - history[i, wall[t]]


@jit
def elastic_rest(disc, ends, normal, shear, rolled, kn, ks, touching):
    """Energy [J] of the discs' springs at walls beyond sum Fn^2 / 2 kn + Fs^2 / 2 ks + Mr^2 / 2 kr: that of shared contacts.

    normal, shear, rolled: of Walls; kn, ks (n,) [N/m] of each disc at walls.
    """
    wall, heir, share, overlap = touching
    total = 0.0
    for i in range(len(disc)):
        count = 0
        for w in range(len(ends)):
            if normal[i, w] > 0.0:
                wall[count] = w
                count += 1
        if count < 2:
            continue
        rest = share_out(ends, disc[i, X], disc[i, Y], disc[i, RADIUS], count, wall, heir, share, overlap)
        if rest == 0.0:
            continue
        total += kn[i] * rest
        for t in range(count):
            w = wall[t]
            if ks[i] > 0.0 and share[t] > 0.0:
                more = 1.0 / share[t] - 1.0
                total += more * shear[i, w] ** 2 / ks[i]
                if rolled is not None:
                    total += more * rolled[i, w] ** 2 / (ks[i] * disc[i, RADIUS] ** 2)
    return 0.5 * total


@jit
def mark_once(ends, xy, radius, disc, wall, distance, counts):
    """Clears counts (m,) of walls that only take turns with a nearer one.

    disc, wall, distance (m,): near pairs, sorted by disc, then wall; xy (n, 2), radius (n,): all discs.
    They share a point, and all of the farther wall lies on or behind the line through the nearest point of the nearer one: a
    joint or an edge. In corners both count, however flat they are: the disc may touch both before the next count.
    """
    for p in range(len(disc)):
        q = p - 1
        while q >= 0 and disc[q] == disc[p]:
            near, far = (p, q) if distance[p] < distance[q] else (q, p)
            x, y, tolerance = xy[disc[p], 0], xy[disc[p], 1], SAME * radius[disc[p]]
            _, _, length = shared_point(ends, wall[p], wall[q], x, y, tolerance)
            if length < np.inf:
                nx, ny = nearest(ends, wall[near], x, y)
                behind = True
                for end in range(0, 4, 2):
                    ahead = (ends[wall[far], end] - x) * nx + (ends[wall[far], end + 1] - y) * ny
                    behind &= ahead >= (distance[near] - tolerance) * distance[near]
                if behind:
                    counts[far] = False
            q -= 1
