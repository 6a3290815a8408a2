"""The circular hole in Mohr-Coulomb rock of the case salencon: its closed form, and its ground with the support of the wall."""

import numpy as np

from verification.continuum.holes import edge_forces, hole, outward, settle

P0, COHESION, FRICTION, K, G = 30e6, 3.45e6, 30.0, 3900e6, 2800e6
N = (1 + np.sin(np.radians(FRICTION))) / (1 - np.sin(np.radians(FRICTION)))
Q = 2 * COHESION * np.sqrt(N)
P = Q / (N - 1)
NU = (3 * K - 2 * G) / (2 * (3 * K + G))
R0 = (2 / (N + 1) * (P0 + P) / P) ** (1 / (N - 1))
AT_R0 = (2 * P0 - Q) / (N + 1)


def exact(r):
    """Radial and tangential stress (n,2) [Pa], pressure positive, at distances r (n,) [m]."""
    plastic = (r / 1.0) ** (N - 1)
    far = (P0 - AT_R0) * (R0 / r) ** 2
    radial = np.where(r < R0, P * (plastic - 1), P0 - far)
    return np.column_stack([radial, np.where(r < R0, P * (N * plastic - 1), P0 + far)])


def wall_displacement(psi=FRICTION, cohesion=COHESION):
    """Displacement [m] of the wall towards the axis; psi [deg]."""
    flow = (1 + np.sin(np.radians(psi))) / (1 - np.sin(np.radians(psi)))
    apex = 2 * cohesion * np.sqrt(N) / (N - 1)
    radius = (2 / (N + 1) * (P0 + apex) / apex) ** (1 / (N - 1))
    grown = radius ** (N - 1) * radius ** (flow + 1)
    first = (2 * NU - 1) * (P0 + apex) + (1 - NU) * (N**2 - 1) / (N + flow) * apex * grown
    return (first + ((1 - NU) * (N * flow + 1) / (N + flow) - NU) * apex) / (2 * G)


def solve(n, ramp, across=20e6, ratio=1e-6, mixed=True, left=lambda s: (1.0 - s) ** 2):
    """The hole with n zones to the right angle, and the steps; left(s): share of the support, s from 0 to 1 in `ramp` steps."""
    ring, load = loaded(n, ramp, across, mixed, left)
    return ring, settle(ring, ratio, load, ramp)


def loaded(n, ramp, across=20e6, mixed=True, left=lambda s: 1.0 - s):
    """The hole at rest under its support, and what sets its applied forces for a step; ramp 0: no support at all."""
    law = {"friction": FRICTION, "cohesion": COHESION, "dilation": FRICTION}
    ring = hole(n, K, G, mixed, P0, across, mohr_coulomb=law)
    state, outer = ring.state, ring.outer
    support = edge_forces(ring, ring.wall, P0 * outward(ring, ring.wall))
    far = edge_forces(ring, outer, -P0 * outward(ring, outer))
    radius = np.hypot(*ring.xy[outer[0]])
    radial = ring.xy[outer] / radius
    length = np.hypot(*edge_forces(ring, outer, outward(ring, outer))[outer].T)
    spring = 2.0 * G / radius * length  # [N/m]

    def load(step):
        state.applied[:] = far + left(min(1.0, step / ramp) if ramp else 1.0) * support
        inward = -(state.displacement[outer] * radial).sum(axis=1)
        state.applied[outer] += (spring * inward)[:, None] * radial

    return ring, load


def wall(ring):
    """Mean displacement [m] of the wall towards the axis."""
    return float(-(ring.state.displacement * ring.xy)[ring.wall].sum(axis=1).mean())
