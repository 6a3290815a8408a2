"""Outlines of stones from a file: GeoJSON, or CSV with the columns stone, x, y (corners in order), as traced from a photograph.

    x_m = x0 + scale x,   y_m = y0 ± scale y                                     (1)

origin (x0, y0): position of the file's (0, 0); minus with `flip_y`, because images count rows downwards. GeoJSON: the exterior
rings of every Polygon and of each part of a MultiPolygon are stones; RFC 7946, in metres or pixels, not degrees.
"""

import csv
import json
from pathlib import Path
from typing import NamedTuple

import numpy as np
import shapely

from coupler_protocol.geometry import outline_fault, polygon_area
from coupler_protocol.scene.local_origin import counted_points
from coupler_protocol.scene.named_files import remedy_for

OVERLAP = 1e-9  # share of the smaller stone that may lie in another one: round-off of shared edges
POLYGONS = {"Polygon", "MultiPolygon"}
REMEDY = "a FeatureCollection of Polygons (.geojson, .json), or a table with the columns stone, x, y (.csv)"


class Outline(NamedTuple):
    """A traced stone: its name in the file, and its corners (V, 2) [m], counter-clockwise."""

    name: str
    corners: np.ndarray


class OutlineError(ValueError):
    """A file that cannot be used; `problems`: list of (problem, remedy)."""

    def __init__(self, path, problems):
        self.problems = [(f"{path}: {why}", remedy) for why, remedy in problems]
        super().__init__("\n".join(f"{why} ({remedy})" for why, remedy in self.problems))


def read_outlines(path, scale=1.0, origin=(0.0, 0.0), flip_y=False, start=(0.0, 0.0)):
    """Reads all stones of a file as Outlines, Eq (1); raises OutlineError with all problems of the file.

    start (2,) [m]: point from which their corners count (coupler_protocol.scene.local_origin).
    """
    rings, problems = _rings(Path(path))
    shapes = {}
    for name, ring in rings:
        shape, problem = _simple(name, ring)
        if problem:
            problems.append(problem)
        else:
            shapes[name] = shape
    if problems or not shapes:
        raise OutlineError(path, problems or [("there is no stone in it", REMEDY)])
    stretch = np.array([scale, -scale if flip_y else scale])
    return [Outline(name, _upright(counted_points(origin + shape * stretch, start))) for name, shape in shapes.items()]


def overlapping(outlines):
    """Names and shared area [m2] of each pair of stones that overlap."""
    shapes = [shapely.Polygon(outline.corners) for outline in outlines]
    first, second = shapely.STRtree(shapes).query(shapes, predicate="intersects")
    for a, b in sorted(zip(first[first < second].tolist(), second[first < second].tolist(), strict=True)):
        shared = shapes[a].intersection(shapes[b]).area
        if shared > OVERLAP * min(shapes[a].area, shapes[b].area):
            yield outlines[a].name, outlines[b].name, shared


def _upright(corners):
    return corners if polygon_area(corners - corners[0]) > 0.0 else corners[::-1].copy()  # also far from the origin


def _simple(name, ring):
    """Corners of a ring without repetitions, and its problem or None."""
    corners = np.asarray(ring, dtype=float)
    if not np.isfinite(corners).all():
        return None, (f"a corner of {name} is not a number", "give two finite numbers for each corner")
    corners = corners[(corners != np.roll(corners, 1, axis=0)).any(axis=1)]
    if len(corners) < 3:
        return None, (f"{name} has {len(corners)} corners", "a stone has three corners or more")
    fault = outline_fault(corners)
    if fault:
        return None, (f"the outline of {name} {fault}", "draw it once around, without crossings")
    return corners, None


def _rings(path):
    """Names and rings of all stones in a file, and its problems."""
    try:
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        if not path.is_file():
            return [], [("there is no such file", remedy_for(path))]
        return [], [(f"cannot be read: {error}", REMEDY)]
    if path.suffix.lower() == ".csv":
        return _from_table(text)
    try:
        data = json.loads(text)
    except ValueError as error:
        return [], [(f"not valid JSON: {error}", REMEDY)]
    return _from_geojson(data)


def _from_geojson(data):
    kind = data.get("type") if isinstance(data, dict) else None
    if kind == "FeatureCollection":
        features = data.get("features")
    else:
        features = [data if kind == "Feature" else {"geometry": data}]
    rings, problems = [], []
    for number, feature in enumerate(features if isinstance(features, list) else [], start=1):
        name = _name_of(feature, number)
        geometry = feature.get("geometry") if isinstance(feature, dict) else None
        kind = geometry.get("type") if isinstance(geometry, dict) else None
        if kind not in POLYGONS:
            problems.append(
                (f"{name} is {'a ' + str(kind) if kind else 'not a geometry'}", "stones are Polygons or MultiPolygons")
            )
            continue
        try:
            parts = [geometry["coordinates"]] if kind == "Polygon" else geometry["coordinates"]
            found = [np.array([_corner(corner) for corner in part[0]], dtype=float).reshape(-1, 2) for part in parts]
        except (KeyError, TypeError, ValueError, IndexError):
            problems.append((f"the coordinates of {name} are not those of a {kind}", "RFC 7946, section 3.1"))
            continue
        rings += [(name if len(found) == 1 else f"{name}, part {k}", ring) for k, ring in enumerate(found, start=1)]
    return rings, problems


def _corner(values):
    """The first two numbers of a position; raises ValueError for texts and truth values, which numpy would convert."""
    x, y = values[:2]
    if any(isinstance(v, bool) or not isinstance(v, int | float) for v in (x, y)):
        raise ValueError("not a number")
    return x, y


def _name_of(feature, number):
    """Name of a feature for messages: its number in the file, and its name or id if it has one."""
    own = None
    if isinstance(feature, dict):
        properties = feature.get("properties")
        own = properties.get("name") if isinstance(properties, dict) else None
        own = feature.get("id") if own is None else own
    return f"feature {number}" + (f" ({own})" if own is not None else "")


def _from_table(text):
    table = csv.DictReader(text.splitlines(), skipinitialspace=True)
    missing = [column for column in ("stone", "x", "y") if column not in (table.fieldnames or ())]
    if missing:
        return [], [(f"column {missing[0]!r} is missing", "a head line with stone, x, y, and one corner a line")]
    rings, problems = {}, []
    for row in table:
        if None in row:
            why = f"line {table.line_num} has more columns than the head line"
            problems.append((why, "stone, x, y: decimals have a point, not a comma"))
            continue
        if not row["stone"]:
            problems.append((f"line {table.line_num} has no stone", "give every corner the number or the name of its stone"))
            continue
        try:
            corner = float(row["x"]), float(row["y"])
            rings.setdefault(row["stone"], []).append(corner)
        except (TypeError, ValueError):
            problems.append((f"line {table.line_num} holds no corner", "stone, x, y"))
    return [(f"stone {name}", ring) for name, ring in rings.items()], problems
