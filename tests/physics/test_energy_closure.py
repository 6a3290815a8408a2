"""The histories of energies close, and their work is that of the reactions (scripts/verification/continuum/energy.py)."""

import numpy as np
import pytest
from verification.continuum import energy, footing


def test_undamped_motion_keeps_its_energy():
    found = energy.kept(energy.weighed({"local": 0.0}, time="real", until={"time": 0.2}))
    scale = np.abs(found["gravity"]).max()
    assert found["kinetic"].max() > 0.1 * scale
    np.testing.assert_allclose(found["kinetic"] + found["strain"], found["gravity"], atol=1e-12 * scale)


def test_a_sudden_weight_stores_half_of_its_work():
    found = energy.kept(energy.weighed({"local": 0.8}, until={"ratio": 1e-8}))
    assert found["strain"][-1] / found["gravity"][-1] == pytest.approx(0.5, rel=1e-5)
    assert found["damping"][-1] / found["gravity"][-1] == pytest.approx(0.5, rel=1e-5)


def test_a_footing_spends_its_work_on_plastic_flow():
    found = energy.kept(footing.scene(4, 0.0, (5.0, 3.0), 0.03, 5e-6))
    assert np.abs(found["error"]).max() < 1e-10 * found["external"][-1]
    assert found["plastic"][-1] > 0.5 * found["external"][-1]
