"""Tables and keys that act on nothing are doubted by name."""

import copy
import tomllib

import pytest

from coupler_protocol.scene.reader import build_scene
from coupler_protocol.scene.rules.between_tables import doubts

BOND = {"tension": 1e3, "shear": 1e3}
WITH_FILES = ("mapped_stones", "quick_shaking")  # of paths that count from the folder of the scene


@pytest.fixture(scope="module")
def shipped(configs):
    return {p.stem: tomllib.loads(p.read_text(encoding="utf-8")) for p in configs.glob("*.toml") if p.stem not in WITH_FILES}


def grid_alone(data):
    data["stage"] = [stage for stage in data["stage"] if stage["name"] in ("equilibrium", "overload")]
    for table in ("window", "discs"):
        del data[table]


def words(data):
    return {path: what for path, what, _ in doubts(build_scene(data))}


@pytest.mark.parametrize(
    ("name", "change", "path", "what"),
    [
        ("quick_slope", lambda d: d.update(coupling={"mapping": "paper"}), ("coupling", "mapping"), "no window"),
        ("quick_slope", lambda d: d.update(link={"timeout": 9.0}), ("link", "timeout"), "no window"),
        ("quick_slope", lambda d: d.update(ring={"friction": {"coefficient": 0.5}}), ("ring",), "no discs"),
        (
            "quick_slope",
            lambda d: d.update(initial_stress={"yy": -1e5, "level": 3.0}),
            ("initial_stress", "level"),
            "all heights",
        ),
        ("quick_slope", lambda d: d["stage"][0].pop("gravity"), ("stage", 1, "gravity_factor"), "a gravity of 0"),
        ("quick_slope", lambda d: d["stage"][1].update(time="real"), ("stage", 1, "damping"), "local damping 0.8"),
        ("quick_pile", lambda d: d["discs"].update(damping={"local": 0.7}), ("stage", 1, "damping"), "bodies fall at 0.3 g"),
        ("paper_slope", lambda d: d.pop("stones"), ("discs", "stone"), "no stones use this material"),
        ("quick_pile", lambda d: d["discs"].update(body="cluster"), ("discs", "body"), "only stones of discs.file"),
        ("quick_pile", lambda d: d.update(coupling={"exchange_every": 5}), ("coupling", "exchange_every"), "one process"),
        ("quick_biaxial", lambda d: d["discs"].update(time_step=0.5), ("discs", "time_step"), "no stage is in real time"),
        ("quick_pile", lambda d: d.update(fos={"resolution": 0.1}), ("fos", "resolution"), "no factor of safety"),
        ("quick_pile", lambda d: d["record"].update(energy=True), ("record", "energy"), "always record their energies"),
        ("quick_biaxial", lambda d: d.update(ring={"bond": BOND}), ("ring", "bond"), "no bond holds a disc to a wall"),
        (
            "quick_biaxial",
            lambda d: d["discs"].update(pair=[{"between": ["soil", "ring"], "bond": BOND}]),
            ("discs", "pair", 0, "bond"),
            "no bond holds",
        ),
        (
            "quick_pile",
            lambda d: d["discs"]["wall"].append({"ends": [[412345.0, 0.0], [412346.0, 0.0]]}),
            ("discs", "wall", 2, "ends"),
            "away from the discs",
        ),
        (
            "quick_slope",
            lambda d: d["boundary"].append({"on": "left", "free": "xy"}),
            ("boundary", 3, "free"),
            "fixed or moved y of left",
        ),
        (
            "quick_slope",
            lambda d: d["boundary"].append({"on": "left", "free": "x", "over": 9}),
            ("boundary", 3, "over"),
            "at once",
        ),
        ("quick_slope", lambda d: d["record"].update(history=10**6), ("record", "history"), "no point"),
        (
            "quick_pile",
            lambda d: d["discs"].update(grading={"curve": [[0.06, 0.0], [0.1, 1.0]]}, spread=0.1),
            ("discs", "spread"),
            "discs.grading",
        ),
    ],
)
def test_what_acts_on_nothing_is_doubted(shipped, name, change, path, what):
    data = copy.deepcopy(shipped[name])
    if name == "quick_slope":
        grid_alone(data)
    assert path not in words(data)
    change(data)
    assert what in words(data)[path]


def test_a_ring_without_walls_and_a_pair_with_it_are_doubted(shipped):
    data = copy.deepcopy(shipped["quick_biaxial"])
    data["discs"]["pair"] = [{"between": ["soil", "ring"], "friction": {"coefficient": 0.1}}]
    assert words(data) == {}
    data["discs"]["wall"] = []
    data["stage"] = data["stage"][:2]
    assert set(words(data)) == {("ring",), ("discs", "pair", 0)}


def test_keys_of_a_packing_are_doubted_beside_a_file(shipped, tmp_path):
    (tmp_path / "discs.csv").write_text("x,y,radius\n0.5,0.04,0.04\n", encoding="utf-8")
    data = copy.deepcopy(shipped["quick_pile"])
    del data["window"]
    data["discs"]["file"] = str(tmp_path / "discs.csv")
    assert ("discs", "confinement") in words(data)
    assert ("discs", "stone") not in words(data)
    data["discs"]["stone"] = data["discs"]["soil"]
    assert "has no stones that would use this material" in words(data)[("discs", "stone")]


def test_real_time_with_its_own_damping_is_not_doubted(shipped):
    data = copy.deepcopy(shipped["quick_pile"])
    data["discs"]["damping"] = {"local": 0.7}
    data["stage"][1]["damping"] = {"local": 0.0}
    assert words(data) == {}
    assert words(shipped["softening_slide"]) == {}


@pytest.mark.parametrize(
    ("ends", "doubted"),
    [
        ([[0.0, 0.101], [1.0, 0.101]], True),
        ([[1.0, 0.099], [0.0, 0.0995]], True),
        ([[0.0, 0.2], [1.0, 0.2]], False),  # a plate as thick as discs
        ([[0.5, 0.1], [1.5, 0.1]], False),  # one surface
        ([[0.0, 0.099], [1.0, 0.101]], False),  # they cross
        ([[2.0, 0.101], [3.0, 0.101]], False),  # one after the other
    ],
)
def test_faces_of_a_plate_thinner_than_overlaps_are_doubted(shipped, ends, doubted):
    """A disc that is pressed through the first face touches the second one as well: two springs in the same direction."""
    data = copy.deepcopy(shipped["quick_pile"])
    data["discs"]["wall"] = [{"ends": [[0.0, 0.1], [1.0, 0.1]]}, {"ends": ends}]
    found = words(data)
    assert (("discs", "wall", 1, "ends") in found and "a disc there touches both" in found["discs", "wall", 1, "ends"]) == doubted
