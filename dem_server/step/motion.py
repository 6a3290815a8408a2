"""Motion of the free discs (leap-frog, velocities at half steps); in static mode dt = 1.

    v <- v + F'/m dt',   x <- x + v dt,   w <- w + M'/I dt'                      (1)

F', M': contact forces and weight with their damping; dt' = dt, except when the step changes: then it is the mean of the last
step and the next. In static mode speeds are capped at a tenth of the smallest radius a step, so that no disc can pass through
another one; every cap is counted. In real time no speed is capped, because this would change momentum: the step shortens
instead (cycle.py). Discs of a clump move with it.
"""

from coupler_protocol.compiled import threads
from coupler_protocol.compiled.jit import jit
from dem_server.model import CAPS, FX, FY, INERTIA, MASS, MOMENT, SPIN, VX, VY, X, Y
from dem_server.step.clumps import move_clumps
from dem_server.step.compiled_laws import damped
from dem_server.step.thread_shares import shares

SPEED_CAP = 0.1  # of the smallest radius, a step


def move_free(model, state, gravity):
    """Moves the free discs by one step under contact forces and `gravity` [m/s2], which acts along -y.

    Returns the number of bodies that were too fast; in static mode they are slowed down and counted.
    """
    kick, dt = 0.5 * (state.dt + state.next_dt), state.next_dt
    taken = arguments(model, state, gravity)
    fast = 0 if state.clumps is None else move_clumps(*taken, kick, dt)[0]
    split = shares(model)
    if len(split) == 1:
        fast += move(*split[0], *taken, kick, dt)[0]
    else:
        fast += sum(found[0] for found in threads.each(lambda a, b: move(a, b, *taken, kick, dt), split))
    if not model.in_real_time:
        state.counters[CAPS] += fast
    state.dt = state.next_dt
    return fast


def arguments(model, state, gravity):
    """Arguments of `move` and `move_clumps` before the times of kick and drift."""
    cap = not model.in_real_time
    fastest = SPEED_CAP * model.smallest_radius / state.next_dt
    return state.disc, state.load, state.weight, state.angle, model.parameters.alpha, state.clumps, gravity, fastest, cap


@jit
def move(first, last, disc, load, weight, angle, alpha, clumps, gravity, fastest, cap, kick, dt):
    """Moves the discs first..last-1 that are in no clump, Eq (1). alpha: of local damping or None; kick: time [s] of the forces.

    Returns the number of discs faster than `fastest` (with `cap` they are slowed down) and the largest speed squared.
    """
    fast, largest = 0, 0.0
    for i in range(first, last):
        if clumps is not None:  # noqa: SIM102 (numba prunes this line only if it stands alone)
            if clumps.body[i] >= 0:
                continue
        fx, fy, m = load[i, FX], load[i, FY] - weight[i] * gravity, load[i, MOMENT]
        u, v, w = disc[i, VX], disc[i, VY], disc[i, SPIN]
        if alpha is not None:
            fx, fy, m = damped(fx, u, alpha), damped(fy, v, alpha), damped(m, w, alpha)
        each = kick / disc[i, MASS]
        u += fx * each
        v += fy * each
        w += m / disc[i, INERTIA] * kick
        speed2 = u * u + v * v
        if speed2 > fastest * fastest:
            fast += 1
            if cap:
                scale = fastest / speed2**0.5
                u *= scale
                v *= scale
                speed2 = fastest * fastest
        largest = max(largest, speed2)
        disc[i, X] += u * dt
        disc[i, Y] += v * dt
        disc[i, VX], disc[i, VY], disc[i, SPIN] = u, v, w
        angle[i] += w * dt
    return fast, largest
