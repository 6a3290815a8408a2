"""A circular hole in an elastic plate under uniaxial pressure.

a = 1 m, p = 30 MPa along x, K = 3900 MPa, G = 2800 MPa; pressure positive. With rho = a/r:

    sigma_r  = p/2 (1 - rho^2) + p/2 (1 - 4 rho^2 + 3 rho^4) cos 2 theta
    sigma_t  = p/2 (1 + rho^2) - p/2 (1 + 3 rho^4) cos 2 theta
    sigma_rt = -p/2 (1 + 2 rho^2 - 3 rho^4) sin 2 theta

A quarter ring from a to 8a with 12, 24 and 48 zones to the right angle; the tractions of the closed form act on its outer
side, so the zone size is the only source of error; and once as a scene, where the undisturbed stress acts on a side 30a away.
At r = 2a, theta = 90 degrees, the stress is interpolated between the zones that touch the y axis. The error norm is the root
of the mean square, by area within 4a, of all stress components over p."""

import numpy as np

from fdm_server.mesh.grid import centroids
from verification import as_a_run
from verification.continuum.holes import AXES, edge_forces, hole, norm, polar, ring_grid, seen, settle
from verification.orders import order
from verification.verdict_rows import row

NAME = "Kirsch hole"
SOURCE = "Kirsch (1898); Jaeger, Cook & Zimmerman (2007), section 8.5"
PRESSURE, K, G = 30e6, 3900e6, 2800e6
NU = (3 * K - 2 * G) / (2 * (3 * K + G))


def exact(xy):
    """Radial, tangential and shear stress (n,3) [Pa], pressure positive, at points (n,2)."""
    rho2 = 1.0 / (xy**2).sum(axis=1)
    twice = 2.0 * np.arctan2(xy[:, 1], xy[:, 0])
    half = 0.5 * PRESSURE
    radial = half * (1 - rho2) + half * (1 - 4 * rho2 + 3 * rho2**2) * np.cos(twice)
    tangential = half * (1 + rho2) - half * (1 + 3 * rho2**2) * np.cos(twice)
    return np.column_stack([radial, tangential, -half * (1 + 2 * rho2 - 3 * rho2**2) * np.sin(twice)])


def solve(n, ratio=1e-7, mixed=True):
    """The hole with n zones to the right angle in equilibrium, and the steps that took."""
    ring = hole(n, K, G, mixed)
    middle = 0.5 * (ring.xy[ring.outer[1:]] + ring.xy[ring.outer[:-1]])
    radial, _, shear = exact(middle).T
    x, y = (middle / np.hypot(*middle.T)[:, None]).T
    traction = -np.column_stack([radial * x - shear * y, radial * y + shear * x])
    ring.state.applied[:] = edge_forces(ring, ring.outer, traction)
    return ring, settle(ring, ratio)


def as_scene(n, outer=30.0):
    """The hole opened by the product in an initial stress; p acts on its outer side."""
    p = {"stress": {"xx": -PRESSURE}}
    relief = [{"on": "inner", "stress": {}, "over": 2_000}]
    return as_a_run.tables(
        ring_grid(n, outer),
        as_a_run.material(K, G),
        [{"name": "open", "kind": "load", "boundary": relief, "until": {"ratio": 1e-6}}],
        [*AXES, {"on": "outer"} | p, {"on": "inner"} | p],
        initial_stress={"xx": -PRESSURE, "zz": -PRESSURE * NU},
    )


def at_two_radii(ring):
    """Radial and tangential stress [Pa], pressure positive, at r = 2a in the zones at the y axis."""
    n = len(ring.wall) - 1
    radius, stress = ring.radius[n - 1 :: n], -polar(ring)[n - 1 :: n]
    return np.array([np.interp(2.0, radius, stress[:, 0]), np.interp(2.0, radius, stress[:, 1])])


def error(ring):
    """The error norm over p."""
    return norm(ring, -polar(ring) - exact(centroids(ring.xy, ring.quads)), within=4.0) / PRESSURE


def rows(fast):
    """Three meshes (fast: the two coarse ones)."""
    sizes = (12, 24) if fast else (12, 24, 48)
    rings = [solve(n)[0] for n in sizes]
    found = np.array([at_two_radii(ring) for ring in rings])
    target = exact(np.array([[0.0, 2.0]]))[0, :2]
    errors = [error(ring) for ring in rings]
    size = 1.0 / np.array(sizes)
    for k, name in enumerate(("radial", "tangential")):
        observed = order(size, found[:, k] - target[k])
        yield row(f"{name} stress at 2a, 90 degrees [Pa]", found[-1, k], target[k], 0.02, SOURCE, observed)
    observed = order(size, errors)
    yield row("error norm of the stress over p", errors[-1], 0.0, 0.01, SOURCE, observed)
    yield row("order of the error norm (at least 1.5)", observed, 2.0, [-0.25, 0.5], SOURCE, observed)
    found = as_a_run.compute(as_scene(24 if fast else 36))
    tangential = at_two_radii(seen(found.model, found.state))[1]
    yield row("as a scene: tangential stress there [Pa]", tangential, target[1], 0.02, SOURCE)
