"""Stones in a packing: their discs and weights, and how they become stiff and rigid or bonded.

A disc belongs to the stone whose polygon contains its centre. A stone weighs density x area of its polygon, for any number of
discs. The weight is distributed to its discs so that its centre is that of the polygon (else a stone at rest would turn when it
becomes a clump, whose weight acts at the centroid):

    w_i = W a_i (1 + c.(x_i - x)),   C c = X - x,   C = sum a_i (x_i - x)(x_i - x)^T  (2)

with shares a_i of the discs' area, their centre x = sum a_i x_i and the polygon's centroid X. While the packing is brought to
its stress, all discs are as soft as soil. Then the stones become stiff at constant contact forces:

    Fn = -k (g - gr) = -k' (g - gr')    hence    gr' = gr + (g - gr) (1 - k/k')  (1)

(without (1) ten times the stiffness would give four to ten times the stress); shear forces do not change. Finally the stones
become rigid clumps or clusters of bonded discs. The forces between discs of one stone have the sum zero, so a packing at rest
stays at rest.
"""

from dataclasses import replace

import numpy as np
import shapely

from coupler_protocol.geometry import disc_in_polygon, moments, polygon_area
from dem_server.effects import STONE
from dem_server.effects.bond import BONDED
from dem_server.model import SPIN, VX
from dem_server.pairs import contacts, listed_pairs
from dem_server.step.bonds_made import add_parallel_bonds
from dem_server.step.clumps import make_clumps
from dem_server.step.contact_pass import contact_forces
from dem_server.step.neighbours import kinds, rebuild

LEAST = 0.8  # largest share of its weight that a disc may transfer to other discs of its stone


def assign_discs(model, state, outlines, density):
    """Assigns the free discs inside the polygons `outlines` to stones and sets their weights; `density` [kg/m3]."""
    state.stone = np.full(model.count, -1, dtype=np.int32)
    xy, area = state.x[model.ring :], state.radius**2
    for k, outline in enumerate(outlines):
        inside = model.ring + np.flatnonzero(shapely.contains_xy(shapely.Polygon(outline), xy))
        state.stone[inside] = k
        if len(inside):
            shares = weight_shares(state.x[inside], area[inside] / area[inside].sum(), moments(outline).centroid)
            state.weight[inside] = density * polygon_area(outline) * shares


def weight_shares(xy, area, centroid):
    """Shares (m,) of a stone's weight for discs at xy (m, 2) with shares `area` (m,), Eq (2), limited by LEAST."""
    centre = area @ xy
    arm = xy - centre
    tilt = arm @ (np.linalg.pinv((arm * area[:, None]).T @ arm, rcond=1e-9) @ (centroid - centre))
    return area * (1.0 + tilt * min(1.0, LEAST / max(-tilt.min(), LEAST)))


def form_stones(model, state, outlines, body):
    """Forms stones from the assigned discs: stiff, and rigid ("clump") or bonded ("cluster") by `body`. Returns the new model."""
    state.disc[:, VX : SPIN + 1] = 0.0
    model = stiffen_stones(model, state)
    if body == "clump":
        shapes = [moments(outline) for outline in outlines]
        centroid, gyration = np.array([s.centroid for s in shapes]), np.array([s.gyration for s in shapes])
        state.clumps = make_clumps(state.stone, state.x, centroid, gyration)
    else:
        bond_stones(model, state)
    rebuild(model, state)
    contact_forces(model, state)
    return model


def stiffen_stones(model, state):
    """Gives stones their material at constant contact forces, Eq (1). Returns the new model."""
    material = np.where(state.stone >= 0, STONE, model.material).astype(model.material.dtype)
    pairs, stiffness = contacts(state), model.law.spring.normal
    state.kind = kinds(material, model.materials, state.first, state.second)
    now = stiffness[state.kind[pairs.slot]]
    state.reference_gap[pairs.slot] += pairs.gap * (1.0 - stiffness[pairs.kind] / now)
    return replace(model, material=material)


def bond_stones(model, state):
    """Bonds all near pairs of discs of one stone; the bond of a pair without contact has no initial force."""
    pairs = listed_pairs(state)
    own = in_same_stone(state, pairs)
    if state.bond_state is not None:
        own &= model.law.bond.shear[STONE * model.materials + STONE] > 0.0
        apart = own & (pairs.gap >= 0.0) & (pairs.bond_state != BONDED)
        state.reference_gap[pairs.slot[apart]] += pairs.gap[apart]
        state.bond_state[pairs.slot[own]] = BONDED
    if state.parallel is not None:
        add_parallel_bonds(model, state, lambda pairs: in_same_stone(state, pairs))


def in_same_stone(state, pairs):
    """(m,) whether both discs of a pair belong to one stone."""
    return (state.stone[pairs.disc_a] >= 0) & (state.stone[pairs.disc_a] == state.stone[pairs.disc_b])


def report(model, state, found, window):
    """Numbers for the run's report: stones, those too small for any disc, both contents, gaps inside, sizes, directions.

    window (P, 2): its corners. The resultant of the directions is |<exp(2 i theta)>|, 0 for uniform directions, 1 for parallel.
    `stone_gaps` is the area of the stones' polygons that no disc covers, over that of the window: a porosity of discs minus
    `stone_gaps` is the porosity with solid stones.
    """
    free = np.arange(model.count) >= model.ring
    held = np.bincount(state.stone[state.stone >= 0], minlength=len(found.outlines))
    area, axes = state.radius**2, np.exp(2j * found.azimuth).mean()
    return {
        "stones": len(found.outlines),
        "stones_without_discs": int((held == 0).sum()),
        "stone_content": found.area / polygon_area(window),
        "stone_content_discs": float(area[state.stone >= 0].sum() / area[free].sum()),
        "stone_gaps": gaps_inside(state, found.outlines, held) / polygon_area(window),
        "stone_sweeps": found.sweeps,
        "stone_size": {"mean": float(found.size.mean()), "min": float(found.size.min()), "max": float(found.size.max())},
        "stone_azimuth": {"mean": float(0.5 * np.degrees(np.angle(axes)) % 180.0), "resultant": float(abs(axes))},
    }


def gaps_inside(state, outlines, held):
    """Area [m2] of the stones' polygons minus that of their discs and of soil discs inside; held (stones,): number of discs."""
    total, soil = -np.pi * float((state.radius[state.stone >= 0] ** 2).sum()), state.stone < 0
    for outline in (outline for outline, count in zip(outlines, held, strict=True) if count):
        low, high = outline.min(axis=0), outline.max(axis=0)
        reach = state.radius[soil, None]
        near = ((state.x[soil] + reach > low) & (state.x[soil] - reach < high)).all(axis=1)
        cut = disc_in_polygon(state.x[soil][near], state.radius[soil][near], np.vstack([outline, outline[:1]]))
        total += polygon_area(outline) - float(cut.sum())
    return total
