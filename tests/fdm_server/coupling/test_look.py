"""What compiled code sees of the grid at points of histories is what the functions of the loop step by step compute."""

from types import SimpleNamespace

import numpy as np
import pytest
from grid_cases import slope

from coupler_protocol.wire.messages import Answer
from fdm_server.coupling import look
from fdm_server.coupling.plain_loop import Rims
from fdm_server.coupling.rim_stretch import StretchWatch
from fdm_server.ground.boundaries_in_time import holders
from fdm_server.ground.reactions import reactions
from fdm_server.mesh.grid import build_grid
from fdm_server.model import build_model, new_state
from fdm_server.observe import record
from fdm_server.observe.energy_growth import EnergyWatch
from fdm_server.step.gridpoint_pass import farthest, kinetic_energy, unbalanced_ratio
from fdm_server.step.present_shape import masses
from fdm_server.step.zone_pass import advance, zone_arguments

NODES = np.array([20, 21, 22])


@pytest.fixture
def seen():
    """A grid in motion beside a rim of three gridpoints: side and stage as a Sight wants them, arguments of `look`."""
    scene = slope(1.0, [(0, 4), (4, 4), (12, 12), (20, 12)])
    model = build_model(scene, build_grid(scene))
    state, rng = new_state(model), np.random.default_rng(1)
    free = ~model.fixed
    for _ in range(3):
        state.velocity[:] = 1e-4 * rng.normal(size=state.velocity.shape) * free
        state.added_mass[:] = rng.random(len(state.added_mass))
        advance(model, state)
    rim = SimpleNamespace(nodes=NODES, force=rng.normal(size=(3, 2)), answer=Answer(0.5, *[1.0] * (len(Answer._fields) - 1)))
    stage = SimpleNamespace(
        sides=SimpleNamespace(holders=holders(model.grid, scene.boundary)),
        record=SimpleNamespace(history=10),
        stage=SimpleNamespace(until=SimpleNamespace(ratio=None, displacement=None)),
        energy=EnergyWatch(model, state, 9.81, [rim]),
        stretch=StretchWatch(model, NODES),
    )
    side = SimpleNamespace(model=model, state=state)
    none = np.zeros(0)
    values = dict.fromkeys(Rims._fields, none) | {
        "nodes": NODES,
        "force": rim.force,
        "answer": np.array([rim.answer]),
        "every": 0,
    }
    rims = Rims(**values)
    points = state.applied, state.added_mass, masses(model, state), model.weight_mass, model.fixed, None
    always, _ = zone_arguments(model, state)
    return side, stage, rims, points, always[1], always[3]


def test_a_look_finds_ratios_and_displacement_and_compares_them_with_the_limits(seen):
    side, stage, *known = seen
    model, state = side.model, side.state
    ratio, far = unbalanced_ratio(model, state, 9.81), farthest(state.displacement)
    most = max(ratio, 0.5)
    for limits, ends in (((None, None), 0), ((0.9 * most, 1.1 * far), 0), ((None, far), 1), ((most, None), 1)):
        stage.stage.until = SimpleNamespace(ratio=limits[0], displacement=limits[1])
        stage.energy.balance.sums[1] = 1e30  # no motion is too fast for it
        sight, _ = look.sight_of(side, stage, 100)
        rims, points, _, arrays = known
        assert not look.look(rims, points, arrays, 9.81, 1.0, sight)
        assert look.compare(37, *known, 9.81, sight) == ends, limits
        assert sight.looks[: sight.rows[0]].tolist() == [[37.0, ratio, most, far]]
        assert sight.ratio[0] == ratio


def test_a_look_notices_motion_that_crosses_the_grid_and_velocities_that_are_nan(seen):
    side, stage, rims, points, _, arrays = seen
    for speed in (1.01 * side.model.extent, np.inf, np.nan):
        stage.energy.balance.sums[1] = 1e30
        sight, _ = look.sight_of(side, stage, 100)
        side.state.velocity[40, 0] = speed
        assert look.look(rims, points, arrays, 9.81, 1.0, sight)


def test_points_of_histories_are_those_of_the_loop_step_by_step(seen):
    side, stage, _, points, _, arrays = seen
    model, state = side.model, side.state
    sight, names = look.sight_of(side, stage, 100)
    sight.ratio[0] = 0.25
    for done in (10, 20):
        state.velocity *= 2.0
        look.note(done, 1.5, points, arrays, 3.0, sight)
    steps, values = look.values(sight, names)
    assert steps == [10, 20]
    forces = {
        f"reaction_{axis}:{name}": f
        for name, of in reactions(model, state, 3.0, stage.sides.holders).items()
        for axis, f in of.items()
    }
    assert len(forces) >= 3
    expected = {"unbalanced_ratio": 0.25, "gravity_factor": 1.5, "max_displacement": farthest(state.displacement)} | forces
    assert {name: column[1] for name, column in values.items()} == expected | {"kinetic_energy": kinetic_energy(model, state)}
    assert values["kinetic_energy"][0] == pytest.approx(0.25 * values["kinetic_energy"][1])


def test_movements_at_points_are_those_of_the_loop_step_by_step(seen):
    """Boundaries that are driven, that have moved, and that come back: only at points at which they do, they have a value."""
    side, stage, *_ = seen
    model, state, holders = side.model, side.state, stage.sides.holders
    sight, names = look.sight_of(side, stage, 100)
    assert look.moved_of(sight, None) is None
    driven = state.driven = np.zeros_like(state.velocity)
    moved = look.moved_of(sight, driven)
    points = sight.held.points[slice(*sight.held.begin[:2])]  # a second boundary holds one of them as well
    expected = {}
    rng = np.random.default_rng(1)
    state.displacement[model.fixed] = 0.0
    for done, displacement, velocity in ((10, 0.0, 0.0), (20, 0.0, 1e-6), (30, rng.random(len(points)), 0.0), (40, 0.0, 0.0)):
        state.displacement[points, sight.held.axis[0]], driven[points[0], sight.held.axis[0]] = displacement, velocity
        sight.rows[1] += 1
        sight.points[sight.rows[1] - 1, look.STEP] = done
        look.note_moved(moved, state.displacement, sight)
        for name, value in record.movements(model, state, holders).items():
            expected.setdefault(name, ([], []))[0].append(done)
            expected[name][1].append(value)
    assert look.movements(sight, moved, names) == expected
    assert len(expected) < len(names)
    assert [steps for steps, _ in expected.values()] == [[20, 30]] * len(expected)
