"""scripts/hexagonal_window.py: a hexagonal packing within its rectangle, with the stiffness of the zones."""

from math import sqrt

import hexagonal_window
import numpy as np
import pytest
from scipy.spatial import cKDTree

from coupler_protocol.scene.reader import read_scene


def test_every_disc_inside_touches_six(tmp_path):
    discs = hexagonal_window.packing((11.0, 5.0), (13.0, 32.0 / 3.0))
    xy, radius = discs[:, :2], discs[0, 2]
    near = cKDTree(xy).query_ball_point(xy, 2.001 * radius, return_length=True) - 1
    inside = np.all((xy > xy.min(axis=0) + 1.1 * radius) & (xy < xy.max(axis=0) - 1.1 * radius), axis=1)
    assert set(near[inside]) == {6}
    assert cKDTree(xy).query(xy, 2)[0][:, 1].min() == pytest.approx(2.0 * radius, rel=1e-4)
    gaps = np.array([xy.min(axis=0) - (11.0, 5.0), (13.0, 32.0 / 3.0) - xy.max(axis=0)]) / radius
    assert np.all((gaps > 1.85) & (gaps < 1.95))  # all sides touch control discs


def test_the_lattice_has_the_modulus_of_the_zones():
    """E2 of the paper's Table 1 in the plane: 471 MPa (docs/window.md)."""
    kn = hexagonal_window.stiffness(0.5e9, 0.15e9)
    K2, G = sqrt(3.0) / 2.0 * kn, sqrt(3.0) / 4.0 * kn * (1.0 + hexagonal_window.RATIO)
    modulus = 4.0 * K2 * G / (K2 + G)
    assert modulus == pytest.approx(471.4e6, rel=1e-3)


def test_the_scene_is_one(tmp_path):
    assert hexagonal_window.main(["--out", str(tmp_path)]) == 0
    scene = read_scene(tmp_path / "hexagonal_slope.toml")
    assert scene.stones is None
    couple = next(stage for stage in scene.stage if stage.name == "couple")
    radius = scene.discs.radius
    assert 0.0 < couple.discs.bond_gap < (2.0 * sqrt(3.0) - 2.0) * radius  # neighbours of the lattice, not the next ones
    assert scene.discs.file == str(tmp_path / "hexagonal.csv")
    assert len((tmp_path / "hexagonal.csv").read_text().splitlines()) == 5110
