"""Compiled functions of the effects for the kernels; the files of the effects contain plain functions."""

from types import FunctionType

from coupler_protocol.compiled.jit import jit
from dem_server.effects import bond, damping, dashpot, friction, pair_stiffness, parallel_bond, rolling, spring


def jit_with(function, **called):
    """Compiles a plain function that calls others; `called`: the compiled functions, by the names under which it calls them."""
    return jit(FunctionType(function.__code__, function.__globals__ | called, function.__name__))


normal_force = jit(spring.normal_force)
shear_force = jit(spring.shear_force)
slip_limit = jit(friction.slip_limit)
clipped = jit(friction.clipped)
bond_after = jit(bond.bond_after)
effective_radius = jit(rolling.effective_radius)
rolling_stiffness = jit(rolling.rolling_stiffness)
rolling_moment = jit(rolling.rolling_moment)
rolling_limit = jit(rolling.rolling_limit)
viscous_force = jit(dashpot.viscous_force)
bond_radius = jit(parallel_bond.bond_radius)
bending_stiffness = jit(parallel_bond.bending_stiffness)
parallel_bond_after = jit(parallel_bond.parallel_bond_after)
damped = jit(damping.damped)
stiffness_of_pair = jit_with(
    pair_stiffness.pair_stiffness,
    rolling_stiffness=rolling_stiffness,
    bond_radius=bond_radius,
    bending_stiffness=bending_stiffness,
)
dashpots_of_pair = jit(pair_stiffness.pair_dashpots)
