"""One zone compressed without lateral strain.

K = G = 200 MPa, c = 1 MPa, phi = psi = 10, tension cut-off 5.67 MPa. The zone yields where a1 eps = N a2 eps + C and then
flows along the edge of its two equal lateral stresses. With a1 = K + 4G/3, a2 = K - 2G/3, N = (1 + sin phi)/(1 - sin phi), Np
the same with psi, C = 2 c sqrt(N), m1 = a1 - a2 Np and m = a2 - (a1 + a2) Np/2:

    eps_y = C/(a1 - N a2)            d sigma/d eps = a1                                   before
    sigma_y = a1 eps_y               d sigma/d eps = a1 - m1 (a1 - N a2)/(m1 - N m)       after
"""

from math import radians, sin, sqrt

import numpy as np

from fdm_server.observe import fields
from fdm_server.step.zone_pass import advance
from verification import as_a_run
from verification.continuum.meshes import model_of_zones
from verification.verdict_rows import row

NAME = "oedometer"
SOURCE = "closed form (edge of the Mohr-Coulomb surface)"
K = G = 200e6
A1, A2 = K + 4 * G / 3, K - 2 * G / 3
N = (1 + sin(radians(10))) / (1 - sin(radians(10)))
C = 2e6 * sqrt(N)
M1, M = A1 - A2 * N, A2 - 0.5 * (A1 + A2) * N
YIELD = C / (A1 - N * A2)


def vertical(strain):
    """Vertical stress [Pa], compression positive, at a compression `strain`."""
    after = A1 - M1 * (A1 - N * A2) / (M1 - N * M)
    return A1 * min(strain, YIELD) + after * max(strain - YIELD, 0.0)


def compress(strain, steps):
    """Strain and stress [Pa] (steps,) of the zone, compression positive, and whether it has yielded."""
    law = {"mohr_coulomb": {"friction": 10.0, "cohesion": 1e6, "dilation": 10.0}, "tension": {"strength": 5.67e6}}
    xy = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    model, state = model_of_zones(xy, np.array([[0, 1, 2, 3]]), as_a_run.material(K, G, **law))
    state.velocity[2:, 1] = -strain / steps
    stresses, yielded = np.empty(steps), np.empty(steps, dtype=np.bool_)
    for step in range(steps):
        advance(model, state)
        stresses[step] = -fields.stress(model, state)[0, 1]
        yielded[step] = fields.plastic_state(model, state)[0] > 0
    return strain * np.arange(1, steps + 1) / steps, stresses, yielded


def rows(fast):
    """Yield point and stress at 2 % in steps of 1e-6 (fast: 1e-4)."""
    steps = 200 if fast else 20_000
    strain, stress, yielded = compress(0.02, steps)
    first = np.argmax(yielded)
    yield row("strain at yield", strain[first], YIELD, 1.01 * strain[0] / YIELD, SOURCE)
    yield row("stress at yield [Pa]", stress[first], A1 * YIELD, 1.01 * strain[0] / YIELD, SOURCE)
    yield row("stress at 2 % [Pa]", stress[-1], vertical(0.02), 1e-10, SOURCE)
    after = strain > YIELD + strain[0]
    error = np.abs(stress[after] / [vertical(e) for e in strain[after]] - 1.0).max()
    yield row("largest error along the path", error, 0.0, 1e-10, SOURCE)
