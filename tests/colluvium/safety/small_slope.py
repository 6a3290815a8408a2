"""quick_slope.toml with a small window of large discs: seconds a run."""

import tomllib

from coupler_protocol.scene.reader import build_scene

SOIL = {
    "density": 2000.0,
    "spring": {"normal": 5.0e7, "shear": 2.0e7},
    "friction": {"coefficient": 0.55},
    "bond": {"tension": 1.5e3, "shear": 3.5e3},
}


def tables(configs, **discs):
    """Tables of quick_slope.toml with a window of 4 by 5 zones and some 150 discs in it."""
    data = tomllib.loads((configs / "quick_slope.toml").read_text())
    data["window"] = [{"name": "band", "columns": [15, 18], "rows": [9, 13]}]
    data["discs"] |= {"radius": 0.12} | discs
    data["fos"] = {"resolution": 0.2}
    return data


def scene(configs, **discs):
    """The scene of `tables`."""
    return build_scene(tables(configs, **discs))
