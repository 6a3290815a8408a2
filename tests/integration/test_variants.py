"""A table is an effect: the quick scene with tables removed, added or changed, in one process, a few hundred steps."""

import copy
import tomllib

import numpy as np
import pytest

import colluvium
from colluvium.results import export
from coupler_protocol.problems import SceneError


@pytest.fixture(scope="module")
def tables(configs):
    """The quick scene as plain data, cut short."""
    data = tomllib.loads((configs / "quick_slope.toml").read_text())
    data["stage"] = data["stage"][:3]
    data["stage"][0]["until"] = {"ratio": 1e-4, "steps": 2000}
    data["stage"][2] |= {"handover": 100, "until": {"ratio": 1e-4, "steps": 1000}}
    data["record"] = {"every": 1000}
    return data


@pytest.fixture
def compute(tables, tmp_path):
    """compute(change) -> results of the scene after `change(tables)`."""
    opened = []

    def run(change, name="run"):
        data = copy.deepcopy(tables)
        change(data)
        opened.append(colluvium.run(colluvium.Scene(**data), tmp_path / name))
        return opened[-1]

    yield run
    for result in opened:
        result.close()


def test_elastic_zones_have_no_plastic_state(compute):
    def change(data):
        del data["material"][0]["mohr_coulomb"], data["material"][0]["tension"]

    run = compute(change)
    assert "plastic_state" not in run.zones(-1)
    assert "stress" in run.zones(-1)
    assert run.info["exit_code"] == 0


def test_discs_without_bonds_have_no_bond_state(compute):
    run = compute(lambda data: data["discs"]["soil"].pop("bond"))
    assert "bond_state" not in run.contacts(-1)
    assert run.info["stages"][-1]["bonds_broken"] == [0]


def test_two_windows_are_two_discrete_processes(compute):
    def change(data):
        data["window"][0]["rows"] = [8, 10]
        data["window"].append({"name": "below", "columns": [20, 22], "rows": [4, 6]})

    run = compute(change)
    assert run.windows == [1, 2]
    assert [w["name"] for w in run.info["windows"]] == ["band", "below"]
    assert len(run.zones(0).corners) - len(run.zones(-1).corners) == 2 * 9
    assert max(run.info["stages"][-1]["ratio_discrete"]) <= 1e-4
    depth = [-run.discs(-1, rank).displacement[:, 1].mean() for rank in (1, 2)]
    assert np.isfinite(depth).all()


def test_both_mappings_agree_where_control_discs_are_centred(compute):
    ours = compute(lambda data: None, "ours")
    paper = compute(lambda data: data.setdefault("coupling", {"mapping": "paper"}), "paper")
    a, b = (run.zones(-1).stress[:, 1] for run in (ours, paper))
    assert np.abs(a - b).max() > 0.0
    assert np.sqrt(np.mean((a - b) ** 2)) < 0.01 * np.abs(a).mean()


def test_a_lighter_window_presses_less_on_what_is_below(compute):
    matched = compute(lambda data: None, "matched")
    light = compute(lambda data: data["discs"].update(density_matching=False), "light")
    below = [run.zones(-1).stress[np.hypot(*(run.zones(-1).xy - [11.667, 5.0]).T).argmin(), 1] for run in (matched, light)]
    assert below[0] < 1.03 * below[1] < 0.0
    assert "density_factor" not in light.info["windows"][0]
    assert matched.info["windows"][0]["density_factor"] > 1.5


def test_ring_table_overrides_the_discs_properties(compute):
    def change(data):
        data["ring"] = {"spring": {"normal": 5e8, "shear": 2e8}, "friction": {"coefficient": 0.0}}

    run = compute(change)
    discs, contacts = run.discs(-1), run.contacts(-1)
    at_ring = (discs.control[contacts.ends] == 1).any(axis=1)
    assert at_ring.sum() > 50
    assert np.abs(contacts.shear_force[at_ring]).max() == 0.0  # smooth and not bonded
    assert np.abs(contacts.shear_force[~at_ring]).max() > 0.0


def test_a_scene_without_windows_needs_no_discrete_process(compute):
    def change(data):
        data["window"], data["stage"] = [], data["stage"][:1]
        del data["discs"]

    run = compute(change)
    assert run.windows == []
    assert run.info["stages"][0]["ratio_continuum"] <= 1e-4


def test_locate_can_be_discarded(compute):
    def change(data):
        data["stage"].insert(1, {"name": "locate", "gravity_factor": 4.0, "until": {"steps": 300}, "discard": True})

    kept = compute(lambda data: None, "plain")
    run = compute(change, "located")
    np.testing.assert_array_equal(run.zones(-1).stress, kept.zones(-1).stress)
    assert run.zones(run.last_frame("locate")).stress[:, 1].min() < 1.5 * kept.zones(-1).stress[:, 1].min()


def test_discs_with_every_law_couple_and_say_what_they_keep(compute):
    laws = {
        "rolling": {"coefficient": 0.1},
        "dashpot": {"normal": 0.1, "shear": 0.1},
        "parallel_bond": {"normal_stiffness": 1e9, "shear_stiffness": 4e8, "tension": 1e6, "shear": 1e6, "radius": 0.8},
    }

    def change(data):
        data["discs"]["soil"] |= laws
        data["discs"]["pair"] = [{"between": ["soil", "ring"], "rolling": {"coefficient": 0.0}}]

    run = compute(change)
    assert run.info["stages"][-1]["ended_by"].startswith("ratio")
    discs, contacts = run.discs(-1), run.contacts(-1)
    assert (contacts.parallel_bond_state == 1).mean() > 0.9
    assert np.abs(contacts.parallel_bond_moment).max() > 0.0
    at_ring = (discs.control[contacts.ends] == 1).any(axis=1)
    assert not contacts.rolling_moment[at_ring].any()
    assert np.abs(contacts.rolling_moment[~at_ring]).max() > 0.0


def test_the_window_takes_its_discs_from_a_file(compute, tmp_path):
    """Discs of one run, exported after the hand-over, are those of another, and are brought to the slope's stress again."""
    first = compute(lambda data: None, "first")
    file = tmp_path / "discs.csv"
    export.write(tmp_path / "first", stage="couple", out=file)
    second = compute(lambda data: data["discs"].update(file=str(file)), "second")
    packed, taken = (run.discs(run.last_frame("fill")) for run in (first, second))
    assert taken.radius.tobytes() == packed.radius.tobytes()
    window = second.info["windows"][0]
    assert window["discs"] == first.info["windows"][0]["discs"]
    assert window["error_yy"] < 1.2 * first.info["windows"][0]["error_yy"]
    last = second.frames[second.last_frame("couple")]
    assert last.step > 0
    with pytest.raises(SceneError, match=r"outside the window|overlaps of"):
        compute(lambda data: (data["discs"].update(file=str(file)), data["window"][0].update(rows=[7, 13])), "third")


def test_one_file_cannot_fill_two_windows(tables):
    data = copy.deepcopy(tables)
    data["discs"]["file"] = "discs.csv"
    data["window"].append({"name": "other", "columns": [20, 22], "rows": [8, 12]})
    with pytest.raises(SceneError, match="cannot fill 2 windows"):
        colluvium.Scene(**data)
