"""Stiffness of zones and the bound it gives, against the code's own steps."""

import numpy as np
import pytest
from stiffness_by_steps import SOFT, elastic_slope, highest, stiffness

from fdm_server.effects.elastic import Elastic
from fdm_server.model import new_state
from fdm_server.observe import stable_limit
from fdm_server.step.present_shape import begin_large_strain


@pytest.mark.parametrize("shake", [0.0, 0.5])
def test_assembled_zones_are_the_stiffness_of_a_step(shake):
    """Quadrilaterals and triangles, regular and distorted."""
    model = elastic_slope(shake=shake)
    K = stiffness(model)
    zones = stable_limit.zone_stiffness(model, new_state(model))
    found = stable_limit.stiffness_matrix(model, zones)
    np.testing.assert_allclose(found.toarray(), K, atol=1e-12 * np.abs(K).max())


@pytest.mark.parametrize("elastic", [SOFT[0].elastic, Elastic(bulk=1e9, shear=1e6)])
@pytest.mark.parametrize("shake", [0.0, 0.6])
def test_no_assembly_is_faster_than_its_fastest_zone(elastic, shake):
    model = elastic_slope(elastic, shake)
    found = stable_limit.safe_limits(model, new_state(model))["grid"]
    alpha = model.law.damping
    largest = highest(model)
    assert 1.0 <= 4.0 / (found["share"] ** 2 * (1.0 + alpha)) / largest < 4.0  # safe, and the step within a factor 2
    assert found["dt"] is None


def test_one_zone_is_its_own_bound():
    """The masses of a zone by itself: zone_frequencies is the largest eigenvalue; a triangle moves as one with three corners."""
    model = elastic_slope()
    state = new_state(model)
    K, mass = stable_limit.zone_stiffness(model, state), stable_limit.zone_masses(model, state)
    omega2 = stable_limit.zone_frequencies(K, mass, model.zones)
    corners = np.array([len(set(zone)) for zone in model.zones.tolist()])
    assert set(corners) == {3, 4}
    z = int(np.flatnonzero(corners == 4)[0])
    scale = np.tile(mass[z], 2) ** -0.5
    assert omega2[z] == pytest.approx(np.linalg.eigvalsh(K[z] * scale * scale[:, None])[-1], rel=1e-12)
    assert omega2.max() < 2.0
    assert np.bincount(model.zones.ravel(), mass.ravel())[model.zones].ravel() == pytest.approx(model.mass[model.zones].ravel())


def test_the_present_shape_counts_in_large_strain():
    model = elastic_slope()
    state = new_state(model)
    begin_large_strain(model, state)
    before = stable_limit.zone_stiffness(model, state)
    state.displacement[:, 0] = 0.5 * model.grid.xy[:, 0]
    after = stable_limit.zone_stiffness(model, state)
    assert np.abs(after - before).max() > 0.1 * np.abs(before).max()
    ratio = stable_limit.zone_masses(model, state).sum() / model.mass[np.unique(model.zones)].sum()
    assert ratio == pytest.approx(1.0)  # masses as the state has them, until they are computed anew


def test_a_node_bears_the_contact_springs_on_it():
    model = elastic_slope()
    state = new_state(model)
    nodes = np.flatnonzero(~model.fixed.any(axis=1))[:3]
    sums = np.array([0.0, 1e3, 0.0]) * model.mass[nodes]
    bare = stable_limit.safe_limits(model, state, nodes, sums)["interface"]
    state.added_mass[nodes] = sums
    borne = stable_limit.safe_limits(model, state, nodes, sums)["interface"]
    assert bare["at"] == borne["at"] == pytest.approx(model.grid.xy[nodes[1]].tolist())
    assert bare["share"] < 0.05
    assert borne["share"] == pytest.approx(2.0 / np.sqrt(2.0 * (1.0 + model.law.damping)), rel=1e-2)
