"""The expensive half of a step: gridpoints move, zones strain, stresses and forces on gridpoints follow."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from coupler_protocol.compiled import threads
from coupler_protocol.compiled.jit import jit
from fdm_server.effects.added_laws import memories
from fdm_server.step import present_shape as shape
from fdm_server.step.added_laws import correct_all
from fdm_server.step.blocks import LANES
from fdm_server.step.forces import corner_forces, sum_at_gridpoints
from fdm_server.step.large_strain import TURN_ROWS, half_turns, middle_shape, present_shape, turn_stress
from fdm_server.step.nodal_pass import NodalPass
from fdm_server.step.safety import check_zones
from fdm_server.step.softening import CURVES, OPENING_ROWS, SHEAR_ROWS, limit_softened
from fdm_server.step.strain import STRAIN_ROWS, gather_increments, gather_velocities, strain_increments
from fdm_server.step.stress import RETURN_ROWS, STRESS_ROWS, add_rate, copy_stress, limit, load
from fdm_server.step.thread_parts import STRIP


@jit
def move_kernel(first, last, velocity, dt, displacement):
    """Updates displacements (N,2) [m] of gridpoints first..last by a step of their velocities; dt [s], None in static mode."""
    for n in range(first, last):
        if dt is None:
            displacement[n, 0] += velocity[n, 0]
            displacement[n, 1] += velocity[n, 1]
        else:
            displacement[n, 0] += dt * velocity[n, 0]
            displacement[n, 1] += dt * velocity[n, 1]


class Stiffness(NamedTuple):
    """Elastic parameters of B blocks."""

    pattern: NDArray[np.int64]  # (B,) row of the parameters of a block, of all laws
    elastic: NDArray[np.float64]  # (patterns, 3 rows) [Pa]


class Arrays(NamedTuple):
    """Arrays of State that every step of the zones reads or changes."""

    velocity: NDArray[np.float64]
    displacement: NDArray[np.float64]
    stress: NDArray[np.float64]
    corner_force: NDArray[np.float64]
    force: NDArray[np.float64]


@jit
def zones_kernel(
    first, last, geometry, gather, stiffness, arrays,
    mohr_coulomb, tension, softening, plastic, plastic_shear, added, memory, viscosity, dt, xy,
):  # fmt: skip
    """Computes one step of the zones of strips first..last and of their forces; returns the number of inverted triangles.

    geometry, gather, stiffness, arrays: needed in every step. Absent effects are None, each a separate argument, because only
    these are left out of the machine code: `mohr_coulomb`, `tension`, `plastic`, `softening` with `plastic_shear`; `added` laws
    with their `memory`; `viscosity`, b/dt of Rayleigh damping; `dt` [s] is None in static mode; `xy` (N,2) [m], positions at
    zero displacement, is None in small strain.
    """
    corner, x, y, inverse_double_area, share = geometry
    order, ready, start, place = gather
    pattern, elastic = stiffness
    velocity, displacement, stress, corner_force, force = arrays
    u = np.empty(8 * LANES)
    strain = np.empty(STRAIN_ROWS * LANES)
    limited = np.empty((RETURN_ROWS + 4) * LANES)
    inverted = 0
    alone = np.int64(0)  # block in scratch memory; for a literal number numba would compile the laws once more
    if xy is not None:
        end_x, end_y, end_share = np.empty((1, 4 * LANES)), np.empty((1, 4 * LANES)), np.empty((1, 4 * LANES))
        mid_x, mid_y, mid_inverse = np.empty((1, 4 * LANES)), np.empty((1, 4 * LANES)), np.empty((1, 5 * LANES))
        turn = np.empty(TURN_ROWS * LANES)
    if softening is not None:
        shear, opening = np.empty((1, SHEAR_ROWS * LANES)), np.empty((1, OPENING_ROWS * LANES))
        values = np.empty((CURVES + 1) * LANES)
    if viscosity is not None:
        before = np.empty((1, STRESS_ROWS * LANES))
    for s in range(first, last):
        for b in range(s * STRIP, min((s + 1) * STRIP, corner.shape[0])):
            if dt is None:
                gather_velocities(b, corner, velocity, u)
            else:
                gather_increments(b, corner, velocity, dt, u)
            if xy is None:
                strain_increments(b, x, y, inverse_double_area, u, strain)
                if viscosity is not None:
                    copy_stress(b, stress, before)
                load(b, pattern[b], elastic, strain, stress)
                if softening is not None:
                    limit_softened(
                        b, pattern[b], share, elastic, mohr_coulomb, tension, softening, stress, plastic, plastic_shear,
                        shear, opening, values, limited,
                    )  # fmt: skip
                elif plastic is not None:
                    limit(b, pattern[b], share, mohr_coulomb, tension, stress, plastic, limited, None)
                if added is not None:
                    correct_all(b, pattern[b], share, added, memory, stress, b)
                if viscosity is not None:
                    add_rate(b, stress, viscosity, before)
                    corner_forces(alone, x[b : b + 1], y[b : b + 1], before, corner_force[b : b + 1])
                else:
                    corner_forces(b, x, y, stress, corner_force)
            else:
                inverted += present_shape(b, corner, share, xy, displacement, end_x, end_y, end_share)
                middle_shape(end_x, end_y, u, mid_x, mid_y, mid_inverse)
                strain_increments(alone, mid_x, mid_y, mid_inverse, u, strain)
                half_turns(mid_x, mid_y, mid_inverse, u, turn)
                turn_stress(b, turn, stress)
                if viscosity is not None:
                    copy_stress(b, stress, before)
                    turn_stress(alone, turn, before)
                load(b, pattern[b], elastic, strain, stress)
                turn_stress(b, turn, stress)
                if softening is not None:
                    limit_softened(
                        alone, pattern[b], end_share, elastic, mohr_coulomb, tension, softening, stress[b : b + 1],
                        plastic[b : b + 1], plastic_shear[b : b + 1], shear, opening, values, limited,
                    )  # fmt: skip
                elif plastic is not None:
                    limit(
                        alone, pattern[b], end_share, mohr_coulomb, tension, stress[b : b + 1], plastic[b : b + 1], limited, None
                    )  # fmt: skip
                if added is not None:
                    correct_all(b, pattern[b], end_share, added, memory, stress, alone)
                if viscosity is not None:
                    add_rate(b, stress, viscosity, before)
                    corner_forces(alone, end_x, end_y, before, corner_force[b : b + 1])
                else:
                    corner_forces(alone, end_x, end_y, stress[b : b + 1], corner_force[b : b + 1])
        sum_at_gridpoints(order, ready[s], ready[s + 1], start, place, corner_force, force)
    return inverted


def zone_arguments(model, state):
    """Arguments of `zones_kernel` after the strips: (geometry, gather, stiffness, arrays) and, from mohr_coulomb on, the effects.

    Plain tuples: for a named tuple numba looks up its class at every call.
    """
    law = model.law
    stiffness_part = None if law.rayleigh is None else law.rayleigh.stiffness
    viscosity = None if stiffness_part is None else stiffness_part / state.dt
    memory = None if law.added is None else memories(law.added, state.memory)
    arrays = Arrays(state.velocity, state.displacement, state.stress, state.corner_force, state.force)
    always = tuple(model.geometry), tuple(model.gather), tuple(Stiffness(model.pattern, law.elastic)), tuple(arrays)
    return always, (
        law.mohr_coulomb, law.tension, law.softening, state.plastic, state.plastic_shear, law.added, memory,
        viscosity, state.dt, shape.moving(model, state),
    )  # fmt: skip


def advance(model, state):
    """Moves the gridpoints by one step of their velocities and updates stresses and forces.

    Raises Unstable for inverted zones in large strain; in small strain the shape is constant.
    """
    parts = model.partition
    always, effects = zone_arguments(model, state)

    def move(first, last):
        move_kernel(first, last, state.velocity, state.dt, state.displacement)

    def strain(first, last):
        return zones_kernel(first, last, *always, *effects)

    threads.each(move, parts.points)
    nodal = None if model.nodal is None else NodalPass(model, state)
    if nodal:
        nodal.before()
    inverted = sum(threads.each(strain, parts.strips))
    if len(parts.strips) > 1:  # one thread leaves no seam
        sum_at_gridpoints(parts.order, *parts.ready[-2:], model.start, model.place, state.corner_force, state.force)
    if nodal:
        nodal.after()
    if inverted:
        check_zones(shape.present(model, state), model.zones, model.zone, model.grid.origin)
    if state.mass is not None:
        shape.count_steps(model, state)
