"""Clumps: rigid bodies of several discs. A clump has the centroid and the weight of its polygon.

    F = sum f,   M = sum m + (x - X) x f   over its discs                        (1)
    V <- V + F'/m,  X <- X + V,   W <- W + M'/I,  a <- a + W                     (2)
    x = X + R(a) o                                                               (3)

(here for dt = 1) F', M': with weight and damping, as for a disc; o: offset of a disc in the frame of the clump, so that (3)
has no drift. A disc's velocity is its displacement in the step, exactly V + 2 sin(W/2) k x R(a - W/2) o. Contacts between
discs of one clump do not exist. Static masses, over all listed pairs of the clump (dem_server/step/masses.py):

    m = lambda / sf^2,   I = max(sum kn an^2 + ks at^2, lambda A2) / sf^2        (4)

lambda: larger eigenvalue of sum kn n n^T + ks t t^T; an, at: levers of normal and tangent about X; A2: squared
radius of gyration of the polygon. By the Cauchy-Schwarz inequality over the four blocks (translation, rotation
of both bodies) omega^2 <= 4 sf^2, as for discs. Source: Itasca, PFC2D 3.1 Theory, "Clump logic".
"""

import numpy as np

from coupler_protocol.compiled.jit import jit
from dem_server.model import ANGLE, FX, FY, INERTIA, MASS, MOMENT, SPIN, VX, VY, Clumps, X, Y
from dem_server.step.compiled_laws import damped


def make_clumps(body, xy, centroid, gyration):
    """Clumps at rest of the discs `body` (n,) at `xy` (n, 2), with `centroid` (c, 2), `gyration` (c,)."""
    count = len(centroid)
    member = np.argsort(body, kind="stable")[np.count_nonzero(body < 0) :]
    start = np.concatenate([[0], np.cumsum(np.bincount(body[member], minlength=count))])
    offset = xy[member] - centroid[body[member]]
    reach = np.zeros(count)
    np.maximum.at(reach, body[member], np.hypot(*offset.T))
    motion = np.zeros((count, 8))
    motion[:, : Y + 1], motion[:, MASS:] = centroid, 1.0
    return Clumps(motion, body.copy(), start, member, offset, reach, np.asarray(gyration, dtype=float))


@jit
def resultant(c, clumps, disc, load, weight, gravity):
    """Force [N] and moment [N m] (3,) on clump c, Eq (1) with the weight."""
    x, y = clumps.motion[c, X], clumps.motion[c, Y]
    fx = fy = m = 0.0
    for q in range(clumps.start[c], clumps.start[c + 1]):
        i = clumps.member[q]
        fx += load[i, FX]
        fy += load[i, FY] - weight[i] * gravity
        m += load[i, MOMENT] + (disc[i, X] - x) * load[i, FY] - (disc[i, Y] - y) * load[i, FX]
    return fx, fy, m


@jit
def move_clumps(disc, load, weight, angle, alpha, clumps, gravity, fastest, cap, kick, dt):
    """Moves all clumps by Eqs (1) to (3).

    Returns the number of clumps faster than `fastest` (with `cap` they are slowed down) and the largest squared speed of a disc.
    """
    motion, fast, largest = clumps.motion, 0, 0.0
    for c in range(len(motion)):
        if clumps.start[c] == clumps.start[c + 1]:
            continue
        fx, fy, m = resultant(c, clumps, disc, load, weight, gravity)
        u, v, w = motion[c, VX], motion[c, VY], motion[c, SPIN]
        if alpha is not None:
            fx, fy, m = damped(fx, u, alpha), damped(fy, v, alpha), damped(m, w, alpha)
        u += fx / motion[c, MASS] * kick
        v += fy / motion[c, MASS] * kick
        w += m / motion[c, INERTIA] * kick
        speed = (u * u + v * v) ** 0.5 + abs(w) * clumps.reach[c]
        if speed > fastest:
            fast += 1
            if cap:
                scale = fastest / speed
                u, v, w = u * scale, v * scale, w * scale
                speed = fastest
        largest = max(largest, speed * speed)
        motion[c, X] += u * dt
        motion[c, Y] += v * dt
        motion[c, VX], motion[c, VY], motion[c, SPIN] = u, v, w
        motion[c, ANGLE] += w * dt
        place_members(c, clumps, disc, angle, dt)
    return fast, largest


@jit
def place_members(c, clumps, disc, angle, dt):
    """Sets positions and velocities of the discs of clump c, Eq (3)."""
    x, y, u, v, w, now = (
        clumps.motion[c, X], clumps.motion[c, Y], clumps.motion[c, VX], clumps.motion[c, VY],
        clumps.motion[c, SPIN], clumps.motion[c, ANGLE],
    )  # fmt: skip
    turn = w * dt
    ca, sa, chord = np.cos(now), np.sin(now), 2.0 * np.sin(0.5 * turn) / dt
    cm, sm = chord * np.cos(now - 0.5 * turn), chord * np.sin(now - 0.5 * turn)
    for q in range(clumps.start[c], clumps.start[c + 1]):
        i, ox, oy = clumps.member[q], clumps.offset[q, 0], clumps.offset[q, 1]
        disc[i, X] = x + ca * ox - sa * oy
        disc[i, Y] = y + sa * ox + ca * oy
        disc[i, VX] = u - sm * ox - cm * oy
        disc[i, VY] = v + cm * ox - sm * oy
        disc[i, SPIN] = w
        angle[i] += turn
