"""One step for both codes in real time: the shortest that anyone asks for, and an end where it has become too long."""

from types import SimpleNamespace

import numpy as np
import pytest
from zone_cases import box, soil

from coupler_protocol.exits import PhysicsFailed
from fdm_server.coupling import common_step
from fdm_server.effects.damping import Damping
from fdm_server.mesh.grid import build_grid
from fdm_server.model import build_model, new_state
from fdm_server.step import clock
from fdm_server.step.masses import stable_step
from fdm_server.step.present_shape import begin_large_strain, renew


def ground(factor, large=False):
    scene = box(5.0, 5.0, 1.0, soil())
    model = build_model(scene, build_grid(scene))
    state = new_state(model)
    if large:
        begin_large_strain(model, state)
    return clock.begin(model, state, Damping(local=0.0), factor), state


def rim(model, sums=0.0, limit=1.0):
    nodes = np.flatnonzero((np.abs(model.grid.xy - 2.5) < 1.0).all(axis=1))
    window = SimpleNamespace(name="hole")
    return SimpleNamespace(nodes=nodes, sums=np.full(len(nodes), sums), answer=SimpleNamespace(dt_limit=limit), window=window)


def test_without_contacts_the_rim_asks_for_what_the_grid_does():
    model, state = ground(0.5)
    q = stable_step(model.grid.xy, model.zones, model.modulus, model.zone_density)
    assert common_step.rim_step(model, state, rim(model)) == pytest.approx(q, rel=1e-12)


def test_the_shortest_step_counts_and_the_whole_one_is_the_limit_from_then_on():
    model, state = ground(0.5)
    alone = state.dt
    assert common_step.set_common_step(model, state, [rim(model), rim(model, limit=0.3 * alone)]).step_factor == 1.0
    assert state.dt == 0.3 * alone
    model, state = ground(0.5)
    stiff = rim(model, sums=1e13)
    common_step.set_common_step(model, state, [stiff])
    assert state.dt == pytest.approx(0.5 * np.sqrt(2700.0 / (model.mass[stiff.nodes[0]] + 2e13)), rel=1e-12)


def test_mass_on_the_rim_lets_steps_be_longer():
    model, state = ground(0.5)
    loaded = rim(model, sums=1e12)
    before = common_step.rim_step(model, state, loaded)
    state.added_mass[loaded.nodes] = 3.0 * 2700.0
    assert common_step.rim_step(model, state, loaded) == pytest.approx(2.0 * before, rel=1e-12)


def test_contacts_that_have_become_too_stiff_end_the_run():
    model, state = ground(0.5)
    found = rim(model)
    model = common_step.set_common_step(model, state, [found])
    common_step.check_common_step(model, state, [found], state.dt)
    limit = 2700.0 / state.dt**2 - 0.5 * model.mass[found.nodes[0]]
    found.sums[1] = 0.999 * limit
    common_step.check_common_step(model, state, [found], state.dt)
    found.sums[1] = 1.001 * limit
    with pytest.raises(PhysicsFailed, match=r"rim of 'hole' have become so stiff, at \(3, 2\).*smaller step_factor"):
        common_step.check_common_step(model, state, [found], state.dt)


def test_zones_that_have_become_too_thin_end_the_run():
    model, state = ground(0.9, large=True)
    found = rim(model)
    model, agreed = common_step.set_common_step(model, state, [found]), state.dt
    for width, ends in ((0.95, False), (0.8, True)):
        state.displacement[:, 0] = (width - 1.0) * model.grid.xy[:, 0]
        renew(model, state)
        assert (state.dt < agreed) == ends
    with pytest.raises(PhysicsFailed, match="zones have become so thin"):
        common_step.check_common_step(model, state, [found], agreed)
