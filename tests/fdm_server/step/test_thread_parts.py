"""How a step is cut into parts: every gridpoint summed once, after all its zones; the same bits for any number of threads."""

import numpy as np
import pytest
from grid_cases import material, slope

from coupler_protocol.compiled import threads as team
from fdm_server.effects.damping import Damping
from fdm_server.effects.softening import Softening
from fdm_server.mesh.grid import build_grid
from fdm_server.model import build_model, new_state
from fdm_server.step import clock
from fdm_server.step.blocks import LANES
from fdm_server.step.gridpoint_pass import update_velocities
from fdm_server.step.present_shape import begin_large_strain
from fdm_server.step.thread_parts import FEWEST, STRIP, build_partition
from fdm_server.step.zone_pass import advance

SIDE = 232  # 53,824 zones: more than three threads want
STEPS = 12


@pytest.fixture(autouse=True)
def size_of_the_team():
    before = team.size()
    yield
    team.set_size(before)


def big_box():
    weak = material()
    scene = slope(1.0, [(0, SIDE), (SIDE, SIDE)], length=SIDE, height=SIDE, materials=[weak])
    return scene, build_grid(scene)


@pytest.fixture(scope="module")
def box():
    return big_box()


def moved(box, threads, large_strain):
    team.set_size(threads)
    model = build_model(*box)
    assert len(model.partition.strips) == threads
    state = new_state(model)
    state.velocity[:] = np.where(model.fixed, 0.0, 1e-3 * np.random.default_rng(3).uniform(-1, 1, state.velocity.shape))
    if large_strain:
        begin_large_strain(model, state)
    for _ in range(STEPS):
        update_velocities(model, state, 9.81)
        advance(model, state)
    assert np.any(state.plastic)
    return state


@pytest.mark.parametrize("large_strain", [False, True])
def test_two_and_three_threads_give_the_bits_of_one(box, large_strain):
    one = moved(box, 1, large_strain)
    for threads in (2, 3):
        other = moved(box, threads, large_strain)
        for name in ("velocity", "displacement", "force", "stress", "plastic", "corner_force"):
            assert np.array_equal(getattr(one, name), getattr(other, name)), name


@pytest.mark.parametrize("damping", [{"combined": 0.5}, {"rayleigh": {"fraction": 0.1, "frequency": 10.0}}])
def test_softening_and_all_kinds_of_damping_have_the_bits_of_one_thread(box, damping):
    found = []
    for threads in (1, 2):
        team.set_size(threads)
        box[0].material[0].softening = Softening(strain=[1e-5, 1e-3], cohesion=[2e4, 0.0], friction=[25.0, 20.0])
        model = build_model(*box)
        state = new_state(model)
        model = clock.begin(model, state, Damping(**damping), 0.5 if "rayleigh" in damping else None)
        motion = np.random.default_rng(3).uniform(-1, 1, state.velocity.shape)
        state.velocity[:] = np.where(model.fixed, 0.0, 1e-3 * motion / clock.seconds(state))
        for _ in range(STEPS):
            update_velocities(model, state, 9.81)
            advance(model, state)
        found.append(state)
    box[0].material[0].softening = None
    one, two = found
    assert one.plastic_shear.max() > 1e-5
    for name in ("velocity", "displacement", "force", "stress", "plastic_shear"):
        assert np.array_equal(getattr(one, name), getattr(two, name)), name


@pytest.mark.parametrize("threads", [1, 2, 3])
def test_gridpoints_are_summed_once_and_after_the_last_of_their_zones(box, threads):
    zones, points = box[1].zones, len(box[1].xy)
    parts = build_partition(zones, points, threads)
    assert np.array_equal(np.sort(parts.order), np.arange(points))
    strips = len(parts.ready) - 2
    assert (parts.ready[0], parts.ready[-1]) == (0, points)
    when = np.empty(points, dtype=np.int64)
    for s in range(strips + 1):
        when[parts.order[parts.ready[s] : parts.ready[s + 1]]] = s
    strip = np.arange(len(zones)) // (STRIP * LANES)
    seam = when == strips
    for corner in zones.T:
        assert np.all(strip <= when[corner])
    runs = np.array([np.searchsorted([last for _, last in parts.strips], strip, side="right")] * 4).T
    low, high = np.full(points, 99), np.zeros(points, dtype=int)
    np.minimum.at(low, zones.ravel(), runs.ravel())
    np.maximum.at(high, zones.ravel(), runs.ravel())
    assert np.array_equal(seam, low != high)


def test_small_grids_stay_in_one_thread():
    zones = np.arange(4 * LANES * STRIP * (2 * FEWEST - 1)).reshape(-1, 4)
    assert len(build_partition(zones, zones.size, 8).strips) == 1
