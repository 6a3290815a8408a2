"""Strength of a packing: a cone of stresses given by friction, with its tip moved outwards by bonds.

    (s1 - s3)/2 <= sin(phi) (pt - sm)                                            (1)
    sin(phi) = 0.85 sin(atan mu),    pt = sum Fnb d / 2A                         (2)
    sin(phi_C) = (1 - C) sin(phi) + C                                            (3)

sm: mean stress (tension positive). Discs roll, so the friction angle of a packing is smaller than that of a
contact: biaxial tests with mu = 0.55 give phi = 24 degrees, hence the factor in (2). pt is the isotropic
tension at which all bonds would break together (branch x force over area, all contacts at their strength).

Eq (3) is the sine of a mixture with the content C of stones, averaged over the area: a rigid stone carries every stress without
tension, so its sine is 1. For C = 0.45 it gives 33, 43 and 45 degrees for soils of 10, 25 and 28 degrees. Tests of such
mixtures gave 26, 42 and 50 degrees (biaxial, direct shear, biaxial). While a packing is brought to its stress its stones are not
rigid yet, so Eq (2) limits the rounds without bonds, and Eq (3) the stress that the window shall have.
"""

import numpy as np

from coupler_protocol.geometry import polygon_area
from dem_server.effects import SOIL
from dem_server.model import outline
from dem_server.pairs import contacts

ROLLING = 0.85  # sine of the packing's friction angle over sine of the contacts', Eq (2)


def friction_sine(model):
    """sin(phi) of the soil, Eq (2) [-]."""
    if model.law.friction is None:
        return 0.0
    mu = model.law.friction.coefficient[SOIL * model.materials + SOIL]
    return ROLLING * mu / np.sqrt(1.0 + mu * mu)


def mixture_sine(model, state):
    """sin(phi) of the soil with the stones to which discs are assigned, Eq (3) [-]."""
    sine = friction_sine(model)
    if state.stone is None:
        return sine
    area, inside = state.radius[model.ring :] ** 2, state.stone[model.ring :] >= 0
    content = float(area[inside].sum() / area.sum())
    return (1.0 - content) * sine + content


def tensile_strength(model, state):
    """pt of Eq (2) if all closed contacts were bonded [Pa]; 0 without bonds."""
    if model.law.bond is None:
        return 0.0
    pairs = contacts(state)
    strength = model.law.bond.tension[pairs.kind]
    return strength @ np.hypot(*pairs.branch.T) / (2.0 * polygon_area(outline(model, state)))


def inside_cone(stress, sine, tension=0.0):
    """Returns stresses xx, yy, xy (m, 3) [Pa] reduced to the cone, Eq (1), and the share of stresses that were outside.

    The mean stress stays; a tensile mean stress is set to zero.
    """
    mean = 0.5 * (stress[:, 0] + stress[:, 1])
    half, shear = 0.5 * (stress[:, 0] - stress[:, 1]), stress[:, 2]
    kept = np.minimum(mean, 0.0)
    limit = sine * (tension - kept)
    deviator = np.hypot(half, shear)
    outside = deviator > limit
    scale = np.divide(limit, deviator, out=np.ones_like(limit), where=outside)
    inside = np.column_stack([kept + scale * half, kept - scale * half, scale * shear])
    return inside, float((outside | (mean > 0.0)).mean())
