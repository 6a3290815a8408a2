"""Several steps between exchanges: the same answer, the same bits however it is run, and back to one where it must not be."""

import copy
import tomllib
from types import SimpleNamespace

import numpy as np
import pytest

import colluvium
from colluvium.closing import sentences
from coupler_protocol.exits import PeerLost
from coupler_protocol.files import checkpoint
from coupler_protocol.wire import lanes, messages
from dem_server.coupling.grid_talk import steps_between
from dem_server.procedure.window_side import DiscreteSide
from tests.commands import run_colluvium
from tests.integration.test_plain_steps import both_ways, same_files
from tests.same_bits import differing

SIDES = ("fdm.rank0", "dem.rank1")


@pytest.fixture(scope="module")
def tables(configs):
    """The quick scene under 1.2 g, its springs strong enough not to break, every 8 steps an exchange."""
    data = tomllib.loads((configs / "quick_slope.toml").read_text(encoding="utf-8"))
    data["record"] = {"every": 100, "history": 10}
    data["coupling"] = {"exchange_every": 8}
    data["discs"]["soil"]["bond"] = {"tension": 1e9, "shear": 1e9}
    data["stage"][0]["until"] = {"steps": 1500}
    data["stage"][2] |= {"handover": 150, "until": {"steps": 400}}
    data["stage"][3] |= {"gravity_factor": {"to": 1.2, "over": 100}, "until": {"steps": 700}}
    return data


def computed(tables, folder, **coupling):
    data = copy.deepcopy(tables) | {"coupling": coupling}
    return colluvium.run(colluvium.Scene(**data), folder)


@pytest.fixture(scope="module")
def every_step(tables, tmp_path_factory):
    with computed(tables, tmp_path_factory.mktemp("one") / "run", exchange_every=1) as run:
        yield run


@pytest.fixture(scope="module")
def straight(tables, tmp_path_factory):
    with computed(tables, tmp_path_factory.mktemp("eight") / "run", exchange_every=8) as run:
        yield run


def saved(run, side, stage="overload"):
    return checkpoint.load(run.folders[0] / f"{side}.{stage}.h5")[0]


def test_fewer_exchanges_give_the_same_rest(straight, every_step):
    """Both at rest under 1.2 g: displacements and stresses differ by what is left of the motion."""
    rows = {row["name"]: row for row in straight.info["stages"]}
    assert 700 / 8 <= rows["overload"]["exchanges"] < 150
    assert rows["couple"]["fell_back"] == rows["overload"]["fell_back"] == ""
    assert any("700 steps in" in sentence for sentence in sentences(straight.info))
    for fields, name in (("gridpoints", "displacement"), ("zones", "stress")):
        one, other = (getattr(getattr(run, fields)(run.last_frame("overload")), name) for run in (every_step, straight))
        assert np.abs(other - one).max() < 2e-3 * np.abs(one).max()
        assert np.any(other != one)


@pytest.mark.long
@pytest.mark.parametrize("every", [3, 10])
def test_lists_made_between_exchanges_give_the_same_bits_over_a_lane_and_without(tables, tmp_path, monkeypatch, every):
    """Discs move far under growing gravity: the sums of the mass rule belong to the places for which a list was made."""
    monkeypatch.setattr(lanes, "EARLIEST", 0)
    data = copy.deepcopy(tables) | {"coupling": {"exchange_every": every}, "record": {"every": 100, "history": 7}}
    data["discs"]["soil"]["bond"] = {"tension": 1.5e3, "shear": 3.5e3}
    data["stage"][3] |= {"gravity_factor": {"to": 6.0, "over": 500}, "until": {"steps": 500}}
    rows = both_ways(tmp_path, data)
    assert rows[-1]["plain_steps"] > 400
    assert rows[-1]["exchanges"] < 400
    assert same_files(tmp_path) == []


def test_places_of_the_rim_agree_where_forces_are_exchanged(straight):
    """The discs' nodes have gone the grid's way, in means of several steps."""
    grid, discs = saved(straight, "fdm.rank0"), saved(straight, "dem.rank1")
    nodes = np.asarray(discs["rim"]["nodes"])
    xy = straight.gridpoints(straight.last_frame("overload")).xy[:, :2] + np.asarray(grid["grid"]["displacement"])
    nearest = np.linalg.norm(nodes[:, None] - xy[None], axis=2).min(axis=1)
    assert nearest.max() < 1e-12
    assert np.abs(np.asarray(grid["grid"]["displacement"])).max() > 1e-5


def test_two_processes_give_the_bits_of_one(straight, scene_file, tmp_path):
    done = run_colluvium("run", scene_file, "--out", tmp_path / "two", "--quiet")
    assert done.returncode == 0, done.stderr
    for side in SIDES:
        assert differing(straight.folders[0] / f"{side}.overload.h5", tmp_path / "two" / f"{side}.overload.h5") == []


def test_a_restart_gives_the_bits_of_the_straight_run(straight, scene_file, tmp_path):
    options = ["--out", tmp_path / "run", "--from", f"{straight.folders[0]}@couple", "--in-process", "--quiet"]
    done = run_colluvium("run", scene_file, *options)
    assert done.returncode == 0, done.stderr
    for side in SIDES:
        assert differing(straight.folders[0] / f"{side}.overload.h5", tmp_path / "run" / f"{side}.overload.h5") == []


def soft(tables):
    """The ground a hundred times softer: contacts are stiffer than its zones."""
    data = copy.deepcopy(tables)
    data["material"][0]["elastic"] = {"bulk": 5e6, "shear": 1.5e6}
    data["stage"][3]["until"]["steps"] = 200
    return data


def test_contacts_stiffer_than_zones_fall_back_to_the_bits_of_every_step(tables, tmp_path, caplog):
    data = soft(tables)
    with computed(data, tmp_path / "one", exchange_every=1) as one, computed(data, tmp_path / "many", exchange_every=20) as many:
        assert [row["exchanges"] for row in many.info["stages"] if "exchanges" in row] == [400, 200]
        assert "times as stiff as the zones" in many.info["stages"][2]["fell_back"]
        warning = "warning: both sides exchanged in every step from stage couple on"
        assert any(s.startswith(warning) for s in sentences(many.info))
        for side in SIDES:
            assert differing(one.folders[0] / f"{side}.overload.h5", many.folders[0] / f"{side}.overload.h5") == []
    assert "both sides exchange in every step from now on" in caplog.text


def test_motion_that_grows_by_itself_falls_back_before_it_is_ten_times_as_fast(tables, tmp_path, monkeypatch):
    """The same ground without the limit of stiffness: the monitor alone."""
    monkeypatch.setattr("fdm_server.coupling.exchange_pauses.STIFFEST", np.inf)
    data, fastest = soft(tables), {1: 0.0, 20: 0.0}
    data["stage"] = data["stage"][:3]
    for every, out in ((1, "one"), (20, "many")):

        def look(moment, every=every):
            if moment.rank == 0 and moment.stage == "couple":
                fastest[every] = max(fastest[every], float(np.abs(moment.state.velocity).max()))

        scene = colluvium.Scene(**(data | {"coupling": {"exchange_every": every}}))
        with colluvium.run(scene, tmp_path / out, on_step=(1, look)) as run:
            row = run.info["stages"][2]
    assert row["fell_back"] == "the motion of the rim grew by itself"
    assert 0.0 < fastest[20] < 10.0 * fastest[1]


def test_gravity_between_exchanges_lies_on_a_line():
    """From the first step to the last, whatever follows: the next stage may begin with a jump."""
    order = messages.Order(3.0, 28.0, 99.0, 1.3, 1.0, 4.0, 5.0)
    between = list(steps_between(order, 10.0, 13.0))
    assert [(part.step, part.gravity) for part in between] == [(25.0, 11.0), (26.0, 12.0), (27.0, 13.0)]
    assert all(part.flags == 0.0 for part in between)
    assert list(steps_between(order._replace(interval=1.0), 10.0, 10.0)) == []


def test_discs_know_the_gravity_of_the_last_step_of_a_stage(configs):
    """The overload of the quick scene grows; its factor travels, gravity at factor 1 stands in the scene."""
    scene = colluvium.Scene.read(configs / "quick_slope.toml")
    index = next(i for i, stage in enumerate(scene.stage) if stage.kind == "overload")
    order = messages.Order(float(index), 28.0, 99.0, 1.3, 1.0, 4.0, float(messages.END_OF_STAGE))
    assert DiscreteSide.gravity_in(SimpleNamespace(scene=scene), order) == pytest.approx(1.3 * 9.81, rel=1e-15)


@pytest.mark.parametrize(("interval", "step"), [(0.0, 24.0), (9.0, 33.0), (4.0, 29.0), (np.nan, 28.0)])
def test_discs_refuse_pauses_that_the_scene_does_not_allow(interval, step):
    """At most 8 steps, and step numbers that follow each other."""
    scene = SimpleNamespace(coupling=SimpleNamespace(exchange_every=8))
    side = SimpleNamespace(model=SimpleNamespace(in_real_time=False), scene=scene, stage=3, steps=24, step=1.0)
    DiscreteSide.accept_order(side, messages.Order(3.0, 28.0, 9.81, 1.0, 1.0, 4.0, 0.0))
    with pytest.raises(PeerLost, match="at most 8"):
        DiscreteSide.accept_order(side, messages.Order(3.0, step, 9.81, 1.0, 1.0, interval, 0.0))


@pytest.mark.parametrize("stage", [-1.0, 2.0, 99.0])
def test_discs_refuse_steps_of_another_stage(stage):
    scene = SimpleNamespace(coupling=SimpleNamespace(exchange_every=8))
    side = SimpleNamespace(model=SimpleNamespace(in_real_time=False), scene=scene, stage=3, steps=24, step=1.0)
    with pytest.raises(PeerLost, match="this side in number 3"):
        DiscreteSide.accept_order(side, messages.Order(stage, 28.0, 9.81, 1.0, 1.0, 4.0, 0.0))
