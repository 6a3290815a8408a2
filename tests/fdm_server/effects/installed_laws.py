"""A folder as `pip install` leaves it, with the law files of laws/, and a scene of zones in simple shear under them."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

LAWS = Path(__file__).parent / "laws"
EFFECTS = {"material.hardening_mises": "hardening_mises:HardeningMises", "material.crushing": "crushing:Crushing"}
BULK, SHEAR, STRENGTH, HARDENING = 5e8, 1.5e8, 1e5, 5e7


def install(folder, effects=EFFECTS):
    """Law files and a distribution `someones-laws` that declares them."""
    about = folder / "someones_laws-1.0.dist-info"
    about.mkdir(parents=True)
    for path in LAWS.glob("*.py"):
        shutil.copy(path, folder)
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: someones-laws\nVersion: 1.0\n", encoding="utf-8")
    lines = [f"{place} = {target}" for place, target in effects.items()]
    (about / "entry_points.txt").write_text("\n".join(["[colluvium.effects]", *lines, ""]), encoding="utf-8")
    return folder


def python(script, folder, cache, *arguments, jit=True):
    """Run a script where the distribution in `folder` is installed; the finished process."""
    paths = os.pathsep.join([str(folder), str(Path(__file__).parent)])
    own = {"PYTHONPATH": paths, "NUMBA_CACHE_DIR": str(cache), "NUMBA_DISABLE_JIT": "0" if jit else "1"}
    command = [sys.executable, "-W", "ignore", "-B", "-c", script, *map(str, arguments)]
    return subprocess.run(command, env=os.environ | own, capture_output=True, text=True)


def scene_data(tables, speed=2e-5, steps=100):
    """One row of zones, all gridpoints driven: the top goes to the right by `speed` [m/step], the bottom stays."""
    return {
        "format": 1,
        "seed": 1,
        "grid": {"kind": "box", "length": 3.0, "height": 1.0, "zone_size": 1.0},
        "material": [{"name": "soil", "density": 2000.0, "elastic": {"bulk": BULK, "shear": SHEAR}} | tables],
        "boundary": [{"on": "bottom", "fix": "xy"}],
        "record": {"every": steps, "history": steps},
        "stage": [
            {
                "name": "shear",
                "kind": "load",
                "until": {"steps": steps},
                "boundary": [{"on": "top", "velocity": {"x": speed, "y": 0.0}, "over": 1}],
            }
        ],
    }
