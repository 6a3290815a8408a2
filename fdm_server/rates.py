"""Kernels for the rate of stress in a step, which Rayleigh damping adds to the stress that makes forces."""

from coupler_protocol.compiled.jit import jit
from fdm_server.step.blocks import LANES
from fdm_server.step.stress import STRESS_ROWS


@jit
def copy_stress(b, stress, before):
    """Keep the stresses of block b in `before` (1, 10 rows)."""
    for k in range(STRESS_ROWS * LANES):
        before[0, k] = stress[b, k]


@jit
def add_rate(b, stress, viscosity, before):
    """Turn stresses before the step into those that make forces: stress + viscosity (stress - before)."""
    for k in range(STRESS_ROWS * LANES):
        before[0, k] = stress[b, k] + viscosity * (stress[b, k] - before[0, k])
