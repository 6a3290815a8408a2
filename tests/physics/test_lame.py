"""Thick-walled cylinder under internal pressure (Lame 1852): radial stress A - B/r2, hoop stress A + B/r2.

A = p a2/(b2 - a2), B = p a2 b2/(b2 - a2); plane strain.
"""

import numpy as np
import pytest
from run_cases import SOIL, compute, stage

A, B, PRESSURE = 1.0, 4.0, 2e6
SYMMETRY = [{"on": "left", "fix": "x"}, {"on": "bottom", "fix": "y"}]


def error(out, around, **kept):
    """Relative error (root of area mean) of the stresses, and of the wall's displacement."""
    grid = {"kind": "ring", "inner": A, "outer": B, "around": around, "part": "quarter"} | kept
    load = [{"on": "inner", "pressure": PRESSURE, "over": 200}]
    with compute(out, grid, stage("press", ratio=1e-7, boundary=load), boundary=SYMMETRY) as run:
        zones, points = run.zones(-1), run.gridpoints(-1)
        x, y = zones.xy.T
        wall = np.abs(np.hypot(*points.xy.T) - A) < 1e-9
        moved = np.einsum("ij,ij->i", points.displacement, points.xy)[wall]
        s = zones.stress
    r2 = x**2 + y**2
    c2, s2 = (x**2 - y**2) / r2, 2 * x * y / r2
    mean = PRESSURE * A**2 / (B**2 - A**2)
    ring = PRESSURE * A**2 * B**2 / (B**2 - A**2) / r2
    exact = np.column_stack([mean - ring * c2, mean + ring * c2, -ring * s2])
    found = s[:, [0, 1, 3]]
    stress = np.sqrt(np.mean(r2 * np.sum((found - exact) ** 2, axis=1) / np.mean(r2 * np.sum(exact**2, axis=1))))
    K, G = SOIL["elastic"]["bulk"], SOIL["elastic"]["shear"]
    wall_exact = mean * A / (2 * (K + G / 3)) + ring[0] * r2[0] / (2 * G * A)
    return stress, np.abs(moved / wall_exact - 1).max()


def test_second_order(tmp_path):
    coarse, fine = (error(tmp_path / str(n), n) for n in (8, 16))
    assert fine[0] < 0.01
    assert fine[1] < 0.01
    assert np.log2(coarse[0] / fine[0]) > 1.8
    assert np.log2(coarse[1] / fine[1]) > 1.8


@pytest.mark.parametrize("growth", [1.0, 1.1])
def test_other_radial_sizes(tmp_path, growth):
    assert max(error(tmp_path, 16, growth=growth)) < 0.01
