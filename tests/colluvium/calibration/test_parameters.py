"""Parameters: the start has the estimated moduli of the target; tables and copies of a scene with them are valid."""

from math import atan, radians, sin

import pytest

from colluvium.calibration.answer import toml_of, write_scene
from colluvium.calibration.parameters import estimate_of, scene_with, space_of, tables_of, values_of
from colluvium.calibration.study import plan_of, prior_of, with_table
from colluvium.calibration.verdict import rows_of
from coupler_protocol.scene.reader import build_scene, read_scene
from tests.colluvium.calibration.synthetic import SOIL, scene_of

TARGETS = {"young": 1e8, "poisson": 0.2, "cohesion": 2e4, "friction": 25.0}


@pytest.fixture(scope="module")
def paper(configs):
    return with_table(read_scene(configs / "paper_slope.toml"))


@pytest.fixture(scope="module")
def plan(paper, configs):
    return plan_of(paper, configs)[0]


def test_the_start_has_the_estimated_moduli_and_strength_of_the_target():
    scene = scene_of(TARGETS)
    plan, _ = plan_of(scene, None)
    goals = plan.targets.goals
    expected = dict(zip([goal.name for goal in goals], prior_of(plan, scene)(plan.space.start), strict=True))
    for goal in goals:
        assert goal.plain(expected[goal.name]) == pytest.approx(goal.value, rel=0.01), goal.name
    assert 0.85 * sin(atan(plan.space.start["friction"])) == pytest.approx(sin(radians(25.0)), rel=0.01)


def test_the_start_of_the_paper_is_between_its_table_and_the_answer(paper, plan):
    """Table 2 is 20 times too soft; Poisson's ratio of Table 1 is beyond springs, so ks/kn begins at its bound."""
    assert 10.0 * values_of(paper)["normal"] < plan.space.start["normal"] < 1e9
    assert plan.space.start["ratio"] == paper.calibrate.bounds.ratio[0]


def test_estimates_are_those_of_the_scene(paper, plan):
    from colluvium.forecast.packing_moduli import estimate

    values = plan.space.start | {"friction": 0.3}
    assert estimate_of(paper, values, 0.45) == estimate(scene_with(paper, values).discs, 0.45)


def test_stones_keep_their_ratios_and_have_the_rolling_resistance(paper):
    values = {"normal": 1e9, "ratio": 0.1, "friction": 0.2, "bond": 6e3, "rolling": 0.1}
    tables = tables_of(paper, values)
    assert tables["soil"]["spring"] == {"normal": 1e9, "shear": 1e8}
    assert tables["soil"]["bond"] == {"tension": 6e3, "shear": 14e3}
    assert tables["stone"] == {"spring": {"normal": 1e10, "shear": 1e10}, "rolling": {"coefficient": 0.1}}
    discs = scene_with(paper, values).discs
    assert discs.stone.bond == paper.discs.stone.bond
    assert discs.soil.density == paper.discs.soil.density


def test_coordinates_and_bounds():
    scene = scene_of(TARGETS | {"vary": ["normal", "friction", "rolling"], "bounds": {"friction": [0.1, 0.4]}})
    space = space_of(scene, plan_of(scene, None)[0].targets, 0.0)
    low, high = space.box()
    at_ends = space.values(low - 1.0), space.values(high + 1.0)
    assert [values["friction"] for values in at_ends] == [0.1, 0.4]
    assert [values["rolling"] for values in at_ends] == [0.0, 0.5]
    assert space.at_bound(at_ends[1], "friction") == "upper"
    assert space.at_bound(at_ends[1], "bond") == ""  # does not vary
    assert space.values(space.coordinates(space.start)) == space.start
    assert space.start["bond"] == SOIL["bond"]["tension"]


def test_the_tables_can_be_pasted(paper, plan):
    values = {"normal": 1.05e9, "ratio": 0.1, "friction": 0.2, "bond": 6750.0, "rolling": 0.05}
    import tomllib

    pasted = tomllib.loads(toml_of(tables_of(paper, values), plan, paper, rows_of(plan.targets.goals[:0], _none())))
    data = paper.resolved()
    data["discs"] |= pasted["discs"]
    assert build_scene(data).discs == scene_with(paper, values).discs


def _none():
    import numpy as np

    return np.zeros((1, 0))


def test_a_copy_of_the_scene_has_the_parameters_and_keeps_its_comments(paper, configs, tmp_path):
    pytest.importorskip("tomlkit")
    values = {"normal": 1.05e9, "ratio": 0.1, "friction": 0.2, "bond": 6750.0, "rolling": 0.05}
    target = tmp_path / "new" / "copy.toml"
    write_scene(configs / "paper_slope.toml", ["discs.radius=0.02"], tables_of(paper, values), target)
    copy = read_scene(target)
    assert copy.discs.radius == 0.02
    assert copy.discs.soil == scene_with(paper, values).discs.soil
    assert copy.discs.stone == scene_with(paper, values).discs.stone
    assert "# the paper's Table 1" in target.read_text()
    assert copy.grid == paper.grid


def test_a_scene_with_tables_in_one_line_is_copied_as_well(configs, tmp_path):
    pytest.importorskip("tomlkit")
    source = tmp_path / "source.toml"
    text = (configs / "quick_lab.toml").read_text()
    start, end = text.index("[discs.soil]"), text.index("[lab]")
    inline = "soil.density = 2000.0\nsoil.spring = { normal = 5.0e7, shear = 2.0e7 }\n\n"
    source.write_text(text[:start] + inline + text[end:])
    scene = with_table(read_scene(source))
    values = {"normal": 2e8, "ratio": 0.3, "friction": 0.4, "bond": 100.0}
    write_scene(source, [], tables_of(scene, values), tmp_path / "copy.toml")
    assert read_scene(tmp_path / "copy.toml").discs.soil == scene_with(scene, values).discs.soil
