"""Intrusion of stones: whether two polygons overlap or are closer to each other than a gap.

Polygons overlap if a corner of one is inside the other or if two of their edges cross. Otherwise their distance
is that of a corner of one to an edge of the other. Both are tested in both directions. Source: Study on Failure
Mechanism of Soil-Rock Slope with FDM-DEM Method (2022), figure 6. The paper tests the domain by corners only;
here its edges are tested in the same way, so a domain need not be convex.

Stones are rows: `world` (S, V, 2) corners [m], of which the first `corners[k]` count; `place` (S, 4) centroid,
azimuth, size (diameter of the circle of equal area); `reach` (S,) largest distance of a corner from the
centroid in sizes.
"""

from coupler_protocol.compiled.jit import jit


@jit
def inside(polygon, n, x, y):
    """Whether a point is in a simple polygon: a ray to the right crosses its edges an odd number of times."""
    odd = False
    for i in range(n):
        j = i + 1 if i + 1 < n else 0
        y0, y1 = polygon[i, 1], polygon[j, 1]
        if (y0 > y) != (y1 > y):
            at = polygon[i, 0] + (y - y0) / (y1 - y0) * (polygon[j, 0] - polygon[i, 0])
            odd ^= at > x
    return odd


@jit
def distance2(px, py, ax, ay, bx, by):
    """Squared distance of point p from segment ab."""
    dx, dy = bx - ax, by - ay
    t = min(max(((px - ax) * dx + (py - ay) * dy) / (dx * dx + dy * dy), 0.0), 1.0)
    return (ax + t * dx - px) ** 2 + (ay + t * dy - py) ** 2


@jit
def side(ax, ay, bx, by, px, py):
    """Whether p is to the left of the line from a to b."""
    return (bx - ax) * (py - ay) - (by - ay) * (px - ax) > 0.0


@jit
def edges_near(a, n, b, m, gap):
    """Whether an edge of polygon a (n corners) crosses one of b (m corners) or is closer than `gap` [m]."""
    for i in range(n):
        p0, p1 = a[i, 0], a[i, 1]
        q = i + 1 if i + 1 < n else 0
        q0, q1 = a[q, 0], a[q, 1]
        for j in range(m):
            r0, r1 = b[j, 0], b[j, 1]
            s = j + 1 if j + 1 < m else 0
            s0, s1 = b[s, 0], b[s, 1]
            if side(p0, p1, q0, q1, r0, r1) != side(p0, p1, q0, q1, s0, s1) and side(r0, r1, s0, s1, p0, p1) != side(
                r0, r1, s0, s1, q0, q1
            ):
                return True
            nearest = min(
                distance2(r0, r1, p0, p1, q0, q1),
                distance2(s0, s1, p0, p1, q0, q1),
                distance2(p0, p1, r0, r1, s0, s1),
                distance2(q0, q1, r0, r1, s0, s1),
            )
            if nearest < gap * gap:
                return True
    return False


@jit
def intrudes(a, n, b, m, gap):
    """Whether polygons a and b overlap or are closer than `gap` [m]."""
    return inside(b, m, a[0, 0], a[0, 1]) or inside(a, n, b[0, 0], b[0, 1]) or edges_near(a, n, b, m, gap)


@jit
def fits(k, world, corners, place, reach, there, domain, gap):
    """Whether stone k is in the domain (P, 2) and clear of all other stones that are `there` (S,), by `gap` [m]."""
    here = world[k, : corners[k]]
    n, P = corners[k], len(domain)
    if not inside(domain, P, here[0, 0], here[0, 1]) or edges_near(here, n, domain, P, gap):
        return False
    for j in range(len(corners)):
        if there[j] and j != k:
            far = reach[k] * place[k, 3] + reach[j] * place[j, 3] + gap
            dx, dy = place[j, 0] - place[k, 0], place[j, 1] - place[k, 1]
            if dx * dx + dy * dy < far * far and intrudes(here, n, world[j], corners[j], gap):
                return False
    return True
