"""Discs of a scene without a grid: a packed polygon, or discs from a CSV file."""

import numpy as np
import shapely

from coupler_protocol.geometry import outline_fault
from coupler_protocol.interface.ring import build_ring
from coupler_protocol.problems import unfit
from coupler_protocol.scene.used_materials import discs_used
from dem_server.model import build_model
from dem_server.packing import packing, packing_from_file
from dem_server.step.contact_pass import contact_forces
from dem_server.stones import bodies
from dem_server.stones.mapped import stones_of

STRAIGHT = 0.025  # of the distance of nodes: largest distance of the rim from a polygon of short sides


def fill(scene, note, of_file=None):
    """Model, State, mesostructure (or None) and report of the discs of `scene`; note(text, fraction): progress.

    of_file: the discs of scene.discs.file (a coupler_protocol.files.disc_csv.DiscFile); None where they are not read yet.
    """
    if scene.discs.file is not None:
        model, state, report = packing_from_file.free_discs(scene, of_file)
        return model, state, None, report
    return packed(scene, note)


def packed(scene, note):
    """Discs packed in the window's polygon inside a ring, which is then removed."""
    discs, nodes = scene.discs, rim_of(scene.window[0].polygon, 4.0 * scene.discs.radius)
    found = None
    if scene.stones is not None:
        rng = np.random.default_rng([scene.seed, 1, *b"stones"])
        found = stones_of(nodes, scene.stones, rng, note, scene.origin)
    ring = build_ring(nodes, discs.radius)
    rng = np.random.default_rng([scene.seed, 1])
    found_discs = packing.pack(nodes, ring.xy, ring.radius, discs, rng, note)
    model, state = bare(scene, found_discs, reference_gap=found is not None)
    report = {"polygon_area": shapely.Polygon(nodes).area} | found_discs.report()
    if found is not None:
        contact_forces(model, state)
        bodies.assign_discs(model, state, found.outlines, discs.stone.density)
        report |= bodies.report(model, state, found, nodes)
        model = bodies.form_stones(model, state, found.outlines, scene.stones.body)
    return model, state, found, report


def bare(scene, discs, reference_gap=False):
    """Model and State of free discs without a ring."""
    return build_model(np.empty((0, 2)), np.empty(0), discs, discs_used(scene), scene.ring, insitu=reference_gap)


def rim_of(polygon, length):
    """Nodes about `length` [m] apart along a polygon (P, 2), counter-clockwise; raises SceneError if it crosses itself."""
    fault = outline_fault(polygon)
    if fault:
        raise unfit("window.polygon", f"the polygon {fault}", "list its corners in order")
    shape = shapely.geometry.polygon.orient(shapely.Polygon(polygon))
    sides = np.hypot(*np.diff(np.array(shape.exterior.coords), axis=0).T)
    if sides.min() < 0.5 * length:  # a curve of many short sides, which control discs cannot follow one by one
        shape = shape.simplify(STRAIGHT * length)
    corners = np.array(shape.exterior.coords)[:-1]
    nodes = []
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        pieces = max(1, round(float(np.hypot(*(b - a))) / length))
        nodes += [a + (b - a) * q / pieces for q in range(pieces)]
    return np.array(nodes)
