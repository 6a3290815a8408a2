"""Small scenes with a window of some shape in uniformly stressed ground without gravity: what changes, the window changes."""

import numpy as np

STRESS = {"xx": -120e3, "yy": -200e3, "xy": 30e3}  # [Pa]
L_SHAPE = [[1.0, 1.0], [6.0, 1.0], [6.0, 3.0], [3.0, 3.0], [3.0, 5.5], [1.0, 5.5]]
CIRCLE = [[3.75 + 1.95 * np.cos(a), 3.25 + 1.95 * np.sin(a)] for a in np.linspace(0.0, 2.0 * np.pi, 40, endpoint=False)]
SECTOR = [[1.9 * np.cos(0.3), 1.9 * np.sin(0.3)], [4.6 * np.cos(0.3), 4.6 * np.sin(0.3)],
          *([4.6 * np.cos(a), 4.6 * np.sin(a)] for a in np.linspace(0.4, 1.2, 9)),
          *([1.9 * np.cos(a), 1.9 * np.sin(a)] for a in np.linspace(1.25, 0.35, 9))]  # fmt: skip

BOX = {"kind": "box", "length": 7.5, "height": 6.5, "zone_size": 0.5}
RING = {"kind": "ring", "part": "quarter", "inner": 1.0, "outer": 6.0, "around": 8, "growth": 1.1}


def uniform(grid, polygon, **discs):
    """Tables of a scene: the grid under STRESS with all its sides held, and one window."""
    sides = ("left", "right", "bottom", "top") if grid["kind"] == "box" else ("left", "bottom", "inner", "outer")
    soil = {
        "density": 2000.0,
        "spring": {"normal": 5e7, "shear": 2e7},
        "friction": {"coefficient": 0.55},
        "bond": {"tension": 15e3, "shear": 35e3},
    }
    rest = {"ratio": 1e-5, "steps": 20000}
    return {
        "format": 1,
        "seed": 1,
        "grid": grid,
        "material": [{"name": "ground", "density": 2700.0, "elastic": {"bulk": 0.5e9, "shear": 0.15e9}}],
        "initial_stress": STRESS | {"zz": -130e3},
        "boundary": [{"on": side, "fix": "xy"} for side in sides],
        "damping": {"local": 0.8},
        "window": [{"name": "hole", "polygon": [list(map(float, point)) for point in polygon]}],
        "discs": {"radius": 0.05, "damping": {"local": 0.7}, "soil": soil} | discs,
        "record": {"every": 500},
        "stage": [
            {"name": "equilibrium", "gravity": 0.0, "until": rest},
            {"name": "fill"},
            {"name": "couple", "handover": 300, "until": rest},
        ],
    }


THREE = {
    "stiff": [[1.0, 1.0], [3.0, 1.0], [3.0, 3.0], [1.0, 3.0]],
    "stony": [[4.5, 3.5], [6.5, 3.5], [6.5, 5.0], [4.5, 5.0]],
    "loose": [[4.5, 1.0], [6.5, 1.0], [6.5, 2.5], [4.5, 2.5]],
}  # windows of BOX: corners by name


def three_windows(radius=0.08):
    """Tables of a short scene of three windows: as [discs], smaller discs with stones, and soil without bonds."""
    data = uniform(dict(BOX), THREE["stiff"], radius=radius)
    data["material"][0] |= {"mohr_coulomb": {"cohesion": 60e3, "friction": 30.0}}
    stone = {"density": 2700.0, "spring": {"normal": 1e8, "shear": 1e8}, "friction": {"coefficient": 1.0}}
    size = {"mean": 0.5, "sigma": 0.1, "min": 0.4, "max": 0.6}
    own = {
        "stiff": {},
        "stony": {"discs": {"radius": 0.06, "stone": stone}, "stones": {"content": 0.2, "size": size, "gap": 0.05}},
        "loose": {"discs": {"soil": {"bond": False, "friction": {"coefficient": 0.4}}, "damping": {"local": 0.5}}},
    }
    data["window"] = [{"name": name, "polygon": corners} | own[name] for name, corners in THREE.items()]
    data["record"] = {"every": 40, "history": 10}
    data["stage"][0]["until"] = {"steps": 10}
    data["stage"][2] |= {"handover": 30, "until": {"steps": 50}}
    data["stage"].append({"name": "more", "kind": "overload", "gravity": 2.0, "until": {"steps": 60}})
    return data
