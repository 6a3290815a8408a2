"""The heavy half of a step: gridpoints move, zones strain, stresses follow, forces return to gridpoints."""

import numpy as np

from coupler_protocol.jit import jit
from fdm_server.blocks import LANES
from fdm_server.forces import corner_forces, sum_at_gridpoints
from fdm_server.strain import STRAIN_ROWS, gather_velocities, strain_increments
from fdm_server.stress import RETURN_ROWS, limit, load


@jit
def advance_kernel(
    corner, x, y, inverse_double_area, share, start, place,
    pattern, elastic, mohr_coulomb, tension, plastic,
    velocity, displacement, stress, corner_force, force,
):  # fmt: skip
    """One step of all blocks; `mohr_coulomb`, `tension` and `plastic` are None where nothing yields."""
    for n in range(velocity.shape[0]):
        displacement[n, 0] += velocity[n, 0]
        displacement[n, 1] += velocity[n, 1]

    u = np.empty(8 * LANES)
    strain = np.empty(STRAIN_ROWS * LANES)
    limited = np.empty(RETURN_ROWS * LANES)
    for b in range(corner.shape[0]):
        gather_velocities(b, corner, velocity, u)
        strain_increments(b, x, y, inverse_double_area, u, strain)
        load(b, pattern[b], elastic, strain, stress)
        if plastic is not None:
            limit(b, pattern[b], share, mohr_coulomb, tension, stress, plastic, limited)
        corner_forces(b, x, y, stress, corner_force)
    sum_at_gridpoints(start, place, corner_force, force)


def advance(model, state):
    """Move the gridpoints by one step of their velocities and bring stresses and forces up to date."""
    g, law = model.geometry, model.law
    advance_kernel(
        g.corner, g.x, g.y, g.inverse_double_area, g.share, model.start, model.place,
        model.pattern, law.elastic, law.mohr_coulomb, law.tension, state.plastic,
        state.velocity, state.displacement, state.stress, state.corner_force, state.force,
    )  # fmt: skip
