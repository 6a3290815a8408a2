"""Scenes: what is read, and what is said about everything that is wrong."""

import copy
import re
import tomllib
from importlib import metadata

import pytest

from coupler_protocol.problems import SceneError
from coupler_protocol.scene import scene as scene_module
from coupler_protocol.scene.declare import Effect, quantity
from coupler_protocol.scene.reader import build_scene, read_scene
from coupler_protocol.scene.rules.between_tables import doubts
from coupler_protocol.scene.scene import declared_effects, scene_class


@pytest.fixture
def good(configs):
    """The quick scene as plain data."""
    return tomllib.loads((configs / "quick_slope.toml").read_text(encoding="utf-8"))


def problems(data):
    """{key: problem} of a scene that is wrong."""
    with pytest.raises(SceneError) as found:
        build_scene(data)
    return {problem.key: problem for problem in found.value.problems}


def only_problem(data):
    ((_, problem),) = problems(data).items()
    return problem


def written(tmp_path, text):
    path = tmp_path / "bad.toml"
    path.write_text(text, encoding="utf-8")
    return path


# -- what is read --------------------------------------------------------------------------------------------------------


def test_the_shipped_scenes_are_good(configs):
    for path in configs.glob("*.toml"):
        assert read_scene(path).title, path


def test_values_and_defaults_are_there(configs):
    scene = read_scene(configs / "quick_slope.toml")
    assert scene.grid.zone_size == (0.6666666666666666, 0.6666666666666666)
    assert scene.material[0].mohr_coulomb.friction == 30.0
    assert scene.ring is None
    assert (scene.link.timeout, scene.link.give_up) == (5.0, 120.0)
    assert [stage.kind for stage in scene.stage] == ["equilibrium", "fill", "couple", "overload"]
    assert (scene.stage[3].gravity_factor.to, scene.stage[3].gravity_factor.over) == (3.0, 1000)
    assert scene.name_of_stage(1) == "fill"


def test_whole_numbers_become_floats_where_floats_are_meant(good):
    good["material"][0]["density"] = 2700
    good["stage"][3]["gravity_factor"] = 3
    good["grid"]["zone_size"] = [1, 1]
    good["window"][0] |= {"columns": [12, 14], "rows": [3, 5]}
    scene = build_scene(good)
    assert type(scene.material[0].density) is float
    assert type(scene.stage[3].gravity_factor.to) is float
    assert [type(v) for v in scene.grid.zone_size] == [float, float]


def test_a_scene_does_not_change_after_reading(good):
    scene = build_scene(good)
    with pytest.raises(ValueError, match="frozen"):
        scene.seed = 2


def test_equal_scenes_have_equal_digests_and_others_have_not(good, configs):
    digest = build_scene(good).digest()
    assert digest == read_scene(configs / "quick_slope.toml").digest()
    spelled_out = copy.deepcopy(good)
    spelled_out["link"] = {"timeout": 5, "give_up": 120.0}
    spelled_out["stage"][0]["kind"] = "equilibrium"
    assert build_scene(spelled_out).digest() == digest
    for key, value in (("seed", 2), ("title", "another"), ("record", {"every": 100})):
        assert build_scene(good | {key: value}).digest() != digest
    good["material"][0]["density"] = 2700.0000000000005
    assert build_scene(good).digest() != digest


def test_a_resolved_scene_reads_back_as_itself(good):
    scene = build_scene(good)
    assert build_scene(scene.resolved()).digest() == scene.digest()


# -- what is wrong -------------------------------------------------------------------------------------------------------


def test_every_problem_is_reported_at_once_with_its_place(tmp_path, configs):
    text = (configs / "quick_slope.toml").read_text(encoding="utf-8")
    for right, wrong in (
        ("height = 12.0", "height = -12.0"),
        ("density = 2700.0", "densty = 2700.0"),
        ("{ bulk = 0.5e9, shear", "{ bulc = 0.5e9, shear"),
        ('on = "left"', 'on = "lef"'),
        ("rows = [8, 14]", "rows = [14, 8]"),
        ("every = 200", 'every = "often"'),
        ("seed = 1", "seed = 1.5"),
        ("strength = 100.0", "strength = nan"),
        ('kind = "slope"', 'kind = "slop"'),
    ):
        assert right in text
        text = text.replace(right, wrong, 1)
    path = written(tmp_path, text)
    with pytest.raises(SceneError) as found:
        read_scene(path)
    rows = text.splitlines()
    by_key = {problem.key: problem for problem in found.value.problems}
    for key, piece, reason, remedy in (
        ("grid.height", "height = -12.0", "greater than 0, not -12.0", "height [m]: extent in y"),
        ("material[0].densty", "densty", "unknown key", 'did you mean "density"?'),
        ("material[0].density", "[[material]]", "missing", "density [kg/m3]: density"),
        ("material[0].elastic.bulc", "bulc", "unknown key", 'did you mean "bulk"?'),
        ("material[0].elastic.bulk", "bulc", "missing", "bulk [Pa]: bulk modulus"),
        ("material[0].tension.strength", "nan", "finite number", "strength [Pa]"),
        ("boundary[0].on", '"lef"', "'lef' is not known here", 'did you mean "left"?'),
        ("window[0]", "[[window]]", "first <= last", ""),
        ("record.every", "often", "valid integer", "every [steps]"),
        ("seed", "seed = 1.5", "valid integer", "seed [-]"),
        ("grid.kind", "slop", "'slop' is not known here", 'did you mean "slope"?'),
    ):
        problem = by_key.pop(key)
        assert problem.file == str(path)
        assert piece in rows[problem.line - 1], key
        assert reason in problem.reason, (key, problem.reason)
        assert remedy in problem.remedy, (key, problem.remedy)
    assert not by_key
    assert [p.line for p in found.value.problems] == sorted(p.line for p in found.value.problems)
    said = str(found.value)
    assert said.startswith("11 problems in the scene\n")
    assert re.search(r"bad.toml:\d+: material\[0\].densty: unknown key\n    did you mean", said)


def test_a_key_with_nothing_alike_is_answered_with_what_is_known(good):
    good["record"]["zzz"] = 1
    assert only_problem(good).remedy == "known here: checkpoint, checkpoint_steps, energy, every, history, measure, trace"


@pytest.mark.parametrize(
    ("path", "value"),
    [
        (("material", 0, "rolling"), {"coefficient": 0.1}),
        (("discs", "soil", "suction"), {"coefficient": 0.1}),
        (("discs", "viscous"), {"normal": 0.1}),
        (("ring",), {"glue": {}}),
    ],
)
def test_tables_of_effects_that_are_not_installed_are_refused(good, path, value):
    place = good
    for part in path[:-1]:
        place = place[part]
    place[path[-1]] = value
    assert only_problem(good).reason == "unknown key"


def test_installed_effects_have_their_places():
    assert {"material.elastic", "grain.bond", "discs.damping", "damping"} <= set(declared_effects())


def test_a_new_effect_is_a_new_table(good, monkeypatch):
    class Rolling(Effect):
        """Rolling friction"""

        coefficient: float = quantity(meaning="rolling coefficient", ge=0)

    effects = declared_effects() | {"grain.rolling": Rolling}
    monkeypatch.setattr(scene_module, "declared_effects", lambda: effects)
    scene_class.cache_clear()
    try:
        good["discs"]["soil"]["rolling"] = {"coefficient": 0.2}
        assert build_scene(good).discs.soil.rolling.coefficient == 0.2
        good["discs"]["soil"]["rolling"] = {"coefficient": -0.2}
        assert only_problem(good).key == "discs.soil.rolling.coefficient"
    finally:
        monkeypatch.undo()
        scene_class.cache_clear()


@pytest.mark.parametrize("broken", ['title = "a', "[grid\n", "format = 1\nformat = 2\n", "a = = 1"])
def test_a_file_that_is_not_toml_is_a_problem_with_a_line(tmp_path, broken):
    path = written(tmp_path, "# a comment\n" + broken)
    with pytest.raises(SceneError, match="not valid TOML") as found:
        read_scene(path)
    (problem,) = found.value.problems
    assert problem.file == str(path)
    assert problem.line in (None, 2, 3)


def test_a_file_that_is_not_text_is_a_problem_of_the_scene(tmp_path):
    path = tmp_path / "scene.toml"
    path.write_bytes(b"title = '\xff\xfe'")
    with pytest.raises(SceneError, match="not a text in UTF-8"):
        read_scene(path)


def test_a_missing_file_is_named_with_what_is_there(tmp_path):
    (tmp_path / "other.toml").write_text("")
    with pytest.raises(SceneError, match=r"none\.toml: there is no such file\n.*other\.toml"):
        read_scene(tmp_path / "none.toml")


def test_what_only_the_grid_knows_is_found_before_a_run(configs):
    text = configs / "quick_slope.toml"
    steep = "grid.profile=[[0.0, 4.0], [3.3333333, 4.0], [7.3333333, 12.0], [20.0, 12.0]]"
    with pytest.raises(SceneError, match=r"quick_slope\.toml:7: grid: .*dx"):
        read_scene(text, [steep])
    with pytest.raises(SceneError, match=r"quick_slope\.toml:\d+: window\[0\]: .*ground surface"):
        read_scene(text, ["window.0.rows=[8, 16]", "window.0.columns=[14, 16]"])
    with pytest.raises(SceneError, match="radius at most"):
        read_scene(text, ["discs.radius=0.2"])


@pytest.mark.parametrize("data", [{}, {"format": 2}, {"grid": 5}, {"stage": {}}, {"stage": []}, {"material": [3]}])
def test_nothing_is_too_wrong_to_be_described(data):
    assert all(problem.reason for problem in problems(data).values())


# -- rules between tables ------------------------------------------------------------------------------------------------


def change(*path):
    """A function that puts a value at a place of the scene's data (None: takes it away)."""
    *way, last = path[:-1]

    def apply(data):
        place = data
        for part in way:
            place = place[part]
        if path[-1] is None:
            del place[last]
        else:
            place[last] = path[-1]

    return apply


def locate(band):
    """A stage that ends by its band."""
    return {"name": "locate", "gravity_factor": 9.0, "discard": True, "until": {"band": band, "steps": 900}}


@pytest.mark.parametrize(
    ("apply", "key", "reason"),
    [
        (change("material", None), "material", "no material"),
        (change("material", 0, "elastic", None), "material[0]", "no stiffness"),
        (change("material", 0, "region", [[0, 0], [1, 0], [1, 1]]), "material[0]", "every material has a region"),
        (lambda d: d["material"].append(d["material"][0]), "material[1].name", "two materials are named"),
        (lambda d: d["stage"][1].update(name="equilibrium", kind="fill"), "stage[1].name", "two stages are named 'equilibrium'"),
        (change("window", 0, "columns", [0, 5]), "window[0].columns", "reaches a side of the grid"),
        (change("window", 0, "columns", [25, 29]), "window[0].columns", "reaches a side of the grid"),
        (change("window", 0, "rows", [0, 14]), "window[0].rows", "reaches a side of the grid"),
        (
            lambda d: d["window"].append({"name": "next", "columns": [19, 20], "rows": [8, 10]}),
            "window[1]",
            "touches window 'band'",
        ),
        (change("discs", None), "window", "nothing fills the windows"),
        (change("discs", "soil", "spring", None), "discs.soil", "no stiffness"),
        (lambda d: d["stage"].pop(1), "stage[1]", "a stage of kind couple needs discs"),
        (
            lambda d: d["stage"].append({"name": "more", "kind": "equilibrium", "until": {"steps": 5}}),
            "stage[4]",
            "cannot follow",
        ),
        (lambda d: d["stage"].append({"name": "more", "kind": "couple", "until": {"steps": 5}}), "stage[4]", "a second stage"),
        (change("stage", 1, "gravity", 9.81), "stage[1]", "computes no steps"),
        (change("stage", 0, "until", None), "stage[0]", "would never end"),
        (change("stage", 0, "until", {}), "stage[0]", "would never end"),
        (change("stage", 3, "handover", 5), "stage[3].handover", "only a stage of kind couple"),
        (change("stage", 3, "insitu", False), "stage[3].insitu", "only a stage of kind fill"),
        (change("stage", 3, "discard", True), "stage[3].discard", "only stages of the grid alone"),
        (lambda d: d.update(stage=d["stage"][:1]), "window", "no stage couples"),
        (
            change("stage", 0, "until", {"band": "complete", "steps": 900}),
            "stage[0].until.band",
            "'equilibrium' cannot end",
        ),
        (change("stage", 2, "until", {"band": "complete", "steps": 900}), "stage[2].until.band", "'couple' cannot end"),
        (change("stage", 3, "until", {"band": "enters"}), "stage[3].until.band", "may never form"),
        (change("stage", 3, "until", {"band": "enters", "steps": 9}), "stage[3].until.band", "before its first frame"),
        (lambda d: d["stage"].insert(1, locate("through")), "stage[1].until.band", "needs a coupled window"),
    ],
)
def test_a_broken_rule_between_tables_is_named(good, apply, key, reason):
    apply(good)
    problem = only_problem(good)
    assert problem.key == key
    assert reason in problem.reason
    assert problem.remedy


def test_level_ground_has_no_band(good):
    good["grid"]["profile"] = [[0.0, 12.0], [20.0, 12.0]]
    good["stage"][3]["until"] = {"band": "complete", "steps": 900}
    assert "neither toe nor crest" in only_problem(good).reason


@pytest.mark.parametrize("band", ["enters", "through", "complete"])
def test_a_coupled_stage_may_end_by_its_band(good, band):
    good["stage"][3]["until"] = {"band": band, "steps": 900}
    assert build_scene(good).stage[3].until.band == band


def test_two_windows_with_a_zone_between_them_are_fine(good):
    good["window"].append({"name": "next", "columns": [20, 22], "rows": [8, 10]})
    assert len(build_scene(good).window) == 2


# -- values from the command line ----------------------------------------------------------------------------------------


def test_values_of_the_command_line_replace_those_of_the_file(configs):
    overrides = ["seed=7", "material.0.density=2000", "title=a new name", "stage.0.until.steps=3", "link.give_up=3.0"]
    scene = read_scene(configs / "quick_slope.toml", overrides)
    assert (scene.seed, scene.material[0].density, scene.title) == (7, 2000.0, "a new name")
    assert (scene.stage[0].until.steps, scene.link.give_up) == (3, 3.0)
    assert read_scene(configs / "quick_slope.toml", ["window.0.columns=[15, 17]"]).window[0].columns == (15, 17)


def test_items_of_a_list_go_by_their_names_too(configs):
    scene = read_scene(configs / "quick_slope.toml", ["stage.couple.handover=7", "window.band.rows=[8, 13]"])
    assert scene.stage[2].handover == 7
    assert scene.window[0].rows == (8, 13)
    with pytest.raises(SceneError) as found:
        read_scene(configs / "quick_slope.toml", ["stage.couple.handover=0"])
    assert [(p.file, p.key) for p in found.value.problems] == [("--set", "stage[2].handover")]


@pytest.mark.parametrize(
    ("override", "words"),
    [
        ("seed", "not of the form KEY=VALUE"),
        ("=5", "not of the form KEY=VALUE"),
        ("material.4.density=1", "there is no 4 here"),
        ("material.first.density=1", "there is no 'first' here"),
        ("seed.a=1", "there is no 'a' here"),
        ("material.5=1", "there is no 5 here"),
        ("material.².density=1", "there is no '²' here"),
    ],
)
def test_a_place_that_is_not_there_is_a_problem_of_the_command_line(configs, override, words):
    with pytest.raises(SceneError, match=re.escape(words)) as found:
        read_scene(configs / "quick_slope.toml", [override])
    assert found.value.problems[0].file == "--set"


def test_a_wrong_value_of_the_command_line_is_not_blamed_on_the_file(configs):
    with pytest.raises(SceneError) as found:
        read_scene(configs / "quick_slope.toml", ["grid.height=-1", "record.evry=5", "stage.3.handover=5"])
    assert {p.key: p.file for p in found.value.problems} == {"grid.height": "--set", "record.evry": "--set"}
    with pytest.raises(SceneError) as found:
        read_scene(configs / "quick_slope.toml", ["stage.3.handover=5"])
    assert found.value.problems[0].file == "--set"


@pytest.mark.parametrize(
    ("path", "value", "remedy"),
    [
        (("material", 0, "mohr_coulomb", "cohesion"), -10e3, "did you mean 10000?"),
        (("material", 0, "mohr_coulomb", "friction"), 90.0, "soils have 15 to 45 deg"),
        (("stage", 0, "gravity"), -9.81, "did you mean 9.81? it acts downwards"),
        (("material", 0, "density"), 0.0, "usual are 300 to 10000"),
        (("material", 0, "elastic"), {"young": 1e8, "poisson": 0.5}, "use 0.49"),
        (("damping", "local"), 1.0, "use less than 1"),
        (("link", "timeout"), 0.0, "use more than 0"),
        (("discs", "porosity"), 0.01, "use more than 0.02"),
        (("material", 0, "mohr_coulomb", "dilation"), 40.0, "use dilation <= friction"),
        (("water",), {"level": 3.0}, "there is no pore water"),
        (("pile",), {}, "there are no structural elements"),
        (("material", 0, "mohr_coulomb", "phi"), 30.0, 'did you mean "friction"?'),
        (("material", 0, "rho"), 2000.0, 'did you mean "density"?'),
    ],
)
def test_a_remedy_says_what_would_be_right(good, path, value, remedy):
    place = good
    for part in path[:-1]:
        place = place.setdefault(part, {}) if isinstance(place, dict) else place[part]
    place[path[-1]] = value
    problem = only_problem(good)
    assert problem.remedy.startswith(remedy), problem
    assert 'did you mean "material"' not in problem.remedy


def test_distributions_are_searched_once_in_a_process(configs, monkeypatch):
    """A search reads a file of every installed distribution: with many of them it takes longer than the scene."""
    doubts(read_scene(configs / "quick_slope.toml"))
    searched = []
    monkeypatch.setattr(metadata, "distributions", lambda *where, **context: searched.append(where) or [])
    metadata.entry_points()
    assert len(searched) == 1  # what a search does
    doubts(read_scene(configs / "quick_slope.toml"))
    assert len(searched) == 1
