"""Rows of the scratch memory in which a block of contacts is computed: one quantity a row, one contact a column.

All rows lie in one array, `LANES` numbers each, so that the compiler can see that they do not overlap. Rows of effects
that a scene does not have are never touched.
"""

import numpy as np

LANES = 64  # contacts a block: all rows of all effects stay within the first-level cache
COUNT = 37

(
    DX, DY, DU, DV,  # of the second disc against the first: place [m], velocity
    RI, RJ, WI, WJ,  # radii [m] and spins
    KN, KS, FRICTION, GAP,  # stiffnesses [N/m], friction coefficient, reference gap [m]
    FN, SHEAR, PX, PY,  # forces [N] along normal and tangent, in x and y, on the second disc
    MI, MJ,  # moments [N m]: -MI on the first disc, -MJ on the second
    BONDED, TENSION, STRENGTH,  # state of the contact bond, strengths [N]
    ROLLING, ROLLED,  # coefficient, moment [N m]
    ROOT, DASH_N, DASH_S, PULLS,  # root of the pair's mass, coefficients of dashpots, whether they may pull
    GLUED, GLUE_GAP, GLUE_N, GLUE_S, GLUE_M,  # parallel bond: state, gap [m], forces [N], moment [N m]
    GLUE_KN, GLUE_KS, GLUE_TENSION, GLUE_COHESION, GLUE_RADIUS,  # and its parameters
) = (np.uint64(LANES * k) for k in range(COUNT))  # fmt: skip
SIZE = LANES * COUNT
