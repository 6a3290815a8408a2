"""Numbers of curves whose material is known: elastic and perfectly plastic, sheared, compressed without lateral strain."""

import numpy as np
import pytest

from colluvium.lab.answers import answers_of, tensile_strength
from colluvium.lab.specimen import FLAT
from tests.colluvium.lab.lab_case import curve_with

E2, NU2, SIDE, DEVIATOR, PSI = 2e7, 0.3, 1e5, 2e5, 12.0


def elastic_plastic():
    """A biaxial test of an elastic material that yields at DEVIATOR with the dilation angle PSI."""
    strain = np.linspace(0.0, 0.04, 401)
    yields = DEVIATOR / E2
    plastic = np.maximum(strain - yields, 0.0)
    sine = np.sin(np.radians(PSI))
    across = -NU2 * np.minimum(strain, yields) - plastic * (1.0 + sine) / (1.0 - sine)
    deviator = E2 * np.minimum(strain, yields)
    work = np.cumsum(np.append(0.0, 0.5 * (deviator[1:] + deviator[:-1]) * np.diff(strain)))
    stored = 0.5 * deviator**2 / E2
    return curve_with(
        strain=strain, wall_strain=strain, side_strain=across, axial=SIDE + deviator, side=np.full(401, SIDE), work=work,
        stored=stored, lost=work - stored,
    )  # fmt: skip


def test_a_biaxial_test_gives_the_moduli_and_angles_of_its_material():
    found = answers_of("biaxial", elastic_plastic())
    assert found["E2"] == pytest.approx(E2, rel=1e-6)
    assert found["nu2"] == pytest.approx(NU2, rel=1e-6)
    assert found["nu"] == pytest.approx(NU2 / (1.0 + NU2), rel=1e-6)
    assert found["E"] == pytest.approx(E2 * (1.0 - found["nu"] ** 2), rel=1e-6)
    assert found["E"] / (2.0 * (1.0 + found["nu"])) == pytest.approx(found["G"], rel=1e-6)  # the same shear modulus in 3-D
    assert found["peak_axial"] == pytest.approx(SIDE + DEVIATOR, rel=1e-9)
    assert found["residual_axial"] == pytest.approx(SIDE + DEVIATOR, rel=1e-9)
    assert found["dilation"] == pytest.approx(PSI, abs=0.2)  # the peak begins at yield, with a point that is partly elastic
    assert found["stored_share"] + found["lost_share"] == pytest.approx(1.0)


def test_dilation_of_steady_yield():
    curve = elastic_plastic()
    later = {name: column[150:] for name, column in curve.columns.items()}
    later["axial"] = later["axial"] + np.where(np.arange(251) == 120, 1.0, 0.0)  # a peak amid the plastic part
    assert answers_of("biaxial", curve_with(**later))["dilation"] == pytest.approx(PSI, rel=1e-6)


def test_an_oedometer_gives_its_modulus_both_ways_and_k0():
    strain = np.concatenate([np.linspace(0.0, 0.01, 51), np.linspace(0.0098, 0.005, 25)])
    turn, top = 50, 3e7 * 0.01
    axial = np.where(np.arange(76) <= turn, 3e7 * strain, top - 5e7 * (0.01 - strain))
    found = answers_of("oedometer", curve_with(turn, strain=strain, axial=axial, side=0.4 * axial))
    assert found["M"] == pytest.approx(3e7, rel=1e-9)
    assert found["M_unload"] == pytest.approx(5e7, rel=1e-6)
    assert found["K0"] == pytest.approx(0.4, rel=1e-9)


def test_a_shear_test_gives_stiffness_strength_and_dilation():
    strain = np.linspace(0.0, 0.2, 401)
    shear = np.minimum(5e6 * strain, 6e4)
    rise = np.where(strain > 0.012, 0.1 * (strain - 0.012), 0.0)
    found = answers_of("shear", curve_with(strain=strain, axial=shear, side=np.full(401, 1e5), volume=rise))
    assert found["stiffness"] == pytest.approx(5e6, rel=1e-6)
    assert found["peak_axial"] == found["residual_axial"] == pytest.approx(6e4)
    assert found["dilation"] == pytest.approx(np.degrees(np.arctan(0.1)), abs=0.3)


def test_stress_at_the_centre_of_a_brazilian_disc():
    """A radial pressure over both arcs is a sum of pairs of point loads P, each with the stresses 2 P / pi D and -6 P / pi D."""
    angle = np.linspace(-FLAT, FLAT, 20001)
    across = (2.0 * np.cos(angle) ** 2 - 6.0 * np.sin(angle) ** 2) / np.pi
    assert tensile_strength(1.0) == pytest.approx(np.trapezoid(across, angle) / (2.0 * np.sin(FLAT)), rel=1e-8)
    assert tensile_strength(1.0) == pytest.approx(2.0 / np.pi, rel=0.05)  # two point loads
