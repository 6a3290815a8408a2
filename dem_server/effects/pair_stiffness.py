"""Stiffness and dashpots of one pair: contributions of all effects to the springs between two discs, or disc and wall.

    kn = spring + parallel bond,   ks = spring + parallel bond,   kr = rolling spring + bending of the bond      (1)
    cn = 2 beta_n sqrt(m kn),      cs = 2 beta_s sqrt(m ks)                                                      (2)

Masses, the stable step, the mass rule of the interface and walls use these functions, so the contribution of an effect is written
once. The functions take one pair (compiled, dem_server/step/compiled_laws.py) or arrays of pairs. An absent effect is None.
"""

from dem_server.effects.parallel_bond import bending_stiffness, bond_radius
from dem_server.effects.rolling import rolling_stiffness


def pair_stiffness(kind, rolling_radius, smaller, bonded, spring, rolling, parallel_bond):
    """kn, ks [N/m], kr [N m] of pairs of the kinds `kind`, Eqs (1).

    rolling_radius: Rb of rolling.py [m]; smaller: radius of the smaller disc [m]; bonded: whether a parallel bond is intact;
    then the tables of the law.
    """
    kn, ks, kr = spring.normal[kind], spring.shear[kind], 0.0
    if rolling is not None:
        kr = kr + rolling_stiffness(ks, rolling_radius)
    if parallel_bond is not None:
        R = bonded * bond_radius(parallel_bond.radius[kind], smaller)
        kn = kn + 2.0 * R * parallel_bond.normal[kind]
        ks = ks + 2.0 * R * parallel_bond.shear[kind]
        kr = kr + bending_stiffness(parallel_bond.normal[kind], R)
    return kn, ks, kr


def pair_dashpots(kind, root_mass, dashpot):
    """cn, cs [N s/m] of pairs of the kinds `kind`, Eqs (2); root_mass: sqrt(m) [kg^0.5]."""
    return root_mass * dashpot.normal[kind], root_mass * dashpot.shear[kind]
