"""A strip load on an elastic layer over a smooth rigid base.

Layer of H = 5 m between smooth walls at x = 0 and x = L = 10 m; pressure p = 100 kPa on 0 < x < b = 1 m (half of a strip of 2
m), applied by a stage of kind surcharge; K = 50 MPa, G = 20 MPa, no weight. Airy's function term by term, k = n pi/L, y from
the base:

    p(x) = p b/L + sum p_n cos kx,    p_n = 2 p/(n pi) sin kb,    F = f(y) cos kx,    f = A cosh ky + B ky sinh ky
    A = p_n (sinh kH + kH cosh kH)/(k^2 (kH + sinh kH cosh kH)),    B = -p_n sinh kH/(k^2 (kH + sinh kH cosh kH))
    sigma_xx = f'' cos kx,    sigma_yy = -k^2 f cos kx,    sigma_xy = k f' sin kx

and the uniform part of uniaxial strain. The settlement is the integral of eps_yy. Stresses are compared in the zones below
y = H - b, where the jump of the load at x = b has no effect: root of the mean square over all components, over p.
"""

import numpy as np

from fdm_server.mesh.grid import centroids
from fdm_server.observe import fields
from verification import as_a_run
from verification.orders import order
from verification.verdict_rows import row

NAME = "strip load"
SOURCE = "closed form (Fourier series of Airy's function)"
K, G, P, B, L, H = 50e6, 20e6, 100e3, 1.0, 10.0, 5.0
NU, M = (3 * K - 2 * G) / (2 * (3 * K + G)), K + 4 * G / 3
TERMS = 2000


def series():
    """k (n,) [1/m] and the factors of f (n,) over cosh kH: A cosh kH and B cosh kH [N]."""
    k = np.arange(1, TERMS + 1) * np.pi / L
    load = 2.0 * P / (k * L) * np.sin(k * B)
    t, inverse_square = np.tanh(k * H), (2.0 * np.exp(-k * H) / (1.0 + np.exp(-2.0 * k * H))) ** 2
    divisor = k**2 * (k * H * inverse_square + t)
    return k, load * (t + k * H) / divisor, -load * t / divisor


def exact(xy):
    """Stresses xx, yy, xy (n,3) [Pa] at points (n,2)."""
    k, a, b = series()
    x, y = xy[:, :1], xy[:, 1:]
    up, down = np.exp(k * (y - H)), np.exp(-k * (y + H))
    c, s = (up + down) / (1.0 + np.exp(-2.0 * k * H)), (up - down) / (1.0 + np.exp(-2.0 * k * H))
    ky = k * y
    f, slope = a * c + b * ky * s, k * (a * s + b * (s + ky * c))
    curvature = k**2 * (a * c + b * (2.0 * c + ky * s))
    uniform = -P * B / L
    xx = uniform * (K - 2 * G / 3) / M + (curvature * np.cos(k * x)).sum(axis=1)
    yy = uniform - (k**2 * f * np.cos(k * x)).sum(axis=1)
    return np.column_stack([xx, yy, (k * slope * np.sin(k * x)).sum(axis=1)])


def settlement():
    """Settlement [m] of the surface at x = 0."""
    k, a, b = series()
    t = np.tanh(k * H)
    integral = a * t / k + b * (H - t / k)  # of f over the height
    return P * B / L * H / M + float((k**2 * integral + 2.0 * NU * k * b * t).sum()) / (2.0 * G)


def solve(size):
    """Norm of the stress error over p, and the settlement [m] at x = 0, with zones of `size` m."""
    scene = as_a_run.tables(
        {"kind": "box", "length": L, "height": H, "zone_size": size},
        as_a_run.material(K, G),
        [{"name": "load", "kind": "surcharge", "surcharge": {"x": [0.0, B], "pressure": P}, "until": {"ratio": 1e-7}}],
        {"left": "x", "right": "x", "bottom": "y"},
    )
    found = as_a_run.compute(scene)
    centre = centroids(found.model.grid.xy, found.model.grid.zones)
    below = centre[:, 1] < H - B
    error = fields.stress(found.model, found.state)[below][:, [0, 1, 3]] - exact(centre[below])
    corner = np.argmin(np.hypot(found.model.grid.xy[:, 0], found.model.grid.xy[:, 1] - H))
    return np.sqrt((error**2).mean()) / P, -found.state.displacement[corner, 1]


def rows(fast):
    """Zones of b/4, b/8 and b/16 (fast: the two coarse ones)."""
    sizes = (0.25, 0.125) if fast else (0.25, 0.125, 0.0625)
    errors, walls = np.array([solve(size) for size in sizes]).T
    observed = order(sizes, errors)
    yield row("error norm of the stress over p", errors[-1], 0.0, 2e-3, SOURCE, observed)
    yield row("order of the error norm (at least 1.5)", observed, 2.0, [-0.25, 0.5], SOURCE, observed)
    target = settlement()
    yield row("settlement under the middle [m]", walls[-1], target, 5e-3, SOURCE, order(sizes, walls - target))
