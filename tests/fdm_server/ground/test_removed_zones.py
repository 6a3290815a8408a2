"""Making a window a hole disturbs nothing."""

from copy import deepcopy

import numpy as np
import pytest
from grid_cases import slope, window

from fdm_server.ground.removed_zones import cut_window
from fdm_server.mesh.grid import areas, build_grid
from fdm_server.mesh.window_zones import rim_of, window_zones
from fdm_server.model import build_model, new_state, places
from fdm_server.observe import fields
from fdm_server.step.gridpoint_pass import unbalanced_ratio, update_velocities
from fdm_server.step.zone_pass import advance

BAND = window((18, 21), (7, 13))


@pytest.fixture(scope="module")
def settled():
    """The paper's slope with zones of 2/3 m, in equilibrium, and the mask of a window in it."""
    scene = slope(2 / 3, [(0, 4), (4, 4), (12, 12), (20, 12)])
    grid = build_grid(scene)
    model = build_model(scene, grid)
    state = new_state(model)
    while True:
        for _ in range(100):
            update_velocities(model, state, 9.81)
            advance(model, state)
        if unbalanced_ratio(model, state, 9.81) < 1e-6:
            return model, state, window_zones(grid, BAND)


def test_reactions_keep_the_equilibrium(settled):
    model, state, mask = settled
    before = deepcopy(state)
    cut, after, reaction = cut_window(model, state, mask)
    after.applied += reaction.under(9.81)
    update_velocities(cut, after, 9.81)
    advance(cut, after)
    assert unbalanced_ratio(cut, after, 9.81) < 2e-6
    assert np.abs(after.displacement - state.displacement).max() < 1e-9
    assert all(np.array_equal(getattr(state, k), getattr(before, k)) for k in places())


def test_without_reactions_it_moves(settled):
    model, state, mask = settled
    cut, after, _ = cut_window(model, state, mask)
    update_velocities(cut, after, 9.81)
    advance(cut, after)
    assert unbalanced_ratio(cut, after, 9.81) > 0.1


def test_forces_at_the_rim_are_the_same_to_round_off(settled):
    """What the zones left and the reaction give is what all zones gave."""
    model, state, mask = settled
    cut, after, reaction = cut_window(model, state, mask)
    attached = np.diff(cut.start) > 0
    total = after.force + reaction.force
    np.testing.assert_allclose(total[attached], state.force[attached], atol=1e-10 * np.abs(state.force).max())
    np.testing.assert_allclose((cut.weight_mass + reaction.mass)[attached], model.weight_mass[attached], rtol=1e-12)
    acting = np.flatnonzero(np.abs(reaction.force).sum(axis=1))
    assert np.array_equal(acting, np.sort(rim_of(model.grid, mask)))


def test_removed_zones_and_inner_gridpoints_are_gone(settled):
    model, state, mask = settled
    cut, after, _ = cut_window(model, state, mask)
    assert len(cut.zone) == len(model.zone) - 28
    assert np.array_equal(cut.zone, np.flatnonzero(~mask))
    inner = np.setdiff1d(model.zones[mask], rim_of(model.grid, mask))
    assert cut.fixed[inner].all()
    assert not after.velocity[inner].any()
    np.testing.assert_array_equal(fields.stress(cut, after), fields.stress(model, state)[~mask])
    np.testing.assert_array_equal(fields.plastic_state(cut, after), fields.plastic_state(model, state)[~mask])
    with pytest.raises(ValueError, match="removed before"):
        cut_window(cut, after, mask)


def test_field_for_the_discs(settled):
    model, state, mask = settled
    field = fields.zone_field(model, state, mask)
    assert field.shape == (28, 7)
    assert field[:, 2].sum() == pytest.approx(28 * 4 / 9)
    np.testing.assert_allclose(field[:, 2], areas(model.grid.xy, model.zones[mask]))
    np.testing.assert_array_equal(field[:, 3:6], fields.stress(model, state)[mask][:, [0, 1, 3]])
    assert (field[:, 6] == 2700).all()
    assert field[:, 4].max() < 0
