"""A folder as `pip install` leaves it, with the law files of laws/, and a scene of zones in simple shear under them."""

import os
import shutil
import sys
from pathlib import Path

from tests.commands import ROOT, finished

LAWS = Path(__file__).parent / "laws"
EFFECTS = {"material.hardening_mises": "hardening_mises:HardeningMises", "material.crushing": "crushing:Crushing"}
BULK, SHEAR, STRENGTH, HARDENING = 5e8, 1.5e8, 1e5, 5e7


def install(folder, effects=EFFECTS, name="someones-laws"):
    """Law files and a distribution that declares them."""
    about = folder / f"{name.replace('-', '_')}-1.0.dist-info"
    about.mkdir(parents=True)
    for path in LAWS.glob("*.py"):
        shutil.copy(path, folder)
    (about / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n", encoding="utf-8")
    lines = [f"{place} = {target}" for place, target in effects.items()]
    (about / "entry_points.txt").write_text("\n".join(["[colluvium.effects]", *lines, ""]), encoding="utf-8")
    return folder


def python(words, folder, jit=True):
    """Run `python WORDS` where the distribution in `folder` is installed; the finished process.

    Kernels go to the cache folder of all tests: these law files have their own hash, an edited one has another.
    """
    own = {"PYTHONPATH": os.pathsep.join([str(folder), str(ROOT)]), "NUMBA_DISABLE_JIT": "0" if jit else "1"}
    command = [sys.executable, "-W", "ignore", "-B", *map(str, words)]
    return finished(command, env=os.environ | own, cwd=ROOT)


def scene_data(tables, velocity=(2e-5, 0.0), steps=100):
    """One row of zones, all gridpoints driven: the top moves with `velocity` [m/step], the bottom stays."""
    return {
        "format": 1,
        "seed": 1,
        "grid": {"kind": "box", "length": 3.0, "height": 1.0, "zone_size": 1.0},
        "material": [{"name": "soil", "density": 2000.0, "elastic": {"bulk": BULK, "shear": SHEAR}} | tables],
        "boundary": [{"on": "bottom", "fix": "xy"}],
        "record": {"every": steps // 5, "history": steps},
        "stage": [
            {
                "name": "shear",
                "kind": "load",
                "until": {"steps": steps},
                "boundary": [{"on": "top", "velocity": dict(zip("xy", velocity, strict=True)), "over": 1}],
            }
        ],
    }
