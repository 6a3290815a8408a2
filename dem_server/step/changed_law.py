"""Another law of contacts from a stage on: what becomes of the contacts that exist.

Contacts keep their forces. With the stiffness k before and k' after the change, a normal spring keeps its force if

    Fn = -k (g - gr) = -k' (g - gr')     hence     gr' = gr + (g - gr)(1 - k/k')      (1)

and a parallel bond likewise with its gap g0 and its stiffness kn' A. Shear forces and moments are sums over steps: they stay, and
the limits of the changed law apply from the next pass on. A force that no effect of the law carries any more is zero. Contacts
with walls have no reference gap: their overlap stays, and their force changes with the spring.

Histories of effects that begin are zero; those of effects that end are dropped. Bonds between materials that have none any more
are dissolved, which does not count as breakage.
"""

from dataclasses import replace

import numpy as np

from coupler_protocol.problems import unfit
from dem_server.effects import histories
from dem_server.effects.bond import BONDED, NONE
from dem_server.effects.parallel_bond import bond_radius
from dem_server.pairs import listed_pairs
from dem_server.step.breaks import collect
from dem_server.step.contact_pass import contact_forces
from dem_server.step.neighbours import skin


def with_law(model, state, law):
    """The model with the law `law` and its own damping; changes the histories of the state by the rules above."""
    collect(state)
    old, kind = model.law, state.kind
    _keep_normal_forces(model, state, old.spring.normal[kind], law.spring.normal[kind])
    if state.shear is not None:
        state.shear[law.spring.shear[kind] == 0.0] = 0.0
    if state.bond_state is not None and law.bond is not None:
        state.bond_state[(law.bond.shear[kind] == 0.0) & (old.bond.shear[kind] > 0.0)] = NONE
    if state.parallel is not None and law.parallel_bond is not None:
        _keep_parallel_bonds(state, old.parallel_bond, law.parallel_bond)
    _begin_and_end_histories(state, law)
    return replace(model, law=law._replace(damping=old.damping))


def _keep_normal_forces(model, state, k, new):
    """Sets reference gaps by Eq (1); k, new (m,) [N/m]: stiffnesses of the listed pairs."""
    pairs = listed_pairs(state)
    there = (new != k) & ((pairs.gap < 0.0) | (pairs.bond_state == BONDED))
    if not there.any():
        return
    if state.reference_gap is None:
        state.reference_gap = np.zeros(len(k))
    state.reference_gap[there] += pairs.gap[there] * (1.0 - k[there] / new[there])
    largest = float(state.reference_gap[there].max())
    if largest > skin(model):
        why = f"contacts would have to open by {largest:.3g} m until the softer springs have no force"
        raise unfit("stage.discs", why, f"use stiffer springs, for at most {skin(model):.2g} m (0.3 of the smallest radius)")


def _keep_parallel_bonds(state, old, law):
    """Sets gaps of intact bonds by Eq (1), and removes bonds of kinds that have none any more."""
    bonds, kind = state.parallel, state.kind
    smaller = np.minimum(state.radius[state.first], state.radius[state.second])
    before = old.normal[kind] * bond_radius(old.radius[kind], smaller)
    after = law.normal[kind] * bond_radius(law.radius[kind], smaller)
    ends = (after == 0.0) & (before > 0.0)
    for array in bonds:
        array[ends] = 0
    there = (bonds.state == BONDED) & (before != after)
    gap = np.hypot(*(state.x[state.second[there]] - state.x[state.first[there]]).T)
    gap -= state.radius[state.first[there]] + state.radius[state.second[there]]
    bonds.gap[there] = gap - (gap - bonds.gap[there]) * before[there] / after[there]


def _begin_and_end_histories(state, law):
    """Makes the arrays of effects that begin, and drops those of effects that end."""
    wanted = histories.empty(law, reference_gap=state.reference_gap is not None)
    for name in histories.PairHistory._fields:
        if name not in wanted:
            setattr(state, name, None)
        elif getattr(state, name) is None:
            setattr(state, name, histories.each_array(lambda empty: np.zeros(len(state.first), empty.dtype), wanted[name]))
    if state.walls is not None and (state.walls.rolled is None) != (law.rolling is None):
        rolled = None if law.rolling is None else np.zeros_like(state.walls.shear)
        state.walls = state.walls._replace(rolled=rolled)


def forces_at_rest(model, state):
    """Computes the contact forces of the present positions under a changed law, without a step: no slip, no turn."""
    dt, state.dt = state.dt, 0.0
    contact_forces(model, state)
    state.dt = dt
