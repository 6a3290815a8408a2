"""Masses of gridpoints: the real ones for weight, and those that make a step of 1 stable for static problems.

A triangle with constrained modulus M = K + 4G/3, longest side L and area A is stable for a step dt = 1 if
each of its corners gets the mass M L^2 / 6A from it. The static mass is their sum over all triangles of both
overlaid pairs; since each of the two counts half in the forces, this holds a factor 2 in reserve, which local
damping uses up at most by 1 + alpha (Itasca 2011, FLAC 7.0 Theory, 1.3).
"""

import numpy as np

from fdm_server.blocks import TRIANGLES, triangle_double_areas


def static_masses(xy, zones, modulus):
    """Masses (N,) [kg] of gridpoints at a step of 1; modulus (Z,) [Pa] is K + 4G/3. One where no zone is."""
    double = triangle_double_areas(xy, zones)
    triangles = zones[:, TRIANGLES]
    ends = xy[triangles]
    longest = ((ends - np.roll(ends, 1, axis=2)) ** 2).sum(axis=3).max(axis=2)
    share = np.divide(longest, 3.0 * double, out=np.zeros_like(double), where=double > 0.0) * modulus[:, None]
    mass = np.bincount(triangles.ravel(), np.repeat(share.ravel(), 3), minlength=len(xy))
    return np.where(mass > 0.0, mass, 1.0)


def weight_masses(xy, zones, density):
    """Real masses (N,) [kg] of gridpoints: a third of each triangle's, each pair counting half."""
    share = density[:, None] * triangle_double_areas(xy, zones) / 12.0
    return np.bincount(zones[:, TRIANGLES].ravel(), np.repeat(share.ravel(), 3), minlength=len(xy))
