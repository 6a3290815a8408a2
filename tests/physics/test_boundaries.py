"""Boundaries: reactions balance weights, tractions make constant stress, velocities and loads change as their stages say."""

from types import SimpleNamespace

import numpy as np
import pytest
from run_cases import ROLLERS, SOIL, column, compute, scene, stage
from zone_cases import PAPER, ring, settle, slope, soil

from colluvium import open_run, run
from colluvium.running import threads
from coupler_protocol.files import checkpoint
from coupler_protocol.files.restart import Origin
from coupler_protocol.scene.tables.boundary import Boundary
from fdm_server.ground.boundaries_in_time import begin_stage, load_forces
from fdm_server.mesh.grid import build_grid
from fdm_server.model import build_model, new_state
from fdm_server.observe import fields

WEIGHT = 2000.0 * 9.81  # [N/m3]
PROFILE = ((0, 2), (2, 2), (3.1, 4.3), (4.4, 4.3), (7.3, 5), (9, 5))


def grid_state(out, name):
    return checkpoint.load(out / f"fdm.rank0.{name}.h5")[0]["grid"]


def test_the_bottom_carries_the_weight_and_the_sides_push_by_k0(tmp_path):
    with compute(tmp_path, column(), stage("rest", "equilibrium", ratio=1e-9, gravity=9.81)) as run:
        found = run.info["stages"][0]["reactions"]
        last = run.history("reaction_y:bottom")[1][-1]
    k0 = (3 * 0.5 - 2 * 0.15) / (3 * 0.5 + 4 * 0.15)  # lambda / (lambda + 2 G)
    assert found["bottom"]["y"] == pytest.approx(WEIGHT * 12.0, rel=1e-7)
    assert last == pytest.approx(WEIGHT * 12.0, rel=1e-6)
    assert found["left"]["x"] == pytest.approx(k0 * WEIGHT * 18.0, rel=1e-7)
    assert found["right"]["x"] == pytest.approx(-k0 * WEIGHT * 18.0, rel=1e-7)
    assert set(found["left"]) == {"x"}


def loaded(scene, *boundaries):
    """Model and state of a scene at the first step of a stage in which these boundaries begin."""
    model = build_model(scene, build_grid(scene))
    state = new_state(model)
    scene.stage = [SimpleNamespace(boundary=list(boundaries), kind="load", discard=False)]
    model, sides = begin_stage(scene, 0, model, state)
    sides.push.apply(state)
    return model, state


@pytest.mark.parametrize(
    ("scene", "sides"),
    [
        (slope(0.5, soil(), profile=PROFILE, fit="profile"), "left right bottom top face"),
        (slope(0.5, soil()), "left right bottom top face"),
        (ring(1.0, 3.0, 12, soil()), "inner outer"),
        (ring(1.0, 3.0, 9, soil(), part="half", growth=1.1), "inner outer bottom"),
    ],
)
def test_a_stress_on_all_sides_is_the_stress_of_every_zone(scene, sides):
    scene.boundary = []
    stress = {"xx": -3e5, "yy": -1e5, "xy": 0.5e5}
    model, state = loaded(scene, *(Boundary(on=side, stress=stress) for side in sides.split()))
    settle(model, state, 0.0, 1e-13)
    zz = (3 * PAPER.bulk - 2 * PAPER.shear) / (6 * PAPER.bulk + 2 * PAPER.shear) * -4e5
    np.testing.assert_allclose(fields.stress(model, state), np.tile([-3e5, -1e5, zz, 0.5e5], (len(model.zone), 1)), rtol=1e-9)


def test_pressure_and_shear_act_along_and_against_an_oblique_side():
    scene = slope(0.5, soil(), profile=((0, 2), (2, 2), (5, 6), (8, 6)), fit="profile")  # a face of 3 : 4
    model = build_model(scene, build_grid(scene))
    force = load_forces(model, new_state(model), Boundary(on="face", pressure=1e3, shear=1e2))
    np.testing.assert_allclose(force.sum(axis=0), [4e3 - 3e2, -3e3 - 4e2], rtol=1e-12)
    half = load_forces(model, new_state(model), Boundary(on="face", pressure=1e3, y=(3.1, 5.1)))
    np.testing.assert_allclose(half.sum(axis=0), [2e3, -1.5e3], rtol=1e-12)
    moment = np.sum(model.grid.xy[:, 0] * half[:, 1] - model.grid.xy[:, 1] * half[:, 0])
    np.testing.assert_allclose(moment, -1.5e3 * (2 + 2.1 * 3 / 4) - 2e3 * 4.1, rtol=1e-12)
    right = load_forces(model, new_state(model), Boundary(on="right", pressure=1e3, x=(7.0, 9.0), y=(1.0, 2.5)))
    np.testing.assert_allclose(right.sum(axis=0), [-1.5e3, 0.0], atol=1e-9)


def test_loads_ramp_replace_each_other_on_the_same_range_and_add_up_on_others(tmp_path):
    load = {"on": "top", "pressure": 1e5, "over": 400}
    with compute(
        tmp_path,
        column(),
        stage("half", steps=400, boundary=[load, {"on": "top", "x": [0.0, 1.0], "pressure": 4e4}]),
        stage("keep", steps=20),
        stage("less", ratio=1e-9, boundary=[load | {"pressure": 2e4, "over": 10}]),
        stage("none", ratio=1e-9, boundary=[load | {"pressure": 0.0}, {"on": "top", "x": [0.0, 1.0], "pressure": 0.0}]),
    ) as run:
        found = {row["name"]: row["reactions"]["bottom"]["y"] for row in run.info["stages"]}
    applied = {name: grid_state(tmp_path, name)["applied"].sum(axis=0) for name in ("half", "keep", "less")}
    np.testing.assert_allclose(applied["half"], [0.0, -2.0e5 - 4e4], atol=1e-6)
    np.testing.assert_array_equal(applied["keep"], applied["half"])
    np.testing.assert_allclose(applied["less"], [0.0, -4e4 - 4e4], atol=1e-6)
    assert np.abs(grid_state(tmp_path, "none")["applied"]).max() < 1e-9
    assert found["less"] == pytest.approx(8e4, rel=1e-7)


def test_loads_grow_linearly():
    scene = slope(0.5, soil())
    scene.stage = [SimpleNamespace(boundary=[Boundary(on="top", pressure=1e3, over=8)], kind="load", discard=False)]
    model = build_model(scene, build_grid(scene))
    state = new_state(model)
    model, sides = begin_stage(scene, 0, model, state)
    for share in [1 / 8, 2 / 8, 3 / 8, 4 / 8, 5 / 8, 6 / 8, 7 / 8, 1.0, 1.0]:
        sides.push.apply(state)
        sides.push.loads[0].ramp.step_done()
        assert state.applied[:, 1].sum() == pytest.approx(-share * 5e3, rel=1e-12)


def test_a_ramp_of_the_first_stage_starts_from_the_scenes_own_boundaries():
    one = slope(1.0, soil(), profile=((0, 4), (4, 4)))
    one.boundary = [Boundary(on="top", pressure=8e3), Boundary(on="left", velocity={"x": 4e-6})]
    model = build_model(one, build_grid(one))
    state = new_state(model)
    new = [Boundary(on="top", pressure=0.0, over=4), Boundary(on="left", velocity={"x": 0.0}, over=4)]
    one.stage = [SimpleNamespace(boundary=new, kind="load", discard=False)]
    model, sides = begin_stage(one, 0, model, state)
    left = np.flatnonzero(model.grid.xy[:, 0] == 0.0)
    for done, share in enumerate([0.75, 0.5, 0.25, 0.0]):
        sides.push.apply(state)
        sides.push.loads[0].ramp.step_done()
        sides.drive.apply(state, done)
        assert state.applied[:, 1].sum() == pytest.approx(-8e3 * 4.0 * share, abs=1e-6)
        np.testing.assert_allclose(state.velocity[left, 0], 4e-6 * share, atol=1e-20)


def test_velocities_ramp_stop_and_let_go(tmp_path):
    plate = {"on": "top", "name": "plate"}
    with compute(
        tmp_path,
        column(),
        stage("press", steps=100, boundary=[plate | {"velocity": {"y": -1e-6}, "over": 50}]),
        stage("go on", steps=60),
        stage("back", steps=40, boundary=[plate | {"velocity": {"y": 2e-6}, "over": 10}]),
        stage("hold", ratio=1e-9, boundary=[plate | {"fix": "y"}]),
        stage("free", ratio=1e-9, boundary=[plate | {"free": "y"}]),
    ) as run:
        rows = {row["name"]: row["reactions"] for row in run.info["stages"]}
    states = {name: grid_state(tmp_path, name) for name in rows}
    top = states["press"]["driven"][:, 1] != 0.0
    assert top.sum() == 5
    way = -1e-6 * (np.arange(1, 51).sum() / 50 + 50)
    np.testing.assert_allclose(states["press"]["displacement"][top, 1], way, rtol=1e-12)
    way += -1e-6 * 60
    np.testing.assert_allclose(states["go on"]["displacement"][top, 1], way, rtol=1e-12)
    way += np.sum(-1e-6 + 3e-6 * np.arange(1, 11) / 10) + 2e-6 * 30
    np.testing.assert_allclose(states["back"]["displacement"][top, 1], way, rtol=1e-12)
    stiffness = (0.5e9 + 4 / 3 * 0.15e9) / 6.0
    assert rows["hold"]["plate"]["y"] == pytest.approx(stiffness * way * 2.0, rel=1e-6)
    assert rows["hold"]["bottom"]["y"] == pytest.approx(-rows["hold"]["plate"]["y"], rel=1e-6)
    assert rows["free"]["plate"] == {"y": 0.0}
    assert np.abs(states["free"]["displacement"]).max() < 1e-8 * abs(way)


def test_a_discarded_stage_leaves_no_boundary(tmp_path):
    push = {"on": "top", "pressure": 1e5}
    held = {"on": "top", "x": [0.0, 0.5], "fix": "xy"}
    with compute(
        tmp_path,
        column(),
        stage("try", "locate", steps=200, discard=True, boundary=[push, held]),
        stage("rest", steps=100),
    ) as run:
        assert run.history("max_displacement")[1][-1] == 0.0
    after = grid_state(tmp_path, "rest")
    assert np.all(after["applied"] == 0.0)
    assert "loads" not in after
    assert run.info["stages"][1]["reactions"].keys() == {"left", "right", "bottom"}


def test_the_scenes_own_loads_begin_again_after_a_discarded_stage(tmp_path):
    load = {"on": "top", "pressure": 1e5, "over": 50}
    first = stage("try", "locate", steps=60, discard=True)
    with compute(tmp_path, column(), first, stage("rest", ratio=1e-9), boundary=[*ROLLERS, load]) as run:
        found = [row["reactions"]["bottom"]["y"] for row in run.info["stages"]]
    assert found[1] == pytest.approx(2e5, rel=1e-7)
    assert grid_state(tmp_path, "rest")["applied"][:, 1].sum() == pytest.approx(-2e5, rel=1e-12)


def test_a_component_held_in_a_discarded_stage_is_free_afterwards(tmp_path):
    held = stage("try", "locate", steps=60, discard=True, boundary=[{"on": "top", "fix": "y"}])
    with compute(tmp_path, column(), held, stage("rest", ratio=1e-9, gravity=9.81)) as run:
        rest = run.info["stages"][1]["reactions"]
    assert rest["bottom"]["y"] == pytest.approx(WEIGHT * 12.0, rel=1e-7)


def test_going_on_inside_the_procedure_gives_the_same_bits(tmp_path):
    clay = SOIL | {"mohr_coulomb": {"friction": 10.0, "cohesion": 20e3}}
    boundaries = [*ROLLERS, {"on": "right", "free": "x"}, {"on": "right", "pressure": 3e4, "over": 50}]
    made = scene(
        column(4.0, 3.0, 0.25),
        stage("rest", "equilibrium", steps=200, gravity=9.81),
        stage("press", steps=300, boundary=[{"on": "top", "x": [0, 1], "velocity": {"x": 0.0, "y": -1e-5}, "over": 100}]),
        stage("relax", steps=300, boundary=[{"on": "right", "stress": {"xx": 0.0}, "over": 200}]),
        stage("lift", steps=200, boundary=[{"on": "top", "x": [0, 1], "velocity": {"y": 1e-5}, "over": 100}]),
        boundary=boundaries,
        material=[clay],
        initial_stress={"k0": 0.5},
    )
    run(made, tmp_path / "straight")
    for name in ("rest", "press", "relax"):
        out = tmp_path / f"from {name}"
        out.mkdir()
        threads.run(made, out, report="none", origin=Origin(tmp_path / "straight", name))
        one, two = (grid_state(folder, "lift") for folder in (tmp_path / "straight", out))
        assert one.keys() == two.keys()
        one, two = ({**state, **state.get("loads", {}), "loads": 0} for state in (one, two))
        assert [key for key in one if np.asarray(one[key]).tobytes() != np.asarray(two[key]).tobytes()] == []
        with open_run(tmp_path / "straight") as a, open_run(out) as b:
            steps, values = a.history("reaction_y:top")
            again, other = b.history("reaction_y:top")
            assert values[np.isin(steps, again)].tobytes() == other.tobytes()
