"""Discs from a file (coupler_protocol/disc_file.py): free discs of their own, stones among them, or the packing of a window.

Stones of a file have no polygons. A clump has the area A, the centroid and the radius of gyration of the *union* of its discs:
where they overlap the stone counts once, gaps between them count as none. It weighs density x A, shared among its discs by their
areas. Discs of a cluster weigh what they weigh, and all near pairs of one stone are bonded.

The overlaps of a file are stored energy, which real time sets free. With the overlap d of two discs of the contact stiffness kn

    E = sum kn d^2 / 2                                                           (1)

is reported. Where an overlap is larger than BURST of the smaller radius a first stage in real time is refused: the two would
part at about d sqrt(kn / m). Before a static stage such discs are drawn apart by steps from rest, x += F / m, so that none of
that energy becomes motion, until no overlap is larger than LEFT, or the walls do not let them.
"""

from dataclasses import replace

import numpy as np
import shapely
from scipy.spatial import cKDTree

from coupler_protocol import disc_file
from coupler_protocol.problems import unfit
from dem_server import cycle, stones
from dem_server.clumps import make_clumps
from dem_server.contacts import contact_forces
from dem_server.effects import SOIL, STONE
from dem_server.fields import listed_pairs
from dem_server.model import CAPS, SPIN, VX, build_model
from dem_server.motion import move_free
from dem_server.neighbours import rebuild
from dem_server.packing import Packing
from dem_server.polygons import moments

BURST = 0.1  # of the smaller radius: largest overlap of two discs that may begin as they are
LEFT = 1e-3  # of the smaller radius: largest overlap that is left of larger ones than BURST
APART, LOOK = 5000, 50  # steps of drawing apart at most, and after how many it is looked whether they still help
SAME = 1e-6  # of the smaller radius: centres nearer than this are one place, and a contact has no direction
RING_OVERLAP = 0.2  # of the smaller radius: largest overlap of a window's discs with the ring
QUARTER = 32  # corners of a quarter of a circle in a union


def free_discs(scene):
    """Model, State and report of the discs of `scene.discs.file` without a ring."""
    discs, found = scene.discs, disc_file.read(scene.discs.file)
    pairs, depth = overlaps(found.xy, found.radius, found.stone)
    smaller = found.radius[pairs].min(axis=1)
    refuse_same_place(discs.file, found, pairs, depth, smaller)
    refuse_on_walls(discs.file, found, discs.wall)
    if scene.stage[1].time == "real":
        refuse_burst(discs.file, found, pairs, depth, smaller)
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
        set_going(state.clumps, state, found.motion)
    state.dt, state.next_dt = 0.0, np.inf
    kind = model.material[pairs[:, 0]] * model.materials + model.material[pairs[:, 1]]
    energy = float(0.5 * (model.law.spring.normal[kind] @ depth**2))  # Eq (1)
    report = {"file": discs.file, "overlap_energy": energy, "largest_overlap": float((depth / smaller).max(initial=0.0))}
    return replace(model, real_time=discs.time_step), state, report


def of_window(scene, ring):
    """Packing of a window in its `ring` (coupler_protocol.interface.Ring) from `scene.discs.file`, checked to fit into it."""
    path = scene.discs.file
    found = disc_file.read(path)
    if found.stone is not None:
        raise unfit("discs.file", f"{path} has stones", "in a scene with a grid they come from [stones]: leave the column out")
    pairs, depth = overlaps(found.xy, found.radius, None)
    refuse_same_place(path, found, pairs, depth, found.radius[pairs].min(axis=1))
    outside = np.flatnonzero(~shapely.contains_xy(shapely.Polygon(ring.xy), found.xy))
    if len(outside):
        why = f"{len(outside)} of {len(found.radius)} discs of {path} lie outside the window, the first is disc {outside[0] + 1}"
        raise unfit("discs.file", why, "the file's coordinates are those of the grid")
    refuse_ring_overlaps(path, found, ring)
    return Packing(found.xy, found.radius)


def refuse_ring_overlaps(path, found, ring):
    """Discs of a file that lie deep in the control discs were packed for another window."""
    reach = float(ring.radius.max() + found.radius.max())
    near = cKDTree(ring.xy).sparse_distance_matrix(cKDTree(found.xy), reach, output_type="ndarray")
    smaller = np.minimum(ring.radius[near["i"]], found.radius[near["j"]])
    deep = (ring.radius[near["i"]] + found.radius[near["j"]] - near["v"]) / smaller
    if (deep > RING_OVERLAP).any():
        worst, count = int(near["j"][deep.argmax()]), int((deep > RING_OVERLAP).sum())
        why = f"{count} overlaps of {path} with the ring's control discs are larger than {RING_OVERLAP:g} of the smaller radius; "
        why += f"the worst is {deep.max():.2g}, of disc {worst + 1}"
        raise unfit("discs.file", why, "export discs from a run whose window has this shape and whose discs have this radius")


def overlaps(xy, radius, stone):
    """Pairs (m, 2) of discs that overlap, but not of one stone, and by how much (m,) [m]."""
    pairs = cKDTree(xy).query_pairs(2.0 * radius.max(), output_type="ndarray")
    depth = radius[pairs].sum(axis=1) - np.hypot(*(xy[pairs[:, 1]] - xy[pairs[:, 0]]).T)
    there = depth > 0.0
    if stone is not None:
        there &= (stone[pairs] < 0).any(axis=1) | (stone[pairs[:, 0]] != stone[pairs[:, 1]])
    return pairs[there], depth[there]


def refuse_same_place(path, found, pairs, depth, smaller):
    """A contact of two discs in one place has no direction."""
    same = np.flatnonzero(found.radius[pairs].sum(axis=1) - depth < SAME * smaller)
    if len(same):
        i, j = pairs[same[0]] + 1
        why = f"{path}: discs {i} and {j} are in the same place" + (f", and {len(same) - 1} more pairs" if len(same) > 1 else "")
        raise unfit("discs.file", why, "remove one of them, or move it")


def refuse_on_walls(path, found, walls):
    """A contact of a wall with a disc whose centre lies on it has no direction."""
    centres = shapely.points(found.xy)
    for k, wall in enumerate(walls, start=1):
        on = np.flatnonzero(shapely.distance(shapely.LineString(wall.ends), centres) < SAME * found.radius)
        if len(on):
            why = f"{path}: the centre of disc {on[0] + 1} lies on wall {wall.name or k}"
            raise unfit("discs.file", why, "move the wall, or the disc to the side where it belongs")


def refuse_burst(path, found, pairs, depth, smaller):
    """Overlaps that would part like an explosion."""
    deep = depth / smaller
    if (deep > BURST).any():
        worst = int(deep.argmax())
        (i, j), count = pairs[worst] + 1, int((deep > BURST).sum())
        why = f"{path}: discs {i} and {j} overlap by {deep[worst]:.2g} of the smaller radius, {count} pairs by more than "
        why += f"{BURST:g}: in real time they would burst apart"
        raise unfit("discs.file", why, 'begin with a static stage (leave time = "real" out of it), or mend the file')


def draw_apart(model, state):
    """Draw discs apart that overlap by more than BURST, walls held; returns the model, in static mode, and what is left of it.

    The shear that the contacts have seen by then is forgotten.
    """
    deepest = largest_overlap(state)
    if deepest <= BURST:
        return model, {}
    model, steps, before = cycle.in_static_mode(model, state), 0, np.inf
    contact_forces(model, state)
    while steps < APART and deepest > LEFT and deepest < 0.99 * before:
        for _ in range(LOOK):
            move_free(model, state, 0.0)
            cycle.stop(state)
            contact_forces(model, state)
        steps, before, deepest = steps + LOOK, deepest, largest_overlap(state)
    if state.shear is not None:
        state.shear[:] = 0.0
    state.counters[CAPS] = 0
    return model, {"drawn_apart_steps": steps, "overlap_left": deepest}


def largest_overlap(state):
    """Largest overlap of two listed discs over the smaller radius [-]."""
    pairs = listed_pairs(state)
    smaller = np.minimum(state.radius[pairs.disc_a], state.radius[pairs.disc_b])
    return float((-pairs.gap / smaller).max(initial=0.0))


def make_stones(model, state, stone, discs):
    """Discs with the numbers `stone` (n,) become stones, rigid or bonded as `discs.body` says; returns the new model."""
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
        shapes = [shape_of(state.x[state.stone == k], state.radius[state.stone == k]) for k in range(len(numbers))]
        solid = np.array([shape[0] for shape in shapes])
        discs_area = np.bincount(own, weights=area[inside])
        state.weight[inside] *= (solid / discs_area)[own]
        state.clumps = make_clumps(state.stone, state.x, *(np.array(column) for column in list(zip(*shapes, strict=True))[1:]))
    rebuild(model, state)
    if discs.body == "cluster":
        stones.fasten(model, state)
    contact_forces(model, state)
    return model


def shape_of(xy, radius):
    """Area [m2], centroid (2,) and squared radius of gyration [m2] of the union of discs.

    Circles are polygons of the circles' areas.
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


def set_going(clumps, state, motion):
    """Give every clump the mean motion of its discs: their spin, and the velocity of its centroid."""
    for c in range(len(clumps.motion)):
        own = clumps.member[clumps.start[c] : clumps.start[c + 1]]
        spin = motion[own, 2].mean()
        arm = state.x[own] - clumps.motion[c, :2]
        clumps.motion[c, 4] = spin
        clumps.motion[c, 2:4] = (motion[own, :2] - spin * np.column_stack([-arm[:, 1], arm[:, 0]])).mean(axis=0)
