"""Discs from a file (coupler_protocol/files/disc_csv.py): free discs with or without stones, or the packing of a window.

Stones of a file have no polygons. A clump has the area A, the centroid and the radius of gyration of the *union* of its discs:
overlaps count once, and gaps do not count. It weighs density x A, which is distributed to its discs as in bodies.py, so that its
weight acts at its centroid. Discs of a cluster have their own weights, and all near pairs of one stone are bonded. Overlaps:
discs_of_a_file.py, draw_apart.py.
"""

from dataclasses import replace

import numpy as np
import shapely

from coupler_protocol.files import disc_csv
from coupler_protocol.geometry import moments
from coupler_protocol.problems import unfit
from dem_server.effects import SOIL, STONE
from dem_server.model import SPIN, VX, VY, Y, build_model
from dem_server.packing import discs_of_a_file
from dem_server.packing.packing import Packing
from dem_server.pairs import listed_pairs
from dem_server.step.clumps import make_clumps
from dem_server.step.contact_pass import contact_forces
from dem_server.step.neighbours import rebuild
from dem_server.stones import bodies

QUARTER = 32  # corners of a quarter of a circle in a union


def free_discs(scene, found=None):
    """Model, State and report of the discs of `scene.discs.file` without a ring; found: its DiscFile, if it has been read."""
    discs, found = scene.discs, found or disc_csv.read(scene.discs.file)
    pairs, depth = discs_of_a_file.pairs_of(found.xy, found.radius, found.stone)
    smaller = found.radius[pairs].min(axis=1)
    discs_of_a_file.refuse_same_place(discs.file, found, pairs, depth, smaller)
    discs_of_a_file.refuse_on_walls(discs.file, found, discs.wall)
    if scene.stage[1].in_real_time:
        discs_of_a_file.refuse_burst(discs.file, found, pairs, depth, smaller)
        discs_of_a_file.refuse_deep_in_walls(discs.file, found, discs.wall)
    has_stones = found.stone is not None
    if has_stones and discs.stone is None:
        raise unfit("discs.stone", f"{discs.file} has stones, which have no material", "add a [discs.stone] table")
    packing = Packing(found.xy, found.radius)
    cluster = has_stones and discs.body == "cluster"
    model, state = build_model(np.empty((0, 2)), np.empty(0), packing, discs, scene.ring, insitu=cluster)
    if has_stones:
        model = make_stones(model, state, found.stone, discs)
    state.disc[:, VX : SPIN + 1] = found.motion
    if state.clumps is not None:
        set_clump_motion(state.clumps, state, found.motion)
    state.dt, state.next_dt = 0.0, np.inf
    kind = model.material[pairs[:, 0]] * model.materials + model.material[pairs[:, 1]]
    energy = float(0.5 * (model.law.spring.normal[kind] @ depth**2))  # draw_apart.py, Eq (1)
    report = {"file": discs.file, "overlap_energy": energy, "largest_overlap": float((depth / smaller).max(initial=0.0))}
    return replace(model, real_time=discs.time_step), state, report


def of_window(scene, ring):
    """Packing of a window from `scene.discs.file`; raises SceneError if it does not fit into the `ring` (interface.ring.Ring)."""
    path = scene.discs.file
    found = disc_csv.read(path).counted_from(np.array(scene.origin))
    if found.stone is not None:
        raise unfit("discs.file", f"{path} has stones", "in a scene with a grid stones come from [stones]: remove the column")
    pairs, depth = discs_of_a_file.pairs_of(found.xy, found.radius, None)
    smaller = found.radius[pairs].min(axis=1)
    discs_of_a_file.refuse_same_place(path, found, pairs, depth, smaller)
    discs_of_a_file.refuse_deep(path, depth, smaller)
    outside = np.flatnonzero(~shapely.contains_xy(shapely.Polygon(ring.xy), found.xy))
    if len(outside):
        why = f"{len(outside)} of {len(found.radius)} discs of {path} lie outside the window, the first is disc {outside[0] + 1}"
        raise unfit("discs.file", why, "the file's coordinates are those of the grid")
    discs_of_a_file.refuse_ring_overlaps(path, found, ring)
    return Packing(found.xy, found.radius)


def make_stones(model, state, stone, discs):
    """Forms stones from discs with the same number in `stone` (n,), rigid or bonded by `discs.body`; returns the new model."""
    inside = stone >= 0
    numbers, own = np.unique(stone[inside], return_inverse=True)
    state.stone = np.full(model.count, -1, dtype=np.int32)
    state.stone[inside] = own
    material = np.where(inside, STONE, SOIL).astype(model.material.dtype)
    density = np.where(inside, discs.stone.density, model.density)
    model = replace(model, material=material, density=density)
    area = np.pi * state.radius**2
    state.weight[:] = density * area
    if discs.body == "clump":
        members = [np.flatnonzero(state.stone == k) for k in range(len(numbers))]
        shapes = [shape_of(state.x[i], state.radius[i]) for i in members]
        for i, (solid, centroid, _) in zip(members, shapes, strict=True):
            shares = bodies.weight_shares(state.x[i], area[i] / area[i].sum(), centroid)
            state.weight[i] = discs.stone.density * solid * shares
        centroid, gyration = (np.array([shape[column] for shape in shapes]) for column in (1, 2))
        state.clumps = make_clumps(state.stone, state.x, centroid, gyration)
    rebuild(model, state)
    if discs.body == "cluster":
        bodies.bond_stones(model, state)
        pairs = listed_pairs(state)
        own = bodies.in_same_stone(state, pairs)
        state.reference_gap[pairs.slot[own]] += pairs.gap[own]  # a stone has no stress in the shape of the file
    contact_forces(model, state)
    return model


def shape_of(xy, radius):
    """Area [m2], centroid (2,) and squared radius of gyration [m2] of the union of discs.

    Circles are replaced by polygons of equal area.
    """
    corner = 0.5 * np.pi / QUARTER
    equal = radius * np.sqrt(corner / np.sin(corner))
    union = shapely.union_all(shapely.buffer(shapely.points(xy), equal, quad_segs=QUARTER))
    parts = []
    for polygon in shapely.get_parts(union):
        whole = shapely.geometry.polygon.orient(polygon)
        parts += [(1.0, moments(np.array(whole.exterior.coords)[:-1]))]
        parts += [(-1.0, moments(np.array(hole.coords)[-2::-1])) for hole in whole.interiors]
    area = sum(sign * part.area for sign, part in parts)
    centroid = sum(sign * part.area * part.centroid for sign, part in parts) / area
    polar = sum(sign * part.area * (part.gyration + ((part.centroid - centroid) ** 2).sum()) for sign, part in parts)
    return area, centroid, polar / area


def set_clump_motion(clumps, state, motion):
    """Sets the motion of every clump to the mean of its discs: their spin, and the velocity of its centroid."""
    for c in range(len(clumps.motion)):
        own = clumps.member[clumps.start[c] : clumps.start[c + 1]]
        spin = motion[own, 2].mean()
        arm = state.x[own] - clumps.motion[c, : Y + 1]
        clumps.motion[c, SPIN] = spin
        clumps.motion[c, VX : VY + 1] = (motion[own, :2] - spin * np.column_stack([-arm[:, 1], arm[:, 0]])).mean(axis=0)
