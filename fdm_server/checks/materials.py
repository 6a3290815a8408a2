"""Zones and area of every material, against what the scene draws.

Zones take the material that holds their centre, so a mesh follows a layer only as far as its zones do. The shape of a material is
what later materials leave of its region, or of the ground below its `top`, in the ground as drawn. Of this shape

    area:       the zones' differs by more than AREA, or the weight of the whole ground by more than WEIGHT
    thickness:  less than THIN zones across: the short side t of the rectangle of its area A and perimeter P,
                t^2 - t P/2 + A = 0, and not more than the largest circle inside
    pieces:     the largest piece of zones is smaller than WHOLE of the largest part of the shape

are doubted; a shape with an area in the ground and without any zone is refused.
"""

from typing import NamedTuple

import numpy as np
import shapely

from coupler_protocol.geometry import spot_on
from coupler_protocol.scene.local_origin import local
from fdm_server.mesh.grid import areas, build_grid
from fdm_server.mesh.zone_sides import boundary_edges, closed_loops, pieces

AREA = 0.05  # of the area drawn
WEIGHT = 0.01  # of the weight of the ground
THIN = 2.0  # zones across
WHOLE = 0.8  # of the area of the largest part drawn: what the largest piece of zones has at least
NOTHING = 1e-9  # of the ground's area: round-off


class Laid(NamedTuple):
    """A material as drawn and as meshed."""

    name: str
    zones: int
    area: float  # [m2] of its zones
    drawn: float  # [m2] of its shape in the ground
    shape: shapely.Geometry


def laid_out(scene, grid):
    """Every material of the scene as drawn and as meshed, in order."""
    ground, size = ground_of(scene, grid), areas(grid.xy, grid.zones)
    shapes = [ground.intersection(_drawn(material, ground)) for material in scene.material]
    found, later = [], shapely.Polygon()
    for index in reversed(range(len(shapes))):
        own = shapes[index].difference(later)
        later = later.union(shapes[index])
        mine = grid.material == index
        found.append(Laid(scene.material[index].name, int(mine.sum()), float(size[mine].sum()), own.area, own))
    return found[::-1]


def ground_of(scene, grid):
    """The ground as drawn: below the profile; the outline of the zones where there is none."""
    g = scene.grid
    if g.kind == "slope" and not g.regular:
        return shapely.Polygon([*g.profile, (g.profile[-1][0], 0.0), (g.profile[0][0], 0.0)])
    loops = [shapely.Polygon(grid.xy[loop]) for loop in closed_loops(boundary_edges(grid.zones))]
    outer = max(loops, key=lambda loop: loop.area)
    return outer.difference(shapely.union_all([loop for loop in loops if loop is not outer]))


def _drawn(material, ground):
    """The polygon of a material, without the ground's outline."""
    x0, y0, x1, y1 = ground.bounds
    if material.region is not None:
        return shapely.Polygon(material.region)
    if material.top is None:
        return shapely.box(x0, y0, x1, y1)
    x, y = np.transpose(material.top)
    at = np.unique(np.concatenate([[x0, x1], x[(x > x0) & (x < x1)]]))
    line = np.column_stack([at, np.interp(at, x, y)])
    return shapely.Polygon([*line, (x1, min(y0, line[:, 1].min()) - 1.0), (x0, min(y0, line[:, 1].min()) - 1.0)])


# -- rules and doubts ----------------------------------------------------------------------------------------------------


def materials_have_zones(scene, grid):
    """Refusals (path, what, remedy): materials that are drawn and that no zone has."""
    for index, found in enumerate(laid_out(scene, grid)) if len(scene.material) > 1 else ():
        if found.zones:
            continue
        material, ground = scene.material[index], ground_of(scene, grid)
        at = ("material", index)
        if found.drawn > NOTHING * ground.area:
            what = f"no zone has material {found.name!r}, which is drawn with {found.drawn:.3g} m2"
            yield at, what, f"use zones of at most {_thickness(found.shape) / THIN:.2g} m there, or remove the material"
        elif ground.intersection(_drawn(material, ground)).area <= NOTHING * ground.area:
            x0, y0, x1, y1 = (spot_on(v, start) for v, start in zip(ground.bounds, 2 * grid.origin, strict=True))
            what = f"no zone has material {found.name!r}: it is drawn outside of the ground"
            yield at, what, f"the ground is x {x0} to {x1}, y {y0} to {y1} m: move it there, or remove the material"


def doubts_of_materials(scene, grid):
    """Doubts (path, what, remedy) about how zones follow the materials drawn."""
    laid = laid_out(scene, grid)
    whole = sum(found.drawn * m.density for found, m in zip(laid, scene.material, strict=True))
    for index, found in enumerate(laid) if len(laid) > 1 else ():
        path = ("material", index, "top" if scene.material[index].top is not None else "region")
        if not found.zones:
            yield path[:2], f"later materials cover all of material {found.name!r}", "remove it, or draw them smaller"
            continue
        width = _zone_width(grid, found)
        thickness = _thickness(found.shape)
        if index and thickness < THIN * width * (1.0 - 1e-6):
            what = f"material {found.name!r} is {thickness:.3g} m thick, {thickness / width:.2g} zones of {width:.3g} m: "
            what += "too thin to shear or to bend like a layer"
            yield path, what, f"use zones of at most {thickness / THIN:.2g} m there, or draw it thicker"
        mine = grid.material == index
        piece = pieces(grid.zones[mine])
        largest = np.bincount(piece, areas(grid.xy, grid.zones[mine])).max()
        if index and largest < WHOLE * max(part.area for part in _parts(found.shape)):
            what = f"zones of material {found.name!r} lie in {piece.max() + 1} pieces, drawn in {len(_parts(found.shape))}"
            yield path, what, f"use zones of at most {min(thickness / THIN, 0.5 * width):.2g} m there"
        yield from _misfit(scene, grid, path, found, whole)


def _misfit(scene, grid, path, found, whole):
    """The doubt about an area or a weight that differs from the one drawn."""
    material = scene.material[path[1]]
    if found.drawn <= 0.0:
        return
    error = found.area / found.drawn - 1.0
    weight = (found.area - found.drawn) * (material.density - scene.material[0].density) / whole
    if path[1] and (abs(error) > AREA or abs(weight) > WEIGHT):
        what = (
            f"zones of material {found.name!r} have {found.area:.4g} m2, {100 * error:+.2g} % of the {found.drawn:.4g} m2 drawn"
        )
        what += f" ({100 * weight:+.2g} % of the weight of the ground)" if abs(weight) > 1e-4 else ""
        level = material.top is not None and len({y for _, y in material.top}) == 1
        if level:
            rows = np.unique(np.round(grid.xy[:, 1], 9))
            y = material.top[0][1]
            below, above = rows[rows <= y].max(initial=rows[0]), rows[rows >= y].min(initial=rows[-1])
            below, above = (spot_on(row, grid.origin[1]) for row in (below, above))
            remedy = f"lay the top on a row of zones ({below} or {above} m), or use a zone size in y that divides {y:g} m"
            remedy += ', or fit = "profile"' if scene.grid.kind == "slope" else ""
        else:
            width = _zone_width(grid, found)
            finer = width / max(abs(error) / AREA, abs(weight) / WEIGHT)
            remedy = f"use zones of about {finer:.2g} m there"
            remedy += ', or fit = "profile", whose zones follow tops' if material.top is not None and scene.grid.regular else ""
        yield path, what, remedy


def _parts(shape):
    """Polygons of a shape that are more than slivers."""
    parts = [part for part in shapely.get_parts(shape) if part.area > 0.0]
    return [part for part in parts if part.area > 1e-6 * shape.area]


def _thickness(shape):
    """Thickness [m] of the thickest part of a shape."""
    return max(map(_thickness_of, _parts(shape)), default=0.0)


def _thickness_of(part):
    circle = 2.0 * shapely.maximum_inscribed_circle(part, tolerance=1e-3 * np.sqrt(part.area)).length
    half = 0.25 * part.length
    return min(circle, half - np.sqrt(half**2 - part.area)) if half**2 > part.area else circle


def _zone_width(grid, found):
    """Size [m] of zones across the thickness of a shape: of those that touch it, along the short side of its narrowest box."""
    corners = grid.xy[grid.zones]
    near = shapely.intersects(found.shape, shapely.polygons(corners))
    box = np.ptp(corners[near], axis=1).mean(axis=0) if near.any() else np.ptp(corners, axis=1).mean(axis=0)
    largest = max(_parts(found.shape), key=lambda part: part.area, default=None)
    if largest is None:
        return float(np.hypot(*box) / np.sqrt(2.0))
    frame = np.array(largest.minimum_rotated_rectangle.exterior.coords)
    sides = np.diff(frame, axis=0)[:2]
    short = sides[np.hypot(*sides.T).argmin()]
    across = short / max(np.hypot(*short), 1e-300)
    return float(np.hypot(*(across * box)))


def of_scene(scene):
    """`laid_out` on the scene's own mesh."""
    scene = local(scene)
    return laid_out(scene, build_grid(scene))
