"""A dashpot that is given by its restitution: beta from the closed forms, and collisions that keep what was asked for."""

from math import exp, pi, sqrt

import numpy as np
import pytest
from disc_cases import KN, loose_discs
from pydantic import ValidationError

from coupler_protocol.problems import SceneError
from coupler_protocol.scene.reader import build_scene
from dem_server.effects.dashpot import Dashpot, dashpot_table, fraction_of, restitution_of, weaker
from dem_server.effects.pairs import Pair
from dem_server.effects.spring import SpringTable
from dem_server.step.cycle import advance, in_real_time

R = 0.03


def parted(dashpot, turned, radius=(R, 0.6 * R)):
    """Share of the speed 1 m/s with which two discs part, and their tangential speed."""
    along = np.array([np.cos(turned), np.sin(turned)])
    model, state = loose_discs([[0.0, 0.0], sum(radius) * along], radius, dashpot=dashpot, bond=None, friction=None, damping=None)
    model = in_real_time(model, state, 1e-3)
    state.v[:] = 0.5 * along, -0.5 * along
    mass = state.mass.prod() / state.mass.sum()
    advance(model, state, 0.0, round(12.0 * sqrt(mass / KN) / state.next_dt))
    apart = state.v[1] - state.v[0]
    return apart @ along, apart @ [-along[1], along[0]]


@pytest.mark.parametrize("turned", [0.0, 0.7])
@pytest.mark.parametrize("tension", [True, False])
@pytest.mark.parametrize("restitution", [0.02, 0.1, 0.3, 0.6, 0.95, 1.0])
def test_discs_part_with_the_restitution_asked_for(restitution, tension, turned):
    found, sideways = parted(Dashpot(restitution=restitution, tension=tension), turned)
    assert found == pytest.approx(restitution, abs=2e-3)
    assert sideways == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("tension", [True, False])
def test_fractions_are_inverses_of_the_closed_forms(tension):
    for restitution in (0.01, 0.05, 0.13, exp(-2.0), 0.14, 0.5, 0.9, 0.999, 1.0):
        assert restitution_of(fraction_of(restitution, tension), tension) == pytest.approx(restitution, rel=1e-9)
    assert fraction_of(exp(-pi / sqrt(3.0)), True) == pytest.approx(0.5, rel=1e-12)
    assert fraction_of(0.7441, False) == pytest.approx(0.1, abs=2e-4)  # published
    assert fraction_of(exp(-2.0), False) == pytest.approx(1.0, rel=1e-6)
    assert fraction_of(1.0, tension) == pytest.approx(0.0, abs=1e-15)


def test_of_two_materials_the_larger_restitution_counts():
    """For the pair's own `tension`, also against a fraction given as such."""
    a, b = Dashpot(restitution=0.4, tension=True), Dashpot(restitution=0.7)
    both = weaker(a, b)
    assert not both.tension
    assert restitution_of(both.normal, False) == pytest.approx(0.7)
    assert restitution_of(weaker(a, a).normal, True) == pytest.approx(0.4)
    assert weaker(a, Dashpot(normal=0.05)).normal == 0.05
    assert weaker(Dashpot(restitution=0.7), Dashpot(normal=3.0)).normal == both.normal


def test_a_pair_has_its_own():
    grain = type("Grain", (), {"dashpot": Dashpot(restitution=0.4)})
    own = type("Own", (), {"dashpot": Dashpot(restitution=0.9, tension=True)})
    spring = SpringTable(np.full(2, KN), np.full(2, KN))
    table = dashpot_table([Pair(grain, grain), Pair(grain, grain, own)], spring)
    betas = [fraction_of(0.4, False), fraction_of(0.9, True)]
    np.testing.assert_allclose(table.normal, 2.0 * np.array(betas) * sqrt(KN), rtol=1e-14)


@pytest.mark.parametrize("keys", [{}, {"normal": 0.1, "restitution": 0.5}, {"shear": 0.1}])
def test_either_the_fraction_or_the_restitution(keys):
    with pytest.raises(ValidationError, match="either `normal` or `restitution`"):
        Dashpot(**keys)


def scene_with(dashpot, **discs):
    soil = {"density": 2000.0, "spring": {"normal": 1e7, "shear": 1e7}, "dashpot": dashpot}
    return {
        "format": 1,
        "seed": 1,
        "discs": {"radius": 0.1, "polygon": [[0, 0], [1, 0], [1, 1], [0, 1]], "soil": soil} | discs,
        "stage": [{"name": "fill"}, {"name": "run", "kind": "discs", "time": "real", "until": {"time": 0.1}}],
    }


def test_a_scene_says_what_is_wrong():
    with pytest.raises(SceneError, match="either `normal` or `restitution`"):
        build_scene(scene_with({"normal": 0.1, "restitution": 0.5}))
    with pytest.raises(SceneError, match="restitution"):
        build_scene(scene_with({"restitution": 1.2}))
