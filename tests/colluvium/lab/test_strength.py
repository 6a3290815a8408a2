"""Mohr-Coulomb lines through given points."""

import numpy as np
import pytest

from colluvium.lab.strength import line_of, strength_of, strength_on

C, PHI = 50e3, 30.0
SIDE = np.array([50e3, 100e3, 200e3])


def on_the_envelope(kind):
    if kind == "shear":
        return C + SIDE * np.tan(np.radians(PHI))
    passive = (1.0 + np.sin(np.radians(PHI))) / (1.0 - np.sin(np.radians(PHI)))
    return passive * SIDE + 2.0 * C * np.sqrt(passive)


@pytest.mark.parametrize("kind", ["biaxial", "shear"])
def test_points_of_an_envelope_give_its_parameters(kind):
    line = line_of(kind, SIDE, on_the_envelope(kind))
    assert line == pytest.approx((C, PHI), rel=1e-9)
    assert strength_on(kind, line, SIDE) == pytest.approx(on_the_envelope(kind), rel=1e-9)


def rows(kind, factors):
    return [
        {"seed": seed, "pressure": p, "peak_side": p, "peak_axial": factor * axial}
        for seed, factor in enumerate(factors)
        for p, axial in zip(SIDE, on_the_envelope(kind), strict=True)
    ]


def test_scatter_is_that_over_seeds_and_the_window_that_of_the_points():
    """Shear strength 10 % above and below: c and tan phi as well, the mean line is the envelope."""
    found = strength_of("shear", rows("shear", [0.9, 1.1]), "peak")
    assert found["c"] == pytest.approx(C, rel=1e-9)
    assert found["phi"] == pytest.approx(PHI, rel=1e-9)
    assert found["c_sd"] == pytest.approx(0.1 * C * np.sqrt(2.0), rel=1e-9)
    low, high = (np.degrees(np.arctan(f * np.tan(np.radians(PHI)))) for f in (0.9, 1.1))
    assert found["phi_sd"] == pytest.approx((high - low) / np.sqrt(2.0), rel=1e-9)
    assert found["window"] == [50e3, 200e3]
    assert abs(found["misfit"]) < 1e-9


def test_a_curved_envelope_has_a_misfit():
    curved = [row | {"peak_axial": 2e3 * np.sqrt(row["peak_side"])} for row in rows("shear", [1.0])]
    assert abs(strength_of("shear", curved, "peak")["misfit"]) > 0.01


def test_strength_that_falls_with_the_stress_gives_no_line():
    assert line_of("biaxial", SIDE, 3e5 - 0.5 * SIDE) is None
    assert line_of("biaxial", SIDE, 3e5 + 0.5 * SIDE).friction < 0.0


def test_one_stress_gives_no_line():
    assert strength_of("biaxial", rows("biaxial", [1.0])[:1], "peak") is None
