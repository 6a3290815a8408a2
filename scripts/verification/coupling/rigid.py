"""Rim, control discs and free discs in rigid motion: contact forces are constant.

A ring on an oblique, curved rim of 14 unequal segments, filled with a bonded lattice under random normal and shear forces.
Gridpoints are moved as a rigid body, control discs follow them by the mapping, free discs move with them exactly. A
translation does not change contact forces; a rotation by 90 degrees changes them to second order in the step (both tangents of
a contact are taken at mid-step)."""

from types import SimpleNamespace

import numpy as np
import shapely

from coupler_protocol.interface.ring import build_ring
from dem_server.coupling.rim import Rim
from dem_server.effects.bond import BONDED, Bond
from dem_server.model import build_model
from dem_server.step.contact_pass import contact_forces
from verification.coupling.joined import rotation
from verification.discrete.discs import KN, soil_discs
from verification.verdict_rows import row

NAME = "rigid motion"
SOURCE = "identity (objectivity)"
R = 0.05


def filled():
    """Rim, Model and State of the ring and what is in it."""
    rng = np.random.default_rng(7)
    angle = np.sort(np.linspace(0.0, 2.0 * np.pi, 14, endpoint=False) + rng.uniform(0.0, 0.3, 14))
    nodes = np.column_stack([1.1 * np.cos(angle), 0.7 * np.sin(angle)]) @ rotation(0.4).T
    ring = build_ring(nodes, R)
    x, y = (np.arange(-24, 25) * 1.99 * R for _ in range(2))
    xy = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2) @ rotation(0.9).T
    inside = shapely.Polygon(nodes).buffer(-0.8 * R)
    xy = xy[shapely.contains_xy(inside, *xy.T)]
    laws = {"bond": Bond(tension=1e30, shear=1e30), "damping": None}
    packing = SimpleNamespace(xy=xy, radius=np.full(len(xy), R))
    model, state = build_model(ring.xy, ring.radius, packing, soil_discs(**laws))
    contact_forces(model, state)
    state.bond_state[:] = BONDED
    state.shear[:] = rng.normal(0.0, 300.0, len(state.shear))
    contact_forces(model, state)
    return Rim(ring, "work-consistent"), model, state


def forces(state):
    """Normal and shear forces (m,2) of all pairs that were bonded, by their numbers."""
    bonded = state.bond_state == BONDED
    order = np.lexsort((state.second[bonded], state.first[bonded]))
    return np.column_stack([state.normal[bonded], state.shear[bonded]])[order]


def changed(steps, angle, shift):
    """Largest change of a contact force over kn R after so many steps."""
    rim, model, state = filled()
    before, free = forces(state), slice(model.ring, None)
    nodes, discs, centre = rim.nodes.copy(), state.x[free].copy(), np.array([0.3, -0.4])
    for step in range(1, steps + 1):
        turn, moved = rotation(angle * step / steps), np.asarray(shift) * step / steps
        there = centre + moved + (discs - centre) @ turn.T
        state.v[free] = there - state.x[free]
        state.x[free], state.spin[free] = there, angle / steps
        rim.move(state, centre + moved + (nodes - centre) @ turn.T - rim.nodes)
        contact_forces(model, state)
    return np.abs(forces(state) - before).max() / (KN * R)


def rows(fast):
    """A translation, and a quarter turn in 10,000 steps (fast: 2,500) and in fewer."""
    yield row("translation by (0.3, 0.2) m in 1,000 steps, over kn R", changed(1000, 0.0, [0.3, 0.2]), 0.0, 1e-12, SOURCE)
    many = 2500 if fast else 10_000
    fine, coarse = changed(many, 0.5 * np.pi, [0.0, 0.0]), changed(many // 4, 0.5 * np.pi, [0.0, 0.0])
    order = np.log(coarse / fine) / np.log(4.0)
    yield row(f"quarter turn in {many:,} steps, over kn R", fine, 0.0, 1.6e-7 if fast else 1e-8, SOURCE, order=order)
    yield row("order of the change in the step", order, 2.0, 0.05, SOURCE, order=order)
