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
grows from 0 to 1: the wall comes to rest together with its support, so it does not overshoot (see below). As a scene the wall
is also opened by one stage with `over` = 1,000, whose relief waits for rest (docs/theory.md), for psi = phi and psi = 0. The
closed form has flow in the plane only; the initial stress across the plane must therefore stay between the two others (up to
22.06 MPa)."""

import numpy as np

from fdm_server.mesh.grid import areas
from fdm_server.observe import fields
from verification import as_a_run
from verification.continuum import salencon_paths
from verification.continuum.holes import AXES, OUTER, norm, polar, ring_grid, seen
from verification.continuum.salencon_hole import AT_R0, COHESION, FRICTION, P0, R0, G, K, exact, solve, wall, wall_displacement
from verification.orders import order
from verification.verdict_rows import row

NAME = "Salencon hole"
SOURCE = "Salencon (1969), Ann. Inst. Tech. Bat. Trav. Publ. 21; FLAC verification problem"


def waiting(n, psi, damping, over=1_000, outer=30.0):
    """The hole opened by one stage of the product, whose relief waits for rest."""
    law = {"friction": FRICTION, "cohesion": COHESION, "dilation": psi}
    stage = {"name": "open", "kind": "load", "until": {"ratio": 1e-6, "steps": 100_000}}
    return as_a_run.tables(
        ring_grid(n, outer),
        as_a_run.material(K, G, mohr_coulomb=law),
        [stage | {"boundary": [{"on": "inner", "pressure": 0.0, "over": over}]}],
        [*AXES, {"on": "outer", "pressure": P0}, {"on": "inner", "pressure": P0}],
        initial_stress={"xx": -P0, "yy": -P0, "zz": -20e6},
        damping=damping,
    )


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
    for psi, kind in ((FRICTION, "local"), (0.0, "local"), (FRICTION, "combined")):
        found = as_a_run.compute(waiting(24 if fast else 36, psi, {kind: 0.8}))
        what = f"as a scene, relief that waits for rest, psi = {psi:g}, {kind} damping: wall [m]"
        yield row(what, wall(seen(found.model, found.state)), wall_displacement(psi), 0.01, SOURCE)
    found = as_a_run.compute(as_scene(24, 20_000))
    yield row("as a scene: displacement of the wall [m]", wall(seen(found.model, found.state)), target, 0.03, SOURCE)


def study(pictures):
    """How the wall depends on the way it is relieved."""
    return salencon_paths.study(pictures)
