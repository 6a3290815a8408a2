"""Values in other units are doubted with the value that was probably meant; several together are refused."""

import copy
import tomllib

import pytest

from coupler_protocol.problems import SceneError
from coupler_protocol.scene.reader import build_scene, read_scene
from coupler_protocol.scene.rules.between_tables import doubts
from coupler_protocol.scene.rules.units import as_written, units_are_si
from tests.small_grounds import SIDES

SLOPE = f"""
format = 1
seed = 1
[grid]
kind = "slope"
length = 35.0
height = 15.0
zone_size = 1.25
fit = "face"
profile = [[0.0, 5.0], [10.0, 5.0], [20.0, 15.0], [35.0, 15.0]]
[[material]]
name = "soil"
density = 2000.0
elastic = {{ bulk = 100e6, shear = 46e6 }}
mohr_coulomb = {{ friction = 20.0, cohesion = 12.4e3, dilation = 0.0 }}
{SIDES}[[stage]]
name = "equilibrium"
gravity = 10.0
until = {{ ratio = 1e-5, steps = 4000 }}
[[stage]]
name = "push"
kind = "load"
until = {{ steps = 4000 }}
"""


@pytest.fixture
def slope():
    return tomllib.loads(SLOPE)


@pytest.fixture
def pile(configs):
    return tomllib.loads((configs / "quick_pile.toml").read_text(encoding="utf-8"))


def put(data, path, value):
    place = data
    for part in path[:-1]:
        place = place.setdefault(part, {}) if isinstance(place, dict) else place[part]
    place[path[-1]] = value
    return data


def doubted(data):
    return [(path, what, remedy) for path, what, remedy in doubts(build_scene(data))]


SOIL = ("material", 0)
LOAD = {"on": "top", "pressure": 50.0}
KPA = {"bulk": 1e5, "shear": 4.6e4}
PUSH = {"on": "top", "velocity": {"y": -0.5}}


@pytest.mark.parametrize(
    ("path", "value", "key", "what", "remedy"),
    [
        ((*SOIL, "mohr_coulomb", "cohesion"), 12.4, "cohesion", "is 12.4 Pa: nothing beside the weight", "12.4e3 (12.4 kPa)"),
        ((*SOIL, "tension"), {"strength": 5.0}, "strength", "5 Pa: nothing beside", "did you mean 5e3"),
        ((*SOIL, "density"), 2.0, "density", "density of material 'soil' is 2 kg/m3", "did you mean 2000 (2 t/m3)?"),
        ((*SOIL, "density"), 20.0, "density", "density of material 'soil' is 20 kg/m3", "did you mean 2039 (20 kN/m3)?"),
        (
            (*SOIL, "mohr_coulomb", "friction"),
            0.35,
            "friction",
            "friction of material 'soil' is 0.35 deg",
            "20.05 (0.35 radians)",
        ),
        (
            (*SOIL, "elastic"),
            {"bulk": 4e5, "shear": 2e5},
            "elastic",
            "by 45 % under the weight of the ground",
            "bulk = 400e6, shear = 200e6",
        ),
        ((*SOIL, "elastic"), {"young": 4e6, "poisson": -0.9}, "bulk", "476.2e3 Pa", "476.2e6 (476190 kPa)"),
        ((*SOIL, "mohr_coulomb", "dilation"), 0.17, "dilation", "dilation of material 'soil' is 0.17 deg", "9.74 (0.17 radians)"),
        (("stage", 0, "gravity"), 1.0, "gravity", "gravity of stage 'equilibrium' is 1 m/s2", "9.81"),
        (("stage", 0, "gravity"), 981.0, "gravity", "100 times the earth's", "9.81 (981 cm/s2)"),
        (("stage", 1, "gravity_factor"), 9.81, "gravity_factor", "it multiplies gravity", "did you mean gravity = 9.81?"),
        (("stage", 1, "boundary"), [LOAD], "pressure", "is 50 Pa: nothing beside", "did you mean 50e3"),
        (("initial_stress",), {"yy": -150.0}, "yy", "is -150 Pa: nothing beside", "did you mean -150e3"),
    ],
)
def test_one_value_in_another_unit_is_doubted_with_what_was_meant(slope, path, value, key, what, remedy):
    assert doubted(slope) == []
    found = [(p, w, r) for p, w, r in doubted(put(slope, path, value)) if p[-1] == key]
    assert found
    assert what in found[0][1]
    assert remedy in found[0][2]


def test_a_small_cohesion_that_means_something_is_not_doubted(slope):
    for cohesion in (0.0, 500.0, 12.4e3, 50e6):
        assert doubted(put(slope, (*SOIL, "mohr_coulomb", "cohesion"), cohesion)) == []


def test_strength_without_gravity_is_seen_against_the_moduli(configs):
    footing = tomllib.loads((configs / "footing.toml").read_text(encoding="utf-8"))
    footing["material"][0]["mohr_coulomb"]["cohesion"] = 100.0  # for 100 kPa
    ((path, what, remedy),) = doubted(footing)
    assert path[-1] == "cohesion"
    assert "beside the moduli" in what
    assert "100e3 (100 kPa)" in remedy


@pytest.mark.parametrize(
    "wrong",
    [
        {"elastic": {"bulk": 1e5, "shear": 4.6e4}, "mohr_coulomb": {"friction": 20.0, "cohesion": 12.4}},  # all in kPa
        {"elastic": {"bulk": 1e5, "shear": 4.6e4}},  # the modulus alone: the slope would shorten to nothing
        {
            "density": 2.0,
            "elastic": {"bulk": 1e5, "shear": 4.6e4},
            "mohr_coulomb": {"friction": 20.0, "cohesion": 12.4},
        },  # kN, m, t
        {"density": 20.0, "mohr_coulomb": {"friction": 20.0, "cohesion": 12.4}},
        {"mohr_coulomb": {"friction": 0.35, "cohesion": 12.4}},
    ],
)
def test_a_scene_in_other_units_is_refused_unless_they_are_meant(slope, wrong):
    slope["material"][0] |= wrong
    with pytest.raises(SceneError) as found:
        build_scene(slope)
    for problem in found.value.problems:
        assert problem.key.startswith("material[0]")
        assert "did you mean" in problem.remedy
        assert 'units = "any"' in problem.remedy
    assert doubted(slope | {"units": "any"}) == []


def test_soft_ground_that_keeps_its_shape_is_doubted_only(slope):
    """K = 0.3 MPa: the slope would shorten by 62 % under its weight."""
    slope["material"][0]["elastic"] = {"bulk": 3e5, "shear": 1.38e5}
    (what,) = (what for path, what, _ in doubted(slope) if path[-1] == "elastic")
    assert "would shorten by 62 %" in what


def test_a_static_speed_is_metres_a_step(slope):
    slope["stage"][1]["boundary"] = [copy.deepcopy(PUSH)]
    ((path, what, remedy),) = doubted(slope)
    assert path == ("stage", 1, "boundary", 0, "velocity")
    assert "0.5 m a step in static stage 'push'" in what
    assert "0.00013 m a step over 4000 steps" in remedy
    slope["stage"][1] |= {"time": "real", "until": {"time": 0.1}}
    assert not [what for path, what, _ in doubted(slope) if path[-1] == "velocity"]


def test_speeds_of_walls_are_metres_a_step_too(configs):
    biaxial = tomllib.loads((configs / "quick_biaxial.toml").read_text(encoding="utf-8"))
    assert doubted(biaxial) == []
    biaxial["stage"][2]["wall"][0]["velocity"] = [0.0, -0.1]
    assert "0.1 m a step in static stage 'shorten'" in doubted(biaxial)[0][1]


def test_discs_that_would_lie_in_each_other_are_doubted_and_refused(pile):
    assert doubted(pile) == []
    pile["discs"]["soil"]["spring"] = {"normal": 1e5, "shear": 4e4}
    ((path, what, remedy),) = doubted(pile)
    assert path == ("discs", "soil", "spring", "normal")
    assert "overlap by 59 % of their diameter" in what
    assert "100e6 (100000 kN/m)" in remedy
    pile["discs"]["soil"]["spring"] = {"normal": 5e4, "shear": 2e4}
    with pytest.raises(SceneError, match="overlap by 118 %"):
        build_scene(pile)


def test_bonds_in_kilonewtons_are_doubted(configs):
    """1.5 kN and 3.5 kN on contacts that carry the weight of 12 m over 11 cm, 35 kN."""
    data = tomllib.loads((configs / "quick_slope.toml").read_text(encoding="utf-8"))
    data["discs"]["soil"]["bond"] = {"tension": 1.5, "shear": 3.5}
    (first, second) = doubted(data)
    assert "tension of discs.soil.bond is 1.5 N: nothing beside" in first[1]
    assert "did you mean 3.5e3 (3.5 kN)?" in second[2]
    del data["discs"]["soil"]["bond"]
    data["discs"]["soil"]["parallel_bond"] = {"normal_stiffness": 1e9, "shear_stiffness": 1e9, "tension": 100.0, "shear": 0.0}
    ((_, what, remedy),) = doubted(data)
    assert "100 Pa" in what
    assert "100e3 (100 kPa)" in remedy


def test_a_friction_coefficient_is_not_an_angle(pile):
    pile["discs"]["soil"]["friction"]["coefficient"] = 30.0
    ((_, what, remedy),) = doubted(pile)
    assert "the friction coefficient of discs.soil is 30" in what
    assert "tan(30 deg) = 0.577" in remedy


def test_shipped_scenes_are_in_si(configs):
    for path in configs.glob("*.toml"):
        scene = read_scene(path)
        assert [*units_are_si(scene), *doubts(scene)] == [], path


@pytest.mark.parametrize(
    ("value", "words"), [(12.4e3, "12.4e3"), (1e8, "100e6"), (2000.0, "2000"), (-0.35, "-0.35"), (1e-5, "10e-6"), (0.0, "0")]
)
def test_numbers_are_written_as_in_a_scene(value, words):
    assert as_written(value) == words


@pytest.mark.parametrize(
    ("key", "values", "what", "remedy"),
    [
        ("cohesion", [8.0, 4.0], "softens to at most 8 Pa", "did you mean 8e3"),
        ("friction", [0.35, 0.3], "friction of material 'soil' is 0.35 deg", "20.05 (0.35 radians)"),
        ("tension", [2.0, 0.0], "softens to at most 2 Pa", "did you mean 2e3"),
    ],
)
def test_softening_values_are_doubted_like_plain_ones(slope, key, values, what, remedy):
    slope["material"][0] |= {"tension": {"strength": 5e3}, "softening": {"strain": [0.01, 0.1], key: values}}
    found = [(said, mends) for path, said, mends in doubted(slope) if path[:4] == ("material", 0, "softening", key)]
    assert what in found[0][0]
    assert remedy in found[0][1]


def test_a_small_residual_strength_is_not_doubted(slope):
    slope["material"][0]["softening"] = {"strain": [0.01, 0.1], "cohesion": [8e3, 20.0], "friction": [18.0, 16.0]}
    assert doubted(slope) == []
