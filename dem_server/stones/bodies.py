"""Stones on a packing: which discs belong to them, what they weigh, and how they become stiff and whole.

A disc belongs to the stone its centre lies in. A stone weighs density x area of its polygon, however many discs
stand for it, and its discs share that weight so that its centre is the polygon's (else a stone at rest would turn when it
becomes a clump, which weighs at its centroid):

    w_i = W a_i (1 + c.(x_i - x)),   C c = X - x,   C = sum a_i (x_i - x)(x_i - x)^T  (2)

with shares a_i of the discs' area, their centre x = sum a_i x_i and the polygon's X. While the packing is brought to its
stress all discs are as soft as soil; then the stones become stiff without any contact force changing:

    Fn = -k (g - gr) = -k' (g - gr')    hence    gr' = gr + (g - gr) (1 - k/k')  (1)

(without (1) ten times the stiffness would be four to ten times the stress), and shear forces stay as they are.
Last the stones become whole, as rigid clumps or as clusters of bonded discs. The forces between discs of one
stone add up to nothing, so a packing at rest stays at rest.
"""

from dataclasses import replace

import numpy as np
import shapely

from coupler_protocol.geometry import disc_in_polygon, moments
from coupler_protocol.interface.ring import polygon_area
from dem_server.effects import STONE
from dem_server.effects.bond import BONDED
from dem_server.model import SPIN, VX
from dem_server.pairs import contacts, listed_pairs
from dem_server.step.bonds_made import add_parallel_bonds
from dem_server.step.clumps import make_clumps
from dem_server.step.contact_pass import contact_forces
from dem_server.step.neighbours import kinds, rebuild

LEAST = 0.8  # share of its weight that a disc may at most give to others of its stone


def mark(model, state, outlines, density):
    """Give the free discs inside the polygons `outlines` to their stones, with their weight; `density` [kg/m3]."""
    state.stone = np.full(model.count, -1, dtype=np.int32)
    xy, area = state.x[model.ring :], state.radius**2
    for k, outline in enumerate(outlines):
        inside = model.ring + np.flatnonzero(shapely.contains_xy(shapely.Polygon(outline), xy))
        state.stone[inside] = k
        if len(inside):
            shares = weight_shares(state.x[inside], area[inside] / area[inside].sum(), moments(outline).centroid)
            state.weight[inside] = density * polygon_area(outline) * shares


def weight_shares(xy, area, centroid):
    """Eq (2): shares (m,) of a stone's weight for discs at xy (m, 2) with shares `area` (m,); as near as few discs can."""
    centre = area @ xy
    arm = xy - centre
    tilt = arm @ (np.linalg.pinv((arm * area[:, None]).T @ arm, rcond=1e-9) @ (centroid - centre))
    return area * (1.0 + tilt * min(1.0, LEAST / max(-tilt.min(), LEAST)))


def make(model, state, outlines, body):
    """Make the marked discs stones: stiff, and whole as `body` says ("clump" or "cluster"). Returns the new model."""
    state.disc[:, VX : SPIN + 1] = 0.0
    model = harden(model, state)
    if body == "clump":
        shapes = [moments(outline) for outline in outlines]
        centroid, gyration = np.array([s.centroid for s in shapes]), np.array([s.gyration for s in shapes])
        state.clumps = make_clumps(state.stone, state.x, centroid, gyration)
    else:
        fasten(model, state)
    rebuild(model, state)
    contact_forces(model, state)
    return model


def harden(model, state):
    """Stones get their material, contact forces stay, Eq (1). Returns the new model."""
    material = np.where(state.stone >= 0, STONE, model.material).astype(model.material.dtype)
    pairs, stiffness = contacts(state), model.law.spring.normal
    state.kind = kinds(material, model.materials, state.first, state.second)
    now = stiffness[state.kind[pairs.slot]]
    state.reference_gap[pairs.slot] += pairs.gap * (1.0 - stiffness[pairs.kind] / now)
    return replace(model, material=material)


def fasten(model, state):
    """Bond all near pairs of discs of one stone; pairs that were apart carry no force."""
    pairs = listed_pairs(state)
    own = of_one_stone(state, pairs)
    if state.bond_state is not None:
        own &= model.law.bond.shear[STONE * model.materials + STONE] > 0.0
        apart = own & (pairs.gap >= 0.0) & (pairs.bond_state != BONDED)
        state.reference_gap[pairs.slot[apart]] += pairs.gap[apart]
        state.bond_state[pairs.slot[own]] = BONDED
    if state.parallel is not None:
        add_parallel_bonds(model, state, lambda pairs: of_one_stone(state, pairs))


def of_one_stone(state, pairs):
    """Which pairs (m,) are of discs of one stone."""
    return (state.stone[pairs.disc_a] >= 0) & (state.stone[pairs.disc_a] == state.stone[pairs.disc_b])


def report(model, state, found, window):
    """Numbers for the run's report: stones, those too small for any disc, both contents, gaps inside, sizes, directions.

    window (P, 2): its corners. Gaps between the discs of stones count in a porosity of discs; less their share of the window, it
    is that of solid stones. The resultant of the directions is |<exp(2 i theta)>|, 0 for axes all round, 1 for parallel ones.
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
    """Area of the stones' polygons less that of their discs [m2], and of soil discs inside; held (stones,): number of discs."""
    total, soil = -np.pi * float((state.radius[state.stone >= 0] ** 2).sum()), state.stone < 0
    for outline in (outline for outline, count in zip(outlines, held, strict=True) if count):
        low, high = outline.min(axis=0), outline.max(axis=0)
        reach = state.radius[soil, None]
        near = ((state.x[soil] + reach > low) & (state.x[soil] - reach < high)).all(axis=1)
        cut = disc_in_polygon(state.x[soil][near], state.radius[soil][near], np.vstack([outline, outline[:1]]))
        total += polygon_area(outline) - float(cut.sum())
    return total
