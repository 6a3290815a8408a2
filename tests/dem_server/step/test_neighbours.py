"""The neighbour list holds exactly the near pairs, keeps what contacts know, and notices what it must."""

from types import SimpleNamespace

import numpy as np
import pytest
from window_case import SQUARE, packed, soil_discs

from dem_server.effects.bond import BONDED
from dem_server.model import build_model
from dem_server.pairs import listed_pairs
from dem_server.step import neighbours
from dem_server.step.cells import levels_of
from dem_server.step.contact_pass import contact_forces


def loose(xy, radius):
    packing = SimpleNamespace(xy=np.asarray(xy, dtype=float), radius=np.asarray(radius, dtype=float))
    return build_model(np.empty((0, 2)), np.empty(0), packing, soil_discs())


def pair_set(state):
    pairs = listed_pairs(state)
    return sorted(zip(*np.sort([pairs.disc_a, pairs.disc_b], axis=0).tolist(), strict=True))


def near_pairs(model, state):
    """All pairs by brute force."""
    d = np.hypot(*(state.x[:, None] - state.x[None]).transpose(2, 0, 1))
    near = d - state.radius[:, None] - state.radius < neighbours.skin(model)
    near[: model.ring, : model.ring] = False
    return sorted(zip(*(a.tolist() for a in np.nonzero(np.triu(near, 1))), strict=True))


def test_list_equals_brute_force():
    model, state = packed(SQUARE, soil_discs())
    neighbours.rebuild(model, state)
    assert pair_set(state) == near_pairs(model, state)


@pytest.mark.parametrize("seed", range(3))
def test_list_equals_brute_force_for_unequal_scattered_discs(seed):
    rng = np.random.default_rng(seed)
    model, state = loose(rng.random((400, 2)) * [3.0, 1.0], 0.02 * rng.uniform(0.3, 3.0, 400))
    contact_forces(model, state)
    assert pair_set(state) == near_pairs(model, state)


@pytest.mark.parametrize("ratio", [4.0, 20.0, 150.0])
def test_list_equals_brute_force_for_any_ratio_of_sizes(ratio):
    """Few large discs among many small ones, in a band at 30 degrees; sizes from all levels."""
    rng = np.random.default_rng(7)
    radius = 0.01 * ratio ** (rng.random(600) ** 3)
    turn = np.array([[np.cos(0.5), np.sin(0.5)], [-np.sin(0.5), np.cos(0.5)]])
    model, state = loose((rng.random((600, 2)) * [0.3 * np.sqrt(ratio) * 3.0, 0.3 * np.sqrt(ratio)]) @ turn, radius)
    contact_forces(model, state)
    assert len(near_pairs(model, state)) > 600
    assert pair_set(state) == near_pairs(model, state)


def test_levels_part_the_sizes():
    level, side, widest = levels_of(np.array([1.0, 4.9, 3.0]), 0.1)
    assert level.tolist() == [0, 0, 0]
    np.testing.assert_allclose(side, 2.0 * 4.9 + 0.1)
    level, side, widest = levels_of(np.array([20.0, 1.0, 4.0, 19.0, 1.0]), 0.1)
    assert level.tolist() == [1, 0, 0, 1, 0]
    np.testing.assert_allclose(widest, [4.0, 20.0])
    np.testing.assert_allclose(side, [8.1, 40.1])
    radius = 10.0 ** np.linspace(0.0, 3.0, 100)
    level, _, widest = levels_of(radius, 0.1)
    assert all(radius[level == k].max() <= 5.0 * radius[level == k].min() for k in range(len(widest)))


def test_a_disc_with_many_neighbours_has_them_all():
    angle = np.linspace(0.0, 2.0 * np.pi, 40, endpoint=False)
    circle = 0.5 * np.column_stack([np.cos(angle), np.sin(angle)])
    model, state = loose(np.vstack([[0.0, 0.0], circle]), np.concatenate([[0.46], np.full(40, 0.039)]))
    contact_forces(model, state)
    assert pair_set(state) == near_pairs(model, state)


def test_discs_heaped_on_one_spot():
    model, state = loose(np.random.default_rng(0).normal(0.0, 0.005, (30, 2)), np.full(30, 0.03))
    contact_forces(model, state)
    assert pair_set(state) == near_pairs(model, state)


def test_far_disc_does_not_blow_up_the_grid():
    model, state = loose([[0.0, 0.0], [0.05, 0.0], [1e9, 1e9]], [0.03, 0.03, 0.03])
    contact_forces(model, state)
    assert pair_set(state) == [(0, 1)]


def test_rebuilding_changes_no_force():
    model, state = packed(SQUARE, soil_discs())
    rng = np.random.default_rng(0)
    pairs = listed_pairs(state)
    state.shear[pairs.slot] = rng.normal(0.0, 10.0, len(pairs.slot))
    state.reference_gap[pairs.slot] = rng.normal(0.0, 1e-6, len(pairs.slot))
    state.bond_state[pairs.slot] = rng.integers(0, 4, len(pairs.slot))

    def known():
        p = listed_pairs(state)
        order = np.lexsort((np.maximum(p.disc_a, p.disc_b), np.minimum(p.disc_a, p.disc_b)))
        return [a[order].tolist() for a in (p.normal_force, p.shear_force, p.gap, p.bond_state, p.kind)]

    before = known()
    neighbours.rebuild(model, state)
    assert known() == before


def test_bonds_stay_listed_at_any_distance():
    model, state = loose([[0.0, 0.0], [0.06, 0.0]], [0.03, 0.03])
    contact_forces(model, state)
    state.bond_state[0] = BONDED
    state.x[1, 0] += 1.0
    neighbours.rebuild(model, state)
    assert pair_set(state) == [(0, 1)]
    assert listed_pairs(state).bond_state.tolist() == [BONDED]


def test_list_is_built_when_a_disc_has_moved_half_a_skin():
    model, state = loose([[0.0, 0.0], [0.5, 0.0]], [0.03, 0.03])
    contact_forces(model, state)
    state.x[1, 1] += 0.49 * neighbours.skin(model)
    contact_forces(model, state)
    assert state.builds == 1
    state.x[1, 1] += 0.02 * neighbours.skin(model)
    contact_forces(model, state)
    assert state.builds == 2


def test_a_position_that_is_no_number_is_named():
    model, state = loose([[0.0, 0.0], [0.5, 0.0]], [0.03, 0.03])
    state.x[1] = np.nan
    with pytest.raises(ArithmeticError, match="disc 1"):
        contact_forces(model, state)


def test_ring_discs_do_not_touch_each_other():
    model, state = packed(SQUARE, soil_discs())
    pairs = listed_pairs(state)
    assert not ((pairs.disc_a < model.ring) & (pairs.disc_b < model.ring)).any()
