"""Masses of gridpoints: the real ones for weight, and those that make a step of 1 stable for static problems.

A triangle with constrained modulus M = K + 4G/3, longest side L and area A is stable for a step dt = 1 if
each of its corners gets the mass M L^2 / 6A from it. The static mass is their sum over all triangles of both
overlaid pairs. Each of the two counts half in the forces, so this has a factor 2 in reserve, of which local
damping needs at most 1 + alpha (Itasca 2011, FLAC 7.0 Theory and Background).

In real time the masses are rho A/3 per triangle, half of it in each pair, and the same bound makes a step stable up to

    q = min A/(c_p L),   c_p^2 = M/rho,   with omega <= sqrt(2)/q,

again with the factor 2 in omega^2 in reserve. Steps are a share of q; Rayleigh damping shortens them (effects/rayleigh.py).
"""

from math import inf, sqrt

import numpy as np

from coupler_protocol.compiled.jit import jit
from fdm_server.effects.rayleigh import step_share
from fdm_server.step.blocks import TRIANGLES, triangle_double_areas

CORNERS = tuple(map(tuple, TRIANGLES.tolist()))


def static_masses(xy, zones, modulus):
    """Masses (N,) [kg] of gridpoints at a step of 1; modulus (Z,) [Pa] is K + 4G/3. Gridpoints without zones have mass 1."""
    mass = np.zeros(len(xy))
    add_static_masses(xy, zones, modulus, mass)
    return mass


@jit
def add_static_masses(xy, zones, modulus, mass):
    """Kernel of `static_masses`; `mass` (N,) is zero at first."""
    for z in range(zones.shape[0]):
        for a, b, c in CORNERS:
            i, j, k = zones[z, a], zones[z, b], zones[z, c]
            x1, y1 = xy[j, 0] - xy[i, 0], xy[j, 1] - xy[i, 1]
            x2, y2 = xy[k, 0] - xy[i, 0], xy[k, 1] - xy[i, 1]
            double = x1 * y2 - x2 * y1
            if double > 0.0:
                longest = max(x1**2 + y1**2, x2**2 + y2**2, (x2 - x1) ** 2 + (y2 - y1) ** 2)
                share = longest / (3.0 * double) * modulus[z]
                mass[i] += share
                mass[j] += share
                mass[k] += share
    for n in range(mass.shape[0]):
        if mass[n] == 0.0:
            mass[n] = 1.0


def weight_masses(xy, zones, density):
    """Real masses (N,) [kg] of gridpoints: a third of the mass of each triangle; each pair counts half."""
    share = density[:, None] * triangle_double_areas(xy, zones) / 12.0
    return np.bincount(zones[:, TRIANGLES].ravel(), np.repeat(share.ravel(), 3), minlength=len(xy))


def stable_step(xy, zones, modulus, density):
    """The step q [s] above for gridpoints at xy (N,2) [m]; modulus [Pa] and density [kg/m3] by zone (Z,)."""
    corner = xy[zones[:, TRIANGLES]]  # (Z, triangles, corners, 2)
    longest = np.linalg.norm(corner - np.roll(corner, 1, axis=2), axis=3).max(axis=2)
    area = 0.5 * triangle_double_areas(xy, zones)
    height = np.divide(area, longest, out=np.full(area.shape, inf), where=area > 0.0).min(axis=1)
    return float(np.min(height / np.sqrt(modulus / density)))


def real_step(xy, model):
    """Step [s] of a model in real time with gridpoints at xy (N,2) [m]: its share of the stable one under its damping."""
    step = stable_step(xy, model.zones, model.modulus, model.zone_density)
    stiffness_part = None if model.law.rayleigh is None else model.law.rayleigh.stiffness
    return model.step_factor * step * (1.0 if stiffness_part is None else step_share(stiffness_part, sqrt(2.0) * step))
