"""The cheap half of a step: forces accelerate gridpoints; and the unbalanced force ratio.

With F = forces of zones + applied forces + weight on a gridpoint, damped by its law, over a step dt:

    v += F dt / (m + m_added)           held components stay zero

In static mode dt = 1, and there is no multiplication by dt. Velocities are at half steps, positions and forces at whole steps
(leap-frog).
"""

from math import sqrt

from coupler_protocol.compiled import threads
from coupler_protocol.compiled.jit import jit
from fdm_server.effects import combined_damping as combined_law
from fdm_server.effects import damping as damping_law
from fdm_server.effects import rayleigh as rayleigh_law
from fdm_server.step.present_shape import masses
from fdm_server.step.strain import V

damped = jit(damping_law.damped)
combined_damped = jit(combined_law.damped)
drag = jit(rayleigh_law.drag)


@jit
def velocity_kernel(
    first, last, force, applied, mass, added_mass, weight_mass, fixed, gravity,
    damping, half_combined, previous, half_drag, dt, velocity,
):  # fmt: skip
    """Updates velocities [m/s] of gridpoints first..last to half a step after the forces [N].

    Absent effects are None: `damping` alpha; `half_combined` alpha/2 with the unbalanced forces of the previous step, `previous`
    (N,2) [N]; `half_drag` a dt/2 of Rayleigh damping; `dt` [s] is None in static mode.
    """
    for n in range(first, last):
        inverse = 1.0 / (mass[n] + added_mass[n])
        if dt is not None:
            inverse *= dt
        fx = force[n, 0] + applied[n, 0]
        fy = force[n, 1] + applied[n, 1] - gravity * weight_mass[n]
        if damping is not None:
            fx = damped(fx, velocity[n, 0], damping)
            fy = damped(fy, velocity[n, 1], damping)
        if half_combined is not None:
            before_x, before_y = previous[n, 0], previous[n, 1]
            previous[n, 0], previous[n, 1] = fx, fy
            fx = combined_damped(fx, fx - before_x, velocity[n, 0], half_combined)
            fy = combined_damped(fy, fy - before_y, velocity[n, 1], half_combined)
        if half_drag is not None:
            velocity[n, 0] = 0.0 if fixed[n, 0] else drag(velocity[n, 0], fx * inverse, half_drag)
            velocity[n, 1] = 0.0 if fixed[n, 1] else drag(velocity[n, 1], fy * inverse, half_drag)
        else:
            velocity[n, 0] = 0.0 if fixed[n, 0] else velocity[n, 0] + fx * inverse
            velocity[n, 1] = 0.0 if fixed[n, 1] else velocity[n, 1] + fy * inverse


def resistance(model, state, dt):
    """Arguments `damping`, `half_combined`, `previous`, `half_drag` of `velocity_kernel` for forces that act for dt [s]."""
    law = model.law
    half_combined = None if law.combined is None else 0.5 * law.combined
    mass_part = None if law.rayleigh is None else law.rayleigh.mass
    return law.damping, half_combined, state.previous_force, None if mass_part is None else 0.5 * mass_part * dt


def update_velocities(model, state, gravity, kick=None):
    """Accelerates the gridpoints over one step; gravity [m/s2] acts downwards. kick [s]: time of the forces if not the step."""
    mass, gravity = masses(model, state), float(gravity)
    dt = state.dt if kick is None else kick
    damping, half_combined, previous, half_drag = resistance(model, state, dt)

    def accelerate(first, last):
        velocity_kernel(
            first, last, state.force, state.applied, mass, state.added_mass, model.weight_mass, model.fixed, gravity,
            damping, half_combined, previous, half_drag, dt, state.velocity,
        )  # fmt: skip

    threads.each(accelerate, model.partition.points)


@jit
def imbalance_kernel(start, place, corner_force, force, applied, weight_mass, fixed, gravity):
    """Largest unbalanced force [N], sum of the magnitudes of all forces [N], number of gridpoints that can move."""
    flat = corner_force.reshape(corner_force.size)
    largest = total = 0.0
    free = 0
    for n in range(force.shape[0]):
        if fixed[n, 0] and fixed[n, 1]:
            continue
        free += 1
        fx = 0.0 if fixed[n, 0] else force[n, 0] + applied[n, 0]
        fy = 0.0 if fixed[n, 1] else force[n, 1] + applied[n, 1] - gravity * weight_mass[n]
        largest = max(largest, sqrt(fx * fx + fy * fy))
        total += gravity * weight_mass[n] + sqrt(applied[n, 0] ** 2 + applied[n, 1] ** 2)
        for k in range(start[n], start[n + 1]):
            total += sqrt(flat[place[k]] ** 2 + flat[place[k] + V] ** 2)
    return largest, total, free


@jit
def ratio_of(largest, total, free):
    """Ratio of what `imbalance_kernel` found: largest unbalanced force over the mean of all forces at a gridpoint [-]."""
    return 0.0 if total == 0.0 else largest * free / total  # NaN stays NaN


def unbalanced_ratio(model, state, gravity):
    """Largest unbalanced force over the mean, per gridpoint, of the magnitudes of all forces that act on it [-].

    Taken over gridpoints that can move, in the components in which they can; forces are those of zones on
    their corners, weights and applied forces.
    """
    return ratio_of(*imbalance_kernel(
        model.start, model.place, state.corner_force, state.force, state.applied, model.weight_mass,
        model.fixed, float(gravity),
    ))  # fmt: skip


@jit
def kinetic_kernel(mass, added_mass, velocity):
    """Kinetic energy [J] of gridpoints (N,)."""
    in_x = in_y = 0.0
    for n in range(velocity.shape[0]):
        m = mass[n] + added_mass[n]
        in_x += m * velocity[n, 0] ** 2
        in_y += m * velocity[n, 1] ** 2
    return 0.5 * (in_x + in_y)


def kinetic_energy(model, state):
    """Kinetic energy [J]; in static mode with masses scaled for a step of 1, which is not a physical energy."""
    return kinetic_kernel(masses(model, state), state.added_mass, state.velocity)


@jit
def fastest_component(velocity):
    """Largest absolute component [m/s] of the velocities (N,2); NaN if one is NaN or infinite."""
    largest = finite = 0.0
    for n in range(velocity.shape[0]):
        for axis in range(2):
            v = velocity[n, axis]
            largest = max(largest, abs(v))
            finite += 0.0 * v
    return largest + finite


@jit
def farthest(displacement):
    """Length [m] of the largest of the displacements (N,2)."""
    largest = 0.0
    for n in range(displacement.shape[0]):
        largest = max(largest, displacement[n, 0] ** 2 + displacement[n, 1] ** 2)
    return sqrt(largest)
