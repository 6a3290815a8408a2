"""A circular hole in Mohr-Coulomb rock under pressure from all sides.

a = 1 m, P0 = 30 MPa, c = 3.45 MPa, phi = psi = 30, K = 3900 MPa, G = 2800 MPa, initial stress across the plane 20 MPa;
pressure positive. With N = (1 + sin phi)/(1 - sin phi), Np the same with psi, q = 2 c sqrt(N), P = q/(N - 1):

    R0 = a [2/(N + 1) (P0 + P)/P]^(1/(N - 1))           radial stress there (2 P0 - q)/(N + 1)
    sigma_r = P ((r/a)^(N - 1) - 1)    sigma_t = P (N (r/a)^(N - 1) - 1)                       r < R0
    sigma_t, sigma_r = P0 ± (P0 - sigma_r(R0)) (R0/r)^2                                       r > R0
    u = r/2G [(2 nu - 1)(P0 + P) + (1 - nu)(N^2 - 1)/(N + Np) P (R0/a)^(N - 1) (R0/r)^(Np + 1)
              + ((1 - nu)(N Np + 1)/(N + Np) - nu) P (r/a)^(N - 1)]                            r < R0

A quarter ring from a to 8a with 12, 24 and 48 zones to the right angle. The rock outside is infinite: for a radial
displacement u, its pressure on the outer gridpoints grows by 2G u/r. The support of the wall is reduced as (1 - s)^2 while s
grows from 0 to 1: the wall comes to rest together with its support, so it does not overshoot (see below). The closed form has
flow in the plane only; the initial stress across the plane must therefore stay between the two others (up to 22.06 MPa)."""

import numpy as np

from fdm_server.mesh.grid import areas
from fdm_server.observe import fields
from verification import as_a_run
from verification.continuum.holes import AXES, OUTER, edge_forces, hole, norm, outward, polar, ring_grid, seen, settle
from verification.orders import order
from verification.verdict_rows import row

NAME = "Salencon hole"
SOURCE = "Salencon (1969), Ann. Inst. Tech. Bat. Trav. Publ. 21; FLAC verification problem"
P0, COHESION, FRICTION, K, G = 30e6, 3.45e6, 30.0, 3900e6, 2800e6
N = NP = (1 + np.sin(np.radians(FRICTION))) / (1 - np.sin(np.radians(FRICTION)))
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


def wall_displacement():
    """Displacement [m] of the wall towards the axis."""
    grown = R0 ** (N - 1) * R0 ** (NP + 1)
    first = (2 * NU - 1) * (P0 + P) + (1 - NU) * (N**2 - 1) / (N + NP) * P * grown
    return (first + ((1 - NU) * (N * NP + 1) / (N + NP) - NU) * P) / (2 * G)


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


def as_scene(n, steps, outer=30.0):
    """The hole opened by the product: P0 acts on an outer side far away, the support of the wall fades by straight ramps."""
    boundary = [*AXES, {"on": "outer", "pressure": P0}, {"on": "inner", "pressure": P0}]
    law = {"friction": FRICTION, "cohesion": COHESION, "dilation": FRICTION}
    ends = {"ratio": 1e-6, "steps": 100_000}
    relief = as_a_run.slowing({"on": "inner"}, lambda share: {"pressure": P0 * (1.0 - share)}, steps, ends)
    return as_a_run.tables(
        ring_grid(n, outer),
        as_a_run.material(K, G, mohr_coulomb=law),
        relief,
        boundary,
        initial_stress={"xx": -P0, "yy": -P0, "zz": -20e6},
    )


def wall(ring):
    """Mean displacement [m] of the wall towards the axis."""
    return float(-(ring.state.displacement * ring.xy)[ring.wall].sum(axis=1).mean())


def plastic_radius(ring):
    """Radius [m] of the circle that holds the hole and as much area as the zones that have yielded."""
    yielded = fields.plastic_state(ring.model, ring.state) > 0
    hole_area = 0.25 * np.pi - (areas(ring.xy, ring.quads).sum() - 0.25 * np.pi * (OUTER**2 - 1.0))
    return float(np.sqrt((areas(ring.xy, ring.quads)[yielded].sum() + hole_area) / (0.25 * np.pi)))


def elastic_plastic_radius(ring):
    """Plastic radius [m] that the stresses outside belong to: sigma_t - sigma_r = 2 (P0 - sigma_r(R0)) (R0/r)^2."""
    outside = (ring.radius > 1.25 * R0) & (ring.radius < 4.0)
    stress = -polar(ring)[outside]
    return float(np.mean(ring.radius[outside] * np.sqrt((stress[:, 1] - stress[:, 0]) / (2.0 * (P0 - AT_R0)))))


def radial_stress_at(ring, r):
    """Radial stress [Pa], pressure positive, at a distance [m], between the means of the rings of zones."""
    n = len(ring.wall) - 1
    radii = ring.radius.reshape(-1, n).mean(axis=1)
    return float(np.interp(r, radii, -polar(ring)[:, 0].reshape(-1, n).mean(axis=1)))


def error(ring):
    """Error norm of radial and tangential stress over P0 within 4a."""
    return norm(ring, -polar(ring)[:, :2] - exact(ring.radius), within=4.0) / P0


def rows(fast):
    """Three meshes, the wall relieved in 40,000 steps (fast: 24 and 36 zones, 10,000 steps)."""
    sizes, ramp = ((24, 36), 10_000) if fast else ((12, 24, 48), 40_000)
    rings = [solve(n, ramp)[0] for n in sizes]
    size = 1.0 / np.array(sizes)
    errors = [error(ring) for ring in rings]
    walls = np.array([wall(ring) for ring in rings])
    last = rings[-1]
    zone = 0.5 * np.pi / sizes[-1]
    yield row("plastic radius, area of the zones (within one) [m]", plastic_radius(last), R0, zone, SOURCE)
    yield row("plastic radius, stresses outside [m]", elastic_plastic_radius(last), R0, 0.01, SOURCE)
    yield row("radial stress at the plastic radius [Pa]", radial_stress_at(last, R0), AT_R0, 0.01, SOURCE)
    target = wall_displacement()
    yield row("displacement of the wall [m]", walls[-1], target, 0.03, SOURCE, None if fast else order(size, walls - target))
    yield row("error norm of the stress over P0", errors[-1], 0.0, 0.01, SOURCE, None if fast else order(size, errors))
    found = as_a_run.compute(as_scene(24, 20_000))
    yield row("as a scene: displacement of the wall [m]", wall(seen(found.model, found.state)), target, 0.03, SOURCE)


def study(pictures):
    """How the wall depends on the way it is relieved."""
    from verification.continuum import salencon_paths

    return salencon_paths.study(pictures)
