"""Stress from contacts is the stress at the boundary, and shares of branches in circles are exact."""

import numpy as np
import pytest
from window_case import OBLIQUE, packed, soil_discs

from coupler_protocol.geometry import polygon_area
from dem_server.insitu.contact_stress import circle_stress, mean_stress
from dem_server.observe.unbalanced_ratio import unbalanced_ratio
from dem_server.pairs import contacts
from dem_server.step.contact_pass import contact_forces
from dem_server.step.motion import move_free


@pytest.fixture(scope="module")
def at_rest():
    """A sheared oblique window at an unbalanced ratio of 1e-8."""
    model, state = packed(OBLIQUE, soil_discs())
    R = model.ring
    state.v[:R] = (state.x[:R] - OBLIQUE.mean(axis=0)) @ [[-1e-5, 1e-5], [0.0, -2e-5]]
    for _ in range(20):
        move_free(model, state, 0.0)
        state.x[:R] += state.v[:R]
        contact_forces(model, state)
    state.v[:R] = 0.0
    while unbalanced_ratio(model, state, 0.0) > 1e-8:
        move_free(model, state, 0.0)
        contact_forces(model, state)
    return model, state


def test_mean_stress_is_the_boundary_stress(at_rest):
    model, state = at_rest
    area = polygon_area(state.x[: model.ring])
    x, force = state.x[: model.ring], state.force[: model.ring]  # what the discs do to the ring
    boundary = -(x.T @ force) / area
    found = mean_stress(contacts(state), area)
    expected = [boundary[0, 0], boundary[1, 1], 0.5 * (boundary[0, 1] + boundary[1, 0])]
    np.testing.assert_allclose(found, expected, atol=1e-6 * np.abs(found).max())


def test_contact_moments_balance_the_stress(at_rest):
    """At rest the stress is symmetric up to the moments on the ring."""
    model, state = at_rest
    x, force, moment = state.x[: model.ring], state.force[: model.ring], state.moment[: model.ring]
    turning = (x[:, 0] * force[:, 1] - x[:, 1] * force[:, 0]).sum() + moment.sum()
    assert abs(turning) < 1e-6 * np.abs(force).sum()


def test_circle_around_everything_gives_the_mean(at_rest):
    _, state = at_rest
    pairs = contacts(state)
    found = circle_stress(state.x[pairs.disc_a], pairs, np.array([[0.4, 0.7]]), 5.0)
    np.testing.assert_allclose(found[0], mean_stress(pairs, np.pi * 25.0), rtol=1e-12)
