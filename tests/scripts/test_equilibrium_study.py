"""scripts/studies/equilibrium_study.py: the assembled stiffness is the kernels', and the study's masses are stable."""

import equilibrium_study as study
import numpy as np
import pytest

from fdm_server.fos.ground import settle
from fdm_server.model import new_state
from fdm_server.step.zone_pass import advance


@pytest.fixture(scope="module")
def ground():
    """Coarse paper slope with a block a thousand times stiffer, triangles on its face."""
    to_rest, _ = study.scenes(fast=True)
    return settle(to_rest["contrast 1000"])


def test_row_sums_are_those_of_the_kernels(ground):
    """The forces that one moved gridpoint makes, summed by size, are a column of K, and K is symmetric."""
    rows = study.stiffness_rows(ground.model)
    for n in range(0, len(rows), 17):
        for axis in range(2):
            state = new_state(ground.model)
            state.velocity[n, axis] = 1e-6
            advance(ground.model, state)
            assert np.abs(state.force).sum() / 1e-6 == pytest.approx(rows[n, axis], rel=1e-9)


def test_row_sum_masses_lie_below_the_classical_ones(ground):
    """Both hold the reserve that local damping needs; the classical ones more than that."""
    share = study.row_sum_masses(ground.model, 2.0) / ground.model.mass
    assert 0.2 < share.min() < share.max() < 0.6


@pytest.mark.parametrize("variant", [v for v in study.VARIANTS if v.name.startswith("classical masses, ")], ids=lambda v: v.name)
def test_every_damping_comes_to_the_same_rest(variant):
    to_rest, _ = study.scenes(fast=True)
    steps = study.steps_to_rest(to_rest["slope"], variant)
    assert 100 < steps < 3000
