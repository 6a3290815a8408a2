"""Formation of contact bonds, and of parallel bonds without initial stress."""

import numpy as np

from dem_server.effects.bond import BONDED
from dem_server.pairs import contacts, listed_pairs
from dem_server.step.masses import set_masses


def add_bonds(model, state):
    """Bonds all closed contacts, also those of the ring, whose materials have bonds; returns their number.

    A contact whose shear force exceeds the bond's strength stays unbonded: its bond would break immediately.
    """
    pairs = contacts(state)
    strength = model.law.bond.shear[pairs.kind]
    chosen = pairs.slot[(pairs.gap < 0.0) & (strength > 0.0) & (np.abs(pairs.shear_force) <= strength)]
    state.bond_state[chosen] = BONDED
    return len(chosen)


def add_parallel_bonds(model, state, chosen=None):
    """Makes parallel bonds at all closed contacts whose materials have them; returns their number.

    chosen: function of the listed pairs (`dem_server.pairs.Contacts`) that returns which pairs (m,) to bond, instead of the
    closed contacts. Contacts that have or had a parallel bond are unchanged.
    """
    pairs, bonds = listed_pairs(state), state.parallel
    there = pairs.gap < 0.0 if chosen is None else chosen(pairs)
    fresh = there & (model.law.parallel_bond.radius[pairs.kind] > 0.0) & (bonds.state[pairs.slot] == 0)
    slot = pairs.slot[fresh]
    distance = np.hypot(*pairs.branch[fresh].T)
    bonds.gap[slot] = distance - state.radius[pairs.disc_a[fresh]] - state.radius[pairs.disc_b[fresh]]
    bonds.state[slot] = BONDED
    set_masses(model, state)
    return len(slot)
