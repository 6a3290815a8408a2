"""Shares of plain steps of the grid in other threads than the one that talks to the discs (plain_loop.py)."""

from coupler_protocol.compiled.jit import jit
from coupler_protocol.compiled.thread_crew import END, await_order, meet, over_all_threads, part_of
from fdm_server.step.gridpoint_pass import velocity_kernel
from fdm_server.step.zone_pass import move_kernel, zones_kernel

VELOCITIES, ZONES = 0.0, 1.0  # phases of work: `velocity_kernel` with gravity; `move_kernel`, then `zones_kernel`


@jit
def help_grid(crew, points, resistance, always, effects):
    """Takes a share of all phases that the first thread orders; arguments as for `plain_loop`."""
    applied, added_mass, mass, weight_mass, fixed, _ = points
    damping, half_combined, previous, half_drag, _ = resistance
    geometry, gather, stiffness, arrays = always
    velocity, displacement, _, _, force = arrays
    mohr_coulomb, tension, softening, plastic, plastic_shear, added, memory, viscosity, dt, xy = effects
    first, last = part_of(crew, 0, velocity.shape[0])
    strip, end = part_of(crew, 0, len(gather[1]) - 2)
    while True:
        await_order(crew)
        phase, gravity = crew.ordered[0], crew.ordered[1]
        if phase == END:
            return
        if phase == VELOCITIES:
            velocity_kernel(
                first, last, force, applied, mass, added_mass, weight_mass, fixed, gravity,
                damping, half_combined, previous, half_drag, dt, velocity,
            )  # fmt: skip
            meet(crew)
        else:
            move_kernel(first, last, velocity, dt, displacement)
            meet(crew)
            inverted = zones_kernel(
                strip, end, geometry, gather, stiffness, arrays,
                mohr_coulomb, tension, softening, plastic, plastic_shear, added, memory, viscosity, dt, xy,
            )  # fmt: skip
            over_all_threads(crew, inverted, 0.0, False)
