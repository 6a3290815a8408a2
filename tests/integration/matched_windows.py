"""Windows at the ground surface whose packing has the stiffness of the zones they replace, and the ground without them.

Equal discs in a hexagonal lattice: the moduli are closed forms of the contact stiffness (scripts/hexagonal_window.py).
"""

import numpy as np
import shapely
from hexagonal_window import GAP, RATIO, stiffness

from colluvium import open_run
from colluvium.running import threads
from coupler_protocol.scene.reader import build_scene, read_scene
from fdm_server.mesh.grid import build_grid
from fdm_server.mesh.window_zones import window_rim, window_zones

CLEAR = 1.89  # radii between the rim or the surface and the first centres
BONDS = {"tension": 1e9, "shear": 1e9}
REST = {"ratio": 1e-5, "steps": 40000}


def lattice(outline, radius):
    """Rows x, y, radius (n,3) [m] of the hexagonal lattice inside an outline (P,2)."""
    inner = shapely.Polygon(outline).buffer(-CLEAR * radius, join_style="mitre")
    x0, y0, x1, y1 = inner.bounds
    rows = np.arange(int((y1 - y0) / (np.sqrt(3.0) * radius)) + 1)
    columns = np.arange(int((x1 - x0) / (2.0 * radius)) + 1)
    row, column = (part.ravel() for part in np.meshgrid(rows, columns, indexing="ij"))
    xy = np.column_stack([x0 + radius * (2 * column + row % 2), y0 + np.sqrt(3.0) * radius * row])
    inside = shapely.contains_xy(inner.buffer(1e-9), xy[:, 0], xy[:, 1])
    return np.column_stack([xy[inside], np.full(inside.sum(), 0.99999 * radius)])


def tables(configs, polygon, radius, folder, share=1.0, soft=1.0, **overload):
    """Tables of the elastic quick slope with a window at its surface, under 1 g and then under 2 g, each at rest.

    share: stiffness of the discs over the matched one; soft: moduli of the ground over those of the quick slope; overload: more
    keys of the last stage.
    """
    scene = read_scene(configs / "quick_slope.toml", [f"window.0={{name='w',polygon={polygon}}}"])
    grid = build_grid(scene)
    discs = lattice(grid.xy[window_rim(grid, window_zones(grid, scene.window[0])).outline], radius)
    file = folder / "discs.csv"
    np.savetxt(file, discs, delimiter=",", header="x,y,radius", comments="", fmt="%.17g")
    found = scene.drawn.model_dump(mode="json", exclude_none=True)
    material = {key: value for key, value in found["material"][0].items() if key not in ("mohr_coulomb", "tension")}
    elastic = scene.material[0].elastic
    material["elastic"] = {"bulk": soft * elastic.bulk, "shear": soft * elastic.shear}
    kn = soft * share * stiffness(elastic.bulk, elastic.shear)
    soil = {"density": 2000.0, "spring": {"normal": kn, "shear": RATIO * kn}, "friction": {"coefficient": 1.0}, "bond": BONDS}
    discs = {"radius": 0.99999 * radius, "file": str(file), "stiffness": "contact", "damping": {"local": 0.7}, "soil": soil}
    found |= {"material": [material], "discs": discs, "record": {"every": 100000}}
    found["stage"] = [
        {"name": "equilibrium", "gravity": 9.81, "until": REST},
        {"name": "fill"},
        {"name": "couple", "handover": 500, "until": REST, "discs": {"bond_gap": GAP * radius}},
        {"name": "overload", "gravity_factor": {"to": 2.0, "over": 500}, "until": REST} | overload,
    ]
    return found


def alone(found):
    """The same ground without its window."""
    kept = {key: value for key, value in found.items() if key not in ("window", "discs")}
    return kept | {"stage": [found["stage"][0], found["stage"][3]]}


def moved(found, out):
    """Gridpoints (N,2) as drawn, their displacements from 1 g to the end, and zones, of the run of tables."""
    out.mkdir()
    threads.run(build_scene(found), out)
    with open_run(out) as run:
        assert all(row["ended_by"].startswith("ratio") for row in run.info["stages"] if row["name"] != "fill"), run.info["stages"]
        begin = run.last_frame("couple" if run.windows else "equilibrium")
        first, last = run.gridpoints(begin), run.gridpoints(-1)
        return first.xy, last.displacement - first.displacement, run.zones(-1).corners


def felt(found, folder):
    """How much the ground outside feels the window: rms of the difference of displacements over that of displacements alone.

    Also the largest displacement alone [m].
    """
    _, own, _ = moved(alone(found), folder / "alone")
    _, coupled, zones = moved(found, folder / "coupled")
    outside = np.unique(zones)
    assert len(outside) < len(own)
    size = np.sqrt((own[outside] ** 2).sum())
    return np.sqrt(((coupled - own)[outside] ** 2).sum()) / size, np.abs(own).max()
