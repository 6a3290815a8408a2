"""Linear displacement of the boundary gives constant stress on any mesh.

A square of distorted quadrilaterals, one of triangles and one of both; inner gridpoints are displaced at random by up to 30 %
of a zone. Outer gridpoints move by a displacement gradient, inner ones come to equilibrium. Every inner gridpoint must land on
the same linear displacement and every zone must have the stress of that gradient: du_i/dx_j constant, Hooke's law."""

import numpy as np

from fdm_server.observe import fields
from fdm_server.step.gridpoint_pass import unbalanced_ratio, update_velocities
from fdm_server.step.zone_pass import advance
from verification import as_a_run
from verification.continuum.meshes import model_of_zones
from verification.verdict_rows import row

NAME = "patch"
SOURCE = "Irons & Razzaque (1972), patch test"
GRADIENT = np.array([[2e-4, -3e-4], [1e-4, 5e-5]])
K, G = 0.5e9, 0.15e9


def square(n, kind, seed=5):
    """Gridpoints (N,2), zones (Z,4) and outer gridpoints (N,) of n x n shaken cells: "quads", "triangles" or "both"."""
    x, y = np.meshgrid(np.linspace(0.0, 1.0, n + 1), np.linspace(0.0, 1.0, n + 1))
    xy = np.column_stack([x.ravel(), y.ravel()])
    outer = np.any((xy == 0.0) | (xy == 1.0), axis=1)
    shift = np.random.default_rng(seed).uniform(-0.3 / n, 0.3 / n, xy.shape)
    xy[~outer] += shift[~outer]
    zones = []
    for j in range(n):
        for i in range(n):
            a = j * (n + 1) + i
            quad = (a, a + 1, a + n + 2, a + n + 1)
            if kind == "quads" or (kind == "both" and (i + j) % 2):
                zones.append(quad)
            else:
                zones += [(quad[0], quad[1], quad[2], quad[2]), (quad[0], quad[2], quad[3], quad[3])]
    return xy, np.array(zones), outer


def solve(n, kind):
    """Largest errors of displacement and stress over the largest of each."""
    xy, zones, outer = square(n, kind)
    model, state = model_of_zones(xy, zones, as_a_run.material(K, G), np.column_stack([outer, outer]))
    target = xy @ GRADIENT.T
    state.velocity[outer] = target[outer]
    advance(model, state)
    state.velocity[:] = 0.0
    for step in range(20_000):
        update_velocities(model, state, 0.0)
        advance(model, state)
        if step % 50 == 49 and unbalanced_ratio(model, state, 0.0) < 1e-14:
            break
    exx, eyy, gamma = GRADIENT[0, 0], GRADIENT[1, 1], GRADIENT[0, 1] + GRADIENT[1, 0]
    a1, a2 = K + 4 * G / 3, K - 2 * G / 3
    exact = np.array([a1 * exx + a2 * eyy, a2 * exx + a1 * eyy, a2 * (exx + eyy), G * gamma])
    displacement = np.abs(state.displacement - target).max() / np.abs(target).max()
    return displacement, np.abs(fields.stress(model, state) - exact).max() / np.abs(exact).max()


def rows(fast):
    """Errors on 12 x 12 cells (fast: 6 x 6)."""
    for kind in ("quads", "triangles", "both"):
        displacement, stress = solve(6 if fast else 12, kind)
        yield row(f"displacement, {kind}", displacement, 0.0, 1e-10, SOURCE)
        yield row(f"stress, {kind}", stress, 0.0, 1e-10, SOURCE)
