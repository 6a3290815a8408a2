"""Targets: the material of the window, numbers of the scene, curves of a laboratory; and what is wrong with them."""

import csv
from math import radians, tan

import numpy as np
import pytest

from colluvium.calibration.laboratory_curve import measured
from colluvium.calibration.study import plan_of, with_table
from colluvium.calibration.targets import deviator, targets_of
from coupler_protocol.problems import SceneError
from coupler_protocol.scene.reader import read_scene
from tests.colluvium.calibration.synthetic import scene_of

YOUNG, POISSON, PEAK = 3e8, 0.3, 2.5e5  # in three dimensions


def write_curve(path, triaxial=False, volume=True, **units):
    """The curve of an elastic, perfectly plastic material whose volume stays constant once it yields."""
    plane = YOUNG / (1.0 - POISSON**2), POISSON / (1.0 - POISSON)
    young, poisson = (YOUNG, POISSON) if triaxial else plane
    strain = np.linspace(0.0, 4.0 * PEAK / young, 41)
    elastic = np.minimum(strain, PEAK / young)
    change = -(1.0 - (2.0 if triaxial else 1.0) * poisson) * elastic
    columns = {"strain": 100.0 * strain, "deviator": 1e-3 * young * elastic} | ({"volume": 100.0 * change} if volume else {})
    with path.open("w", newline="") as file:
        rows = csv.writer(file)
        rows.writerow(columns)
        rows.writerow([units.get(name, {"deviator": "kPa"}.get(name, "%")) for name in columns])
        rows.writerows(zip(*columns.values(), strict=True))
    return path


@pytest.fixture(scope="module")
def paper(configs):
    return read_scene(configs / "paper_slope.toml")


def test_the_material_of_the_window_is_the_target(paper, configs):
    """The paper's Table 1: K 0.5, G 0.15 GPa, c 50 kPa, phi 30 deg."""
    found, problems = targets_of(with_table(paper), configs)
    assert not problems
    assert found.value("young") == pytest.approx(409.1e6, rel=1e-3)
    assert found.value("poisson") == pytest.approx(0.3636, abs=1e-4)
    peaks = {goal.pressure: goal.value for goal in found.goals if goal.pressure}
    assert peaks[1e5] == pytest.approx(2.0 * 1e5 + 2.0 * 50e3 * tan(radians(60.0)))
    assert "soil-rock mixture" in found.source


def test_numbers_of_the_scene_come_first(configs):
    scene = read_scene(configs / "paper_slope.toml", ["calibrate.young=2e8", "calibrate.fit=['young', 'poisson']"])
    found, _ = targets_of(scene, configs)
    assert found.value("young") == 2e8
    assert found.value("poisson") == pytest.approx(0.3636, abs=1e-4)
    assert [goal.name for goal in found.goals] == ["young", "poisson"]


def test_moduli_in_the_plane():
    """E2 471 MPa and nu2 0.571 are E 409 MPa and nu 0.364."""
    scene = scene_of({"young": 471e6, "poisson": 0.5714, "moduli": "plane", "fit": ["young", "poisson"]})
    found, _ = targets_of(scene, None)
    assert found.value("young") == pytest.approx(409e6, rel=2e-3)
    assert found.value("poisson") == pytest.approx(0.3636, abs=1e-3)


@pytest.mark.parametrize("triaxial", [False, True])
def test_a_curve_gives_moduli_and_strength(tmp_path, triaxial):
    found = measured(write_curve(tmp_path / "curve.csv", triaxial), 1e5, triaxial)
    assert found.deviator == pytest.approx(PEAK, rel=1e-3)
    assert found.young == pytest.approx(YOUNG, rel=1e-3)
    assert found.poisson == pytest.approx(POISSON, abs=1e-3)
    assert found.dilation == pytest.approx(0.0, abs=1.0)


def test_a_curve_without_volume_has_a_strength_and_in_triaxial_tests_a_modulus(tmp_path):
    plane, triaxial = (measured(write_curve(tmp_path / "curve.csv", kind, volume=False), 1e5, kind) for kind in (False, True))
    assert plane.deviator == pytest.approx(PEAK, rel=1e-3)
    assert (plane.young, plane.poisson, triaxial.poisson) == (None, None, None)
    assert triaxial.young == pytest.approx(YOUNG, rel=1e-3)


def test_a_curve_of_our_own_laboratory_is_one_as_well(tmp_path):
    path = write_curve(tmp_path / "curve.csv")
    rows = list(csv.reader(path.open()))
    rows[0], rows[1] = ["strain", "axial", "volume", "side"], ["%", "kPa", "%", "kPa"]
    body = [[row[0], float(row[1]) + 100.0, row[2], 100.0] for row in rows[2:]]
    with path.open("w", newline="") as file:
        csv.writer(file).writerows([*rows[:2], *body])
    assert measured(path, 1e5, False).young == pytest.approx(YOUNG, rel=1e-3)


def test_curves_are_targets_of_a_scene(tmp_path):
    tables = []
    for pressure in (5e4, 2e5):
        write_curve(tmp_path / f"{pressure:g}.csv")
        tables.append({"file": f"{pressure:g}.csv", "confinement": pressure})
    plan, problems = plan_of(scene_of({"curve": tables}), tmp_path)
    assert not problems
    assert [goal.pressure for goal in plan.targets.goals if goal.pressure] == [5e4, 2e5]
    assert plan.targets.value("young") == pytest.approx(YOUNG, rel=1e-3)


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("strain,deviator\n%,kPa\n0,0\n1,1\n", "2 points"),
        ("strain,stress\n%,kPa\n" + "\n".join(f"{i},{i}" for i in range(6)), "no column deviator"),
        ("strain,deviator\n%,psi\n" + "\n".join(f"{i},{i}" for i in range(6)), "'psi'"),
        ("strain,deviator\n%,kPa\n" + "\n".join(f"{i},x" for i in range(6)), "no number"),
        ("strain,deviator\n%,kPa\n" + "\n".join(f"{5 - i},{i}" for i in range(6)), "does not grow"),
    ],
)
def test_files_that_are_no_curve_are_refused_in_words(tmp_path, text, why):
    (tmp_path / "bad.csv").write_text(text)
    with pytest.raises(ValueError, match=why):
        measured(tmp_path / "bad.csv", 1e5, False)


def test_all_problems_at_once(tmp_path):
    curves = [{"file": "lost.csv", "confinement": 1e5}, {"file": "lost.csv", "confinement": 1e5}]
    scene = scene_of({"sample": "clump", "curve": curves}, pair=[{"between": ["soil", "soil"], "friction": {"coefficient": 0.2}}])
    plan, problems = plan_of(scene, tmp_path)
    assert plan is None
    keys = [key for key, _, _ in problems]
    expected = ["discs.pair[0]", "calibrate.sample", "calibrate.curve[0].file", "calibrate.curve[1].file", "calibrate.curve"]
    assert keys[:5] == expected
    assert {"calibrate.young", "calibrate.poisson"} <= set(keys)
    assert all(remedy for _, _, remedy in problems)


def test_one_stress_does_not_tell_cohesion_from_friction():
    targets = {"young": 1e8, "poisson": 0.3, "cohesion": 1e4, "friction": 30.0}
    _, problems = plan_of(scene_of(targets, {"confinement": [1e5]}), None)
    assert problems[0][0] == "lab.confinement"
    plan, _ = plan_of(scene_of(targets | {"vary": ["normal", "ratio", "bond"]}, {"confinement": [1e5]}), None)
    assert plan.targets.goals[-1].value == pytest.approx(deviator(1e4, 30.0, 1e5))


@pytest.mark.parametrize(
    ("table", "why"),
    [({"seeds": [1, 1]}, "twice"), ({"check": [1]}, "other seeds"), ({"poisson": 0.6}, "three dimensions")],
)
def test_tables_that_contradict_themselves(table, why):
    with pytest.raises(SceneError, match=why):
        scene_of(table)
