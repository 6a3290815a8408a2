"""Rows of the scratch memory in which a block of contacts is computed: one quantity a row, one contact a column.

All rows are in one array, `LANES` numbers each, so the compiler can see that they do not overlap. The first rows are those of the
parameters (dem_server/effects/parameter_table.py). Rows of absent effects are not used.
"""

import numpy as np

from dem_server.effects import parameter_table

LANES = np.uint64(64)  # contacts in a block: all rows of all effects fit into the first-level cache


def _parameters(effect):
    """Number of the first row of an effect's parameters."""
    return tuple(row * LANES for row in parameter_table.rows_of(effect))


KN, KS = _parameters("spring")
(FRICTION,) = _parameters("friction")
TENSION, STRENGTH = _parameters("bond")
(ROLLING,) = _parameters("rolling")
DASH_N, DASH_S, PULLS = _parameters("dashpot")
GLUE_KN, GLUE_KS, GLUE_TENSION, GLUE_COHESION, GLUE_RADIUS = _parameters("parallel_bond")

OTHERS = 23
(
    DX, DY, DU, DV,  # of the second disc against the first: place [m], velocity
    RI, RJ, WI, WJ,  # radii [m] and spins
    GAP, FN, SHEAR, PX, PY,  # reference gap [m]; forces [N] along normal and tangent, in x and y, on the second disc
    MI, MJ,  # moments [N m]: -MI on the first disc, -MJ on the second
    BONDED, ROLLED, ROOT,  # state of the contact bond, moment of rolling [N m], root of the pair's mass
    GLUED, GLUE_GAP, GLUE_N, GLUE_S, GLUE_M,  # parallel bond: state, gap [m], forces [N], moment [N m]
) = (LANES * np.uint64(len(parameter_table.ROWS) + k) for k in range(OTHERS))  # fmt: skip
SIZE = int(LANES) * (len(parameter_table.ROWS) + OTHERS)
