"""What the start of a run imports: the launcher computes nothing, and loads neither numba nor parts of scipy."""

import sys

from tests.commands import ROOT, finished

DEAR = ("numba", "scipy.linalg", "scipy.sparse", "scipy.spatial", "scipy.special", "matplotlib")
LAUNCHER = f"""
import sys
from colluvium import closing
from colluvium.forecast import check, locate
from colluvium.results import failure
from colluvium.running import processes
from coupler_protocol.scene.reader import read_scene
for name in ("quick_slope", "quick_pile"):
    list(check.opening(read_scene(f"configs/{{name}}.toml")))
print(*sorted(set({DEAR}) & set(sys.modules)))
"""


def test_reading_and_describing_a_scene_compiles_nothing_and_solves_nothing():
    done = finished([sys.executable, "-c", LAUNCHER], cwd=ROOT)
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == []
