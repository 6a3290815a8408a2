"""Two threads compute the same bits as one, and the list is cut so that they cannot meet."""

from copy import deepcopy

import numpy as np
import pytest
from bench.dense_box import FRICTION, dense_box

from coupler_protocol.compiled import threads as team
from dem_server.effects.bond import Bond
from dem_server.step import bonds_made, cycle, thread_shares
from dem_server.step.contact_pass import contact_forces
from dem_server.step.motion import move_free
from dem_server.step.thread_shares import RUN, shares

WEAK = Bond(tension=30.0, shear=60.0)  # [N]: many break on the way


@pytest.fixture(scope="module")
def box():
    """22,500 discs, bonded, with velocities that break bonds and make new lists."""
    model, state = dense_box(6, 6, friction=FRICTION, bond=WEAK)
    contact_forces(model, state)
    bonds_made.add_bonds(model, state)
    state.v[model.ring :] = np.random.default_rng(4).normal(0.0, 2e-4, (model.count - model.ring, 2))
    return model, state


def in_one_loop(model, state, steps):
    cycle.advance(model, state, 9.81, steps)


def step_by_step(model, state, steps):
    """As in a coupled run, where the rim moves in between."""
    for _ in range(steps):
        move_free(model, state, 9.81)
        contact_forces(model, state)


def moved(box, threads, monkeypatch, advance, steps=40):
    model, state = deepcopy(box)
    monkeypatch.setattr(thread_shares, "FEWEST", 4)  # threads share this box although it is too small for them to gain
    team.set_size(threads)
    try:
        assert len(shares(model)) == threads
        advance(model, state, steps)
    finally:
        team.set_size(1)
    return state


@pytest.mark.parametrize("advance", [in_one_loop, step_by_step])
def test_two_threads_compute_the_bits_of_one(box, monkeypatch, advance):
    one, two = moved(box, 1, monkeypatch, advance), moved(box, 2, monkeypatch, advance)
    assert one.builds > box[1].builds
    assert one.broken_tension > 0
    assert one.broken_shear > 0
    for name in ("disc", "load", "angle", "first", "second", "normal", "shear", "bond_state", "counters"):
        np.testing.assert_array_equal(getattr(one, name), getattr(two, name), err_msg=name)


def test_parts_of_one_colour_touch_different_discs(box):
    model, state = deepcopy(box)
    assert state.parts[:, 1].max() == len(state.first)
    covered = np.concatenate([np.arange(a, b) for a, b in state.parts.astype(int)])
    np.testing.assert_array_equal(np.sort(covered), np.arange(len(state.first)))
    runs = len(state.parts) - 2
    assert runs == -(-(model.count - model.ring) // RUN)
    even = 1 + (runs + 1) // 2
    for colour in (state.parts[1:even], state.parts[even : 1 + runs]):
        touched = [np.unique(np.r_[state.first[a:b], state.second[a:b]]) for a, b in colour.astype(int)]
        assert sum(map(len, touched)) == len(np.unique(np.concatenate(touched)))


def test_pairs_of_distant_numbers_come_last(box):
    """Two discs of the first and the last run are brought together: they still find each other."""
    model, state = deepcopy(box)
    state.x[-1] = state.x[model.ring] + [0.0, 0.5 * state.radius[model.ring]]
    contact_forces(model, state)
    a, b = state.parts[-1].astype(int)
    assert (model.ring, model.count - 1) in set(zip(state.first[a:b].tolist(), state.second[a:b].tolist(), strict=True))
    total = state.force.sum(axis=0)
    assert np.abs(total).max() < 1e-9 * np.abs(state.normal).max()
