"""The contact law is compiled to vector instructions: where it is not, a pass takes twice as long and nothing else shows it."""

import os
import platform
import re
import subprocess
import sys
from pathlib import Path

import pytest

TESTS = Path(__file__).parents[2]

SCRIPT = """
import numpy as np
from disc_cases import loose_discs
from window_case import stone_grain
from dem_server.step import contact_blocks
from dem_server.step.contact_pass import contact_forces
from dem_server.effects.dashpot import Dashpot
from dem_server.effects.parallel_bond import ParallelBond
from dem_server.effects.rolling import Rolling

cement = ParallelBond(normal_stiffness=1e9, shear_stiffness=5e8, tension=1.2e5, shear=2e5, radius=0.8)
xy = np.outer(np.arange(4.0), [0.0595, 0.0])
everything = {"rolling": Rolling(coefficient=0.2), "dashpot": Dashpot(normal=0.2), "parallel_bond": cement}
for changes in ({"bond": None, "friction": None}, {"bond": None}, {}, everything):
    contact_forces(*loose_discs(xy, np.full(4, 0.03), **changes))
for text in contact_blocks.add_parts.inspect_asm().values():
    print("--- signature")
    print(text)
"""


@pytest.mark.skipif(platform.machine() != "x86_64", reason="looks for instructions of x86-64")
def test_roots_are_taken_of_many_contacts_at_once(tmp_path):
    folders = os.pathsep.join(str(f) for f in (TESTS / "physics", TESTS / "dem_server", TESTS.parent / "scripts"))
    environment = os.environ | {"PYTHONPATH": folders, "NUMBA_CACHE_DIR": str(tmp_path)}
    done = subprocess.run([sys.executable, "-c", SCRIPT], env=environment, capture_output=True, text=True, check=True)
    laws = done.stdout.split("--- signature")[1:]
    assert len(laws) == 4
    for law in laws:
        assert re.search(r"\bv?sqrtpd\b", law)
        assert re.search(r"\bv?divpd\b", law)
