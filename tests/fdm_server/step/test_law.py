"""The law: what acts, what does not, and returns that are projections."""

from itertools import permutations

import numpy as np
import pytest
from grid_cases import ELASTIC, MOHR_COULOMB, TENSION, material, slope
from pydantic import ValidationError

from fdm_server.effects import law_from
from fdm_server.effects import mohr_coulomb as mc
from fdm_server.effects.elastic import Elastic
from fdm_server.effects.mohr_coulomb import MohrCoulomb
from fdm_server.mesh.grid import build_grid
from fdm_server.model import build_model, new_state
from fdm_server.observe import fields
from fdm_server.step.gridpoint_pass import update_velocities
from fdm_server.step.zone_pass import advance

BENCH = [(0, 4), (4, 4), (12, 12), (20, 12)]


def test_no_table_no_arrays():
    scene = slope(2.0, BENCH, materials=[material(mohr_coulomb=None, tension=None)])
    model = build_model(scene, build_grid(scene))
    assert model.law.mohr_coulomb is None
    assert model.law.tension is None
    assert new_state(model).plastic is None
    assert not fields.plastic_state(model, new_state(model)).any()
    scene.damping = None
    assert law_from(scene).damping is None


def test_a_material_without_tables_stays_elastic_beside_others():
    weak = material("weak", mohr_coulomb=MohrCoulomb(friction=5, cohesion=10), tension=TENSION)
    rock = material("rock", region=[(0, 0), (20, 0), (20, 4), (0, 4)], mohr_coulomb=None, tension=None)
    scene = slope(2.0, BENCH, materials=[weak, rock])
    model = build_model(scene, build_grid(scene))
    state = new_state(model)
    for _ in range(300):
        update_velocities(model, state, 9.81)
        advance(model, state)
    flows = fields.plastic_state(model, state) > 0
    is_rock = model.grid.material == 1
    assert flows[~is_rock].any()
    assert not flows[is_rock].any()
    assert np.isfinite(state.stress).all()


def test_a_material_without_stiffness_is_refused():
    with pytest.raises(ValueError, match="no stiffness"):
        law_from(slope(materials=[material(elastic=None)]))


@pytest.mark.parametrize(
    "keys",
    [{"friction": 20, "dilation": 25}, {"friction": 60}, {"friction": -1}, {"friction": 30, "cohesion": -1}],
)
def test_parameters_outside_physics_are_refused(keys):
    with pytest.raises(ValidationError):
        MohrCoulomb(**({"cohesion": 1e3} | keys))


def test_associated_return_is_the_closest_admissible_stress():
    """Kuhn-Tucker: the way back lies in the cone of the normals of the planes that the result lies on."""
    elastic, law = Elastic(bulk=3.0, shear=2.0), MohrCoulomb(friction=25, cohesion=1, dilation=25)
    rows = mc.parameters(law, elastic)
    N, C = rows[:2]
    stiffness = np.full((3, 3), 3 - 4 / 3) + 4 * np.eye(3)
    planes = np.array([[(k == i) - N * (k == j) for k in range(3)] for i, j in permutations(range(3), 2)])
    rng = np.random.default_rng(3)
    kinds = set()
    for _ in range(300):
        trial = np.sort(rng.normal(0, 3, 3) + rng.normal(0, 2))
        *back, yielded = mc.plastic_return(*trial, *rows)
        f = planes @ back + C
        assert f.min() > -1e-12
        assert yielded == ((planes @ trial + C).min() < 0)
        flow = np.linalg.solve(stiffness, back - trial)  # minus the plastic strain: a sum of active normals, weights >= 0
        active = planes[np.abs(f) < 1e-10]
        for other in rng.normal(0, 5, (200, 3)):
            if (planes @ other + C).min() >= 0:
                assert flow @ (other - back) >= -1e-10
        kinds.add(len(active))
    assert kinds == {0, 1, 2, 6}  # inside, plane, edge, apex


def test_flow_without_dilation_keeps_the_volume():
    rows = mc.parameters(MOHR_COULOMB, ELASTIC)
    trial = np.array([-900e3, -300e3, -50e3])
    *back, yielded = mc.plastic_return(*trial, *rows)
    assert yielded
    assert sum(back) == pytest.approx(trial.sum(), rel=1e-12)
    assert back[0] - rows[0] * back[2] + rows[1] == pytest.approx(0, abs=1e-6)
