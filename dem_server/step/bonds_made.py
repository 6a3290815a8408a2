"""Making bonds: contact bonds, and parallel bonds without stress at first, whatever the springs of the contact carry."""

import numpy as np

from dem_server.effects.bond import BONDED
from dem_server.pairs import contacts, listed_pairs
from dem_server.step.masses import set_masses


def add_bonds(model, state):
    """Bond all closed contacts, the ring's too, whose materials have bonds; return how many.

    A contact whose shear force is already beyond the bond's strength stays unbonded: its bond would break
    at once.
    """
    pairs = contacts(state)
    strength = model.law.bond.shear[pairs.kind]
    chosen = pairs.slot[(pairs.gap < 0.0) & (strength > 0.0) & (np.abs(pairs.shear_force) <= strength)]
    state.bond_state[chosen] = BONDED
    return len(chosen)


def add_parallel_bonds(model, state, chosen=None):
    """Give parallel bonds to all closed contacts whose materials have them; returns how many were made.

    chosen: instead of the closed ones, a function of the listed pairs (`dem_server.pairs.Contacts`) that tells which (m,), apart
    or not. Contacts that are bonded, or were, stay as they are.
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
