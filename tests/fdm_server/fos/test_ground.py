"""Where trials start: loads and excavations act, strength and windows do not, masses keep their reserve."""

import numpy as np
import pytest

from colluvium import Scene
from coupler_protocol.problems import SceneError
from coupler_protocol.scene.reader import read_scene
from coupler_protocol.scene.tables.boundary import Boundary, InitialStress
from fdm_server.fos.ground import begin_trial, damping_of, settle, with_zone_size
from fdm_server.fos.loading import gravity_of
from fdm_server.fos.study import ignored
from fdm_server.step.masses import static_masses


@pytest.fixture(scope="module")
def ground(configs):
    """A function that settles Dawson's slope on coarse zones: (scene, Ground)."""

    def settled(*changes, stage=None):
        data = read_scene(configs / "dawson_slope.toml", changes)
        if stage:
            extra = read_scene(configs / "dawson_slope.toml", changes).stage[0].model_copy(update=stage)
            data = data.model_copy(update={"stage": [*data.stage, extra]})
        scene = with_zone_size(data, 10 / 6)
        return scene, settle(scene)

    return settled


def weight(ground):
    """Force on the bottom [N]."""
    bottom = ground.model.grid.xy[:, 1] == 0.0
    return -ground.state.force[bottom, 1].sum()


def test_the_bottom_carries_the_weight(ground):
    _, found = ground()
    own = 10.0 * found.model.weight_mass[found.model.grid.xy[:, 1] == 0.0].sum()
    assert weight(found) + own == pytest.approx(20e3 * (35 * 5 + 10 * 15 + 10 * 10 / 2), rel=1e-3)
    assert np.all(found.state.velocity == 0.0)
    assert np.all(found.state.displacement == 0.0)


def test_surcharges_act_from_the_start(ground, configs):
    from coupler_protocol.scene.tables.stages import Surcharge

    load = {"name": "load", "kind": "surcharge", "surcharge": Surcharge(x=(22.0, 30.0), pressure=50e3), "gravity": None}
    assert weight(ground(stage=load)[1]) - weight(ground()[1]) == pytest.approx(8 * 50e3, rel=2e-3)


def test_loads_of_boundaries_act_from_the_start(ground):
    """A pressure at the crest, given for a later stage: the same force on the bottom as a surcharge."""
    load = {"name": "load", "kind": "load", "gravity": None, "boundary": [Boundary(on="top", x=(22.0, 30.0), pressure=50e3)]}
    assert weight(ground(stage=load)[1]) - weight(ground()[1]) == pytest.approx(8 * 50e3, rel=2e-3)


def test_driven_sides_hold(ground):
    drive = {"name": "push", "kind": "load", "gravity": None, "boundary": [Boundary(on="left", velocity={"x": 1e-5})]}
    scene, found = ground(stage=drive)
    assert found.model.fixed[found.model.grid.xy[:, 0] == 0.0, 0].all()
    assert ignored(scene) == ["velocity of 'left': the side is held"]


def test_initial_stress_is_what_the_start_goes_out_from(ground):
    """Locked-in horizontal stress between the sides stays; the weight on the bottom is the same."""
    _, plain = ground()
    _, found = ground("initial_stress.xx=-200e3", "initial_stress.zz=-200e3")
    side = found.model.grid.xy[:, 0] == 0.0
    more = found.state.force[side, 0].sum() - plain.state.force[side, 0].sum()
    assert more == pytest.approx(-5.0 * 200e3, rel=0.2)  # and a part of what the slope above the toe was under
    assert weight(found) == pytest.approx(weight(plain), rel=1e-3)
    assert (found.steps, found.span, found.settlement) == (plain.steps, plain.span, plain.settlement)


def test_excavations_are_dug(ground):
    from coupler_protocol.scene.tables.stages import Excavation

    polygon = [(24.0, 12.0), (33.0, 12.0), (33.0, 16.0), (24.0, 16.0)]
    dig = {"name": "pit", "kind": "excavate", "excavate": Excavation(polygon=polygon), "gravity": None}
    _, before = ground()
    _, after = ground(stage=dig)
    gone = np.setdiff1d(before.model.zone, after.model.zone)
    assert len(gone) > 3
    assert weight(before) - weight(after) > 0.0


@pytest.mark.parametrize("factor", [0.7, 1.0, 2.0])
def test_masses_keep_their_reserve(ground, factor):
    """Lighter masses give a wrong factor in silence: trials compute with the full static masses, whatever the factor."""
    scene, found = ground()
    model, state = begin_trial(scene, found, factor)
    assert np.array_equal(model.mass, static_masses(model.grid.xy, model.zones, model.modulus))
    assert state.mass is None
    assert np.array_equal(state.stress, found.state.stress)
    assert state.stress is not found.state.stress
    assert not state.plastic.any()


def test_slopes_without_damping_get_some(ground):
    scene, _ = ground("damping.local=0.0")
    assert damping_of(scene).local == 0.8


def test_what_has_no_part_is_said(configs):
    found = ignored(read_scene(configs / "paper_slope.toml"))
    assert any(line.startswith("1 window") for line in found)
    assert any(line.startswith("large strain") for line in found)
    assert ignored(read_scene(configs / "dawson_slope.toml")) == []


def staged(configs, *stages):
    """Dawson's slope with these stages."""
    scene = read_scene(configs / "dawson_slope.toml")
    plain = {"until": {"steps": 10}}
    return Scene(**(scene.resolved() | {"stage": [plain | stage for stage in stages]}))


@pytest.mark.parametrize(("stages", "gravity"), [
    # the case found: nothing, then a ramp to full weight in a second stage
    ([{"name": "none", "kind": "equilibrium", "gravity": 9.81, "gravity_factor": 0.0},
      {"name": "ramp", "kind": "equilibrium", "gravity_factor": {"to": 1.0, "over": 5}}], 9.81),
    # half, then all of it
    ([{"name": "half", "kind": "equilibrium", "gravity": 9.81, "gravity_factor": 0.5},
      {"name": "all", "kind": "equilibrium", "gravity_factor": {"to": 1.0, "over": 5}}], 9.81),
    # the ramp is of another kind
    ([{"name": "none", "kind": "equilibrium", "gravity": 9.81, "gravity_factor": 0.0},
      {"name": "ramp", "kind": "overload", "gravity_factor": {"to": 1.0, "over": 5}},
      {"name": "more", "kind": "overload", "gravity_factor": {"to": 3.0, "over": 5}}], 9.81),
    # overload on top of the weight, and a stage that is forgotten, are no part of the ground
    ([{"name": "equilibrium", "gravity": 9.81},
      {"name": "locate", "gravity_factor": 9.0, "discard": True},
      {"name": "overload", "gravity_factor": {"to": 12.0, "over": 5}}], 9.81),
    ([{"name": "load", "gravity": 3.7}], 3.7),
])  # fmt: skip
def test_the_weight_of_the_ground_however_it_was_put_on(configs, stages, gravity):
    assert gravity_of(staged(configs, *stages)) == pytest.approx(gravity)


def test_a_ramped_weight_gives_the_same_start(configs):
    """Stress and settlement of the unramped slope, bit by bit; also where its stress begins with k0."""
    unramped = [{"name": "equilibrium", "gravity": 9.81}]
    ramped = [
        {"name": "none", "kind": "equilibrium", "gravity": 9.81, "gravity_factor": 0.0},
        {"name": "ramp", "kind": "equilibrium", "gravity_factor": {"to": 1.0, "over": 5}},
    ]
    for stress in (None, InitialStress(k0=0.8)):
        scenes = [with_zone_size(staged(configs, *stages), 2.5) for stages in (unramped, ramped)]
        one, two = (settle(scene.model_copy(update={"initial_stress": stress})) for scene in scenes)
        assert np.array_equal(one.state.stress, two.state.stress)
        assert (one.gravity, one.settlement, one.span) == (two.gravity, two.settlement, two.span)


def test_nothing_to_bear(ground):
    with pytest.raises(SceneError, match="nothing loads the ground"):
        ground("stage.0.gravity=0.0")


def test_ground_that_never_comes_to_rest_is_refused(configs):
    """Without support, or with a ratio below the round-off of the forces, a search would never begin."""
    scene = read_scene(configs / "dawson_slope.toml").model_copy(update={"boundary": []})
    with pytest.raises(SceneError, match="no support in x or in y"):
        settle(with_zone_size(scene, 10 / 6))
    with pytest.raises(SceneError, match=r"fos\.ratio(.|\n)*at least 1e-12"):
        read_scene(configs / "dawson_slope.toml", ["fos.ratio=1e-17"])
