"""Mapping across the interface: velocities of nodes to control discs, forces of control discs to nodes.

Both directions are in one file because each is the transpose of the other. For a disc at x_p on the segment with nodes
x0, x1 (length l, unit tangent t from 0 to 1, normal n = (-t_y, t_x)):

    xi    = clip((x_p - x0).t / l, 0, 1)      e = x_p - x(xi)      omega = n.(v1 - v0) / l
    v_p   = (1 - xi) v0 + xi v1 + omega k x e,   spin_p = omega
    M     = e x P + M_p
    F0    = (1 - xi) P - (M / l) n,   F1 = xi P + (M / l) n

so that F0.v0 + F1.v1 = P.v_p + M_p spin_p for every velocity: power, force and moment are conserved.

A disc on a node has the node's velocity and the length-weighted mean of the spins of its two segments; its force acts on the
node and its moment is divided with the same weights between the couples of both segments.

The option `paper` is the mapping of the paper's equations (1)-(12) with corrected signs.
The discrete server calls both compiled functions: messages contain only velocities and forces of nodes.
"""

import numpy as np

from coupler_protocol.compiled.jit import jit

Array = np.ndarray


@jit(package="dem_server", forceinline=True)
def segment(x: Array, a: int) -> tuple[int, float, float, float]:
    """Segment a of the closed chain of nodes x (K,2): its second node, vector from the first to it [m], length squared [m2]."""
    b = (a + 1) % x.shape[0]
    lx = x[b, 0] - x[a, 0]
    ly = x[b, 1] - x[a, 1]
    return b, lx, ly, lx * lx + ly * ly


@jit(package="dem_server")
def velocities_to_discs(
    x: Array, v: Array, seg0: Array, seg1: Array, w0: Array, node: Array, xd: Array, vd: Array, spin: Array, paper: bool
) -> None:
    """Writes the motion of the control discs that follows from the motion of the nodes: vd (R,2) [m/s] and spin (R,) [1/s].

    x, v (K,2): node positions [m] and velocities [m/s]. seg0, seg1 (R,): segment (index of its first node) of a disc between
    nodes; for a disc on a node the segment before it (seg0) and after it (seg1). w0 (R,): weight of the spin of seg0 (1 for a
    disc between nodes). node (R,): node of a disc, -1 for a disc between nodes. xd (R,2): disc positions [m].
    `paper`: equations (11)-(12), no spin.
    """
    for p in range(xd.shape[0]):
        a = seg0[p]
        b, lx, ly, ll = segment(x, a)
        omega = (lx * (v[b, 1] - v[a, 1]) - ly * (v[b, 0] - v[a, 0])) / ll
        if node[p] >= 0:
            c = seg1[p]
            d, mx, my, mm = segment(x, c)
            other = (mx * (v[d, 1] - v[c, 1]) - my * (v[d, 0] - v[c, 0])) / mm
            omega = w0[p] * omega + (1.0 - w0[p]) * other
            vx = v[node[p], 0]
            vy = v[node[p], 1]
            ex = xd[p, 0] - x[node[p], 0]
            ey = xd[p, 1] - x[node[p], 1]
        else:
            xi = ((xd[p, 0] - x[a, 0]) * lx + (xd[p, 1] - x[a, 1]) * ly) / ll
            xi = min(max(xi, 0.0), 1.0)
            vx = (1.0 - xi) * v[a, 0] + xi * v[b, 0]
            vy = (1.0 - xi) * v[a, 1] + xi * v[b, 1]
            ex = xd[p, 0] - (x[a, 0] + xi * lx)
            ey = xd[p, 1] - (x[a, 1] + xi * ly)
        if paper:
            omega = 0.0
        vd[p, 0] = vx - omega * ey
        vd[p, 1] = vy + omega * ex
        spin[p] = omega


@jit(package="dem_server")
def _couple(F: Array, x: Array, a: int, M: float) -> None:
    """Adds the couple of moment M [N m] of segment a to the forces F of its two nodes."""
    b, lx, ly, ll = segment(x, a)
    F[a, 0] += M * ly / ll
    F[a, 1] -= M * lx / ll
    F[b, 0] -= M * ly / ll
    F[b, 1] += M * lx / ll


@jit(package="dem_server")
def forces_to_nodes(
    x: Array, seg0: Array, seg1: Array, w0: Array, node: Array, xd: Array, P: Array, Mp: Array, F: Array, paper: bool
) -> None:
    """Writes nodal forces F (K,2) [N] from contact forces P (R,2) [N] and moments Mp (R,) [N m] on the control discs.

    Other arguments as in `velocities_to_discs`. `paper`: equations (1)-(12), corrected; they do not transfer Mp.
    """
    F[:, :] = 0.0
    for p in range(xd.shape[0]):
        a = seg0[p]
        b, lx, ly, ll = segment(x, a)
        rx = xd[p, 0] - x[a, 0]
        ry = xd[p, 1] - x[a, 1]
        if paper:
            # m3 = (r x P) / l;  m0 = |r1| / (|r| + |r1|) P.t;  m1 = P.n - m3;  m2 = P.t - m0
            length = np.sqrt(ll)
            tx = lx / length
            ty = ly / length
            r = np.sqrt(rx * rx + ry * ry)
            r1 = np.sqrt((xd[p, 0] - x[b, 0]) ** 2 + (xd[p, 1] - x[b, 1]) ** 2)
            Pt = P[p, 0] * tx + P[p, 1] * ty
            Pn = -P[p, 0] * ty + P[p, 1] * tx
            m3 = (rx * P[p, 1] - ry * P[p, 0]) / length
            m0 = r1 / (r + r1) * Pt
            m1 = Pn - m3
            m2 = Pt - m0
            F[a, 0] += m0 * tx - m1 * ty
            F[a, 1] += m0 * ty + m1 * tx
            F[b, 0] += m2 * tx - m3 * ty
            F[b, 1] += m2 * ty + m3 * tx
        elif node[p] >= 0:
            i = node[p]
            M = (xd[p, 0] - x[i, 0]) * P[p, 1] - (xd[p, 1] - x[i, 1]) * P[p, 0] + Mp[p]
            F[i, 0] += P[p, 0]
            F[i, 1] += P[p, 1]
            _couple(F, x, a, w0[p] * M)
            _couple(F, x, seg1[p], (1.0 - w0[p]) * M)
        else:
            xi = min(max((rx * lx + ry * ly) / ll, 0.0), 1.0)
            ex = rx - xi * lx
            ey = ry - xi * ly
            M = ex * P[p, 1] - ey * P[p, 0] + Mp[p]
            F[a, 0] += (1.0 - xi) * P[p, 0]
            F[a, 1] += (1.0 - xi) * P[p, 1]
            F[b, 0] += xi * P[p, 0]
            F[b, 1] += xi * P[p, 1]
            _couple(F, x, a, M)
