"""Formation of contact bonds, and of parallel bonds without initial stress."""

import numpy as np

from dem_server.effects.bond import BONDED, NONE
from dem_server.pairs import contacts, listed_pairs
from dem_server.step.masses import set_masses


def add_bonds(model, state):
    """Bonds all closed contacts, also those of the ring, whose materials have bonds; returns their number.

    A contact whose shear force exceeds the bond's strength stays unbonded: its bond would break immediately.
    """
    pairs = contacts(state)
    strength = model.law.bond.shear[pairs.kind]
    chosen = pairs.slot[(pairs.gap < 0.0) & (strength > 0.0) & (np.abs(pairs.shear_force) <= strength)]
    _fasten(state, chosen)
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
    bonds.state[slot], bonds.reported[slot] = BONDED, 0
    set_masses(model, state)
    return len(slot)


def bond_from_now_on(model, state, before, gap=None):
    """Makes the bonds with which a changed law begins; returns their number, contact bonds and parallel bonds together.

    before: the Law before the change. Without `gap`, pairs of kinds that had no bonds are bonded where they touch. With a
    `gap` [m], all pairs of kinds with bonds are bonded up to this gap, also where a bond is broken. A new bond changes no force:
    the spring of a pair that does not touch gets the gap at which the pair is bonded as its reference gap.
    """
    law, made = model.law, 0
    if law.bond is not None:
        pairs = listed_pairs(state)
        kinds = _that_begin(law.bond.shear, None if before.bond is None else before.bond.shear, gap)
        weak = np.abs(state.shear) > law.bond.shear[pairs.kind]  # such a bond would break at once
        chosen = _within(pairs, gap) & kinds[pairs.kind] & (state.bond_state != BONDED) & ~weak
        apart = chosen & (pairs.gap >= 0.0)
        if apart.any():
            state.reference_gap = np.zeros(len(chosen)) if state.reference_gap is None else state.reference_gap
            state.reference_gap[apart] += pairs.gap[apart]
        _fasten(state, chosen)
        made += int(chosen.sum())
    if law.parallel_bond is not None:
        bonds, radius = state.parallel, law.parallel_bond.radius
        kinds = _that_begin(radius, None if before.parallel_bond is None else before.parallel_bond.radius, gap)
        if gap is not None:
            bonds.state[bonds.state != BONDED] = NONE
        made += add_parallel_bonds(model, state, lambda pairs: _within(pairs, gap) & kinds[pairs.kind])
    return made


def _fasten(state, chosen):
    """Makes contact bonds; a later break of theirs is not reported yet."""
    state.bond_state[chosen], state.bond_reported[chosen] = BONDED, 0


def _that_begin(now, before, gap):
    """(kinds,) whether bonds are made at contacts of a kind: of those with bonds, that had none or, with a gap, all."""
    had = np.zeros(len(now), dtype=bool) if before is None or gap is not None else before > 0.0
    return (now > 0.0) & ~had


def _within(pairs, gap):
    """(m,) whether the discs of a pair touch, or are no farther apart than `gap` [m]."""
    return (pairs.gap < 0.0) | ((pairs.gap <= gap) if gap is not None else False)
