"""Discs of a scene without a grid: a packed polygon, or discs from a CSV file."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import shapely

from coupler_protocol.interface import build_ring
from coupler_protocol.problems import unfit
from dem_server import packing, stones
from dem_server.contacts import contact_forces
from dem_server.mapped import stones_of
from dem_server.model import build_model
from dem_server.packing import Packing

COLUMNS = ("x", "y", "radius")  # needed in a file
MOTION = ("vx", "vy", "spin")  # may follow


def fill(scene, note):
    """Model, State, mesostructure (or None) and report of the discs of `scene`; note(text, fraction): progress."""
    if scene.discs.file is not None:
        return (*from_file(scene), None, {"file": scene.discs.file})
    return packed(scene, note)


def packed(scene, note):
    """The window's polygon, packed as inside a ring, which is then taken away."""
    discs, nodes = scene.discs, rim_of(scene.window[0].polygon, 4.0 * scene.discs.radius)
    found = None
    if scene.stones is not None:
        rng = np.random.default_rng([scene.seed, 1, *b"stones"])
        found = stones_of(nodes, scene.stones, rng, note)
    ring = build_ring(nodes, discs.radius)
    rng = np.random.default_rng([scene.seed, 1])
    found_discs = packing.pack(nodes, ring.xy, ring.radius, discs, rng, note)
    model, state = bare(scene, found_discs, reference_gap=found is not None)
    report = {"polygon_area": shapely.Polygon(nodes).area}
    if found is not None:
        contact_forces(model, state)
        stones.mark(model, state, found.outlines, discs.stone.density)
        report |= stones.report(model, state, found, nodes)
        model = stones.make(model, state, found.outlines, scene.stones.body)
    return model, state, found, report


def bare(scene, discs, reference_gap=False):
    """Model and State of free discs without a ring."""
    return build_model(np.empty((0, 2)), np.empty(0), discs, scene.discs, scene.ring, insitu=reference_gap)


def rim_of(polygon, length):
    """Nodes about `length` [m] apart along a polygon (P, 2), counter-clockwise; raises SceneError if it crosses itself."""
    shape = shapely.Polygon(polygon)
    if not shape.is_valid or shape.area <= 0.0:
        raise unfit("window.polygon", "the polygon crosses itself or has no area", "list its corners in order")
    corners = np.array(shapely.geometry.polygon.orient(shape).exterior.coords)[:-1]
    nodes = []
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        pieces = max(1, round(float(np.hypot(*(b - a))) / length))
        nodes += [a + (b - a) * q / pieces for q in range(pieces)]
    return np.array(nodes)


def from_file(scene):
    """Model and State of the discs in a CSV file with a head line: x, y, radius and, if wanted, vx, vy, spin in m/s, rad/s.

    So they begin in real time; a static stage brings them to rest first.
    """
    path = scene.discs.file
    if not Path(path).is_file():
        raise unfit("discs.file", f"there is no file {path}", "paths count from where the program was started")
    try:
        table = np.atleast_1d(np.genfromtxt(path, delimiter=",", names=True, dtype=float))
    except ValueError as error:
        raise unfit("discs.file", f"{path} is no table: {error}", "columns x, y, radius with a head line") from None
    names = table.dtype.names or ()
    missing = [name for name in COLUMNS if name not in names]
    strange = [name for name in names if name not in COLUMNS + MOTION]
    if missing or strange:
        what = f"column {(missing or strange)[0]!r} is {'missing' if missing else 'not known'}"
        raise unfit("discs.file", f"{path}: {what}", f"columns: {', '.join(COLUMNS + MOTION)}")
    values = np.column_stack([table[name] for name in names])
    if not np.isfinite(values).all() or (table["radius"] <= 0.0).any():
        raise unfit("discs.file", f"{path}: a number is missing, or a radius is not positive", "one disc a line")
    model, state = bare(scene, Packing(np.column_stack([table["x"], table["y"]]), np.asarray(table["radius"])))
    for column, name in enumerate(MOTION, start=2):
        if name in names:
            state.disc[:, column] = table[name]
    state.dt, state.next_dt = 0.0, np.inf
    return replace(model, real_time=scene.discs.time_step), state
