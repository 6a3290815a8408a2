"""What the start of a run imports, and when.

The launcher computes nothing, and loads neither numba nor parts of scipy. The discs load them after their HELLO.
"""

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


DISCS = f"""
import sys
import numpy as np
from coupler_protocol.scene.reader import read_scene
from dem_server.packing.coupled_window import drawn_stones
from dem_server.procedure import window_side
from dem_server.procedure.load_ahead import libraries
print(*sorted(set({DEAR[1:]}) & set(sys.modules)), *sorted({{"asyncio"}} & set(sys.modules)))
for _ in libraries():
    pass
before = set(sys.modules)
scene = read_scene("configs/paper_slope.toml", ["stones.content=0.1"])
assert len(drawn_stones(scene, 1, np.array([[11.0, 5.0], [13.0, 5.0], [13.0, 7.0], [11.0, 7.0]])).outlines) > 1
print(*sorted(name for name in set(sys.modules) - before if name.startswith("scipy")))
"""


def test_the_discs_load_parts_of_scipy_after_their_hello_and_before_they_draw_stones():
    done = finished([sys.executable, "-c", DISCS], cwd=ROOT)
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == []
