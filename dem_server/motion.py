"""Motion of the free discs (leap-frog, velocities at half steps); in static mode dt = 1.

    v <- v + F'/m dt',   x <- x + v dt,   w <- w + M'/I dt'                      (1)

F', M': contact forces and weight with their damping; dt' = dt but where the step changes: there it is the mean of the last
and the next. In static mode speeds are capped at a tenth of the smallest radius a
step, so that no disc can pass through another one; every cap is counted. In real time nothing is capped, for that would
change momentum: there the step shortens (cycle.py). Discs of a clump move with it.
"""

from coupler_protocol.jit import jit
from dem_server.clumps import move_clumps
from dem_server.effects import damping as damping_law
from dem_server.model import CAPS

damped = jit(damping_law.damped)

SPEED_CAP = 0.1  # of the smallest radius, a step


def move_free(model, state, gravity):
    """One step of the free discs under contact forces and `gravity` [m/s2], which acts along -y.

    Returns how many bodies were too fast; in static mode they were slowed down and counted.
    """
    fast = move(*arguments(model, state, gravity), 0.5 * (state.dt + state.next_dt), state.next_dt)
    state.dt = state.next_dt
    return fast


def arguments(model, state, gravity):
    """What `move` takes before the times of kick and drift."""
    cap = model.real_time is None
    fastest = SPEED_CAP * model.smallest_radius / state.next_dt
    law = model.law
    return (
        state.disc, state.load, state.weight, state.angle, state.counters, law.damping, state.clumps,
        model.ring, gravity, fastest, cap,
    )  # fmt: skip


@jit
def move(disc, load, weight, angle, counters, damping, clumps, first, gravity, fastest, cap, kick, dt):
    """Kernel of `move_free`: Eq (1) for discs `first`..n-1, then the clumps. kick: time [s] the forces act."""
    fast = 0
    for i in range(first, disc.shape[0]):
        if clumps is not None:  # noqa: SIM102 (numba prunes this line only if it stands alone)
            if clumps.body[i] >= 0:
                continue
        fx, fy, m = load[i, 0], load[i, 1] - weight[i] * gravity, load[i, 2]
        u, v, w = disc[i, 2], disc[i, 3], disc[i, 4]
        if damping is not None:
            alpha = damping.local
            fx, fy, m = damped(fx, u, alpha), damped(fy, v, alpha), damped(m, w, alpha)
        u += fx / disc[i, 6] * kick
        v += fy / disc[i, 6] * kick
        w += m / disc[i, 7] * kick
        speed2 = u * u + v * v
        if speed2 > fastest * fastest:
            fast += 1
            if cap:
                scale = fastest / speed2**0.5
                u *= scale
                v *= scale
        disc[i, 0] += u * dt
        disc[i, 1] += v * dt
        disc[i, 2], disc[i, 3], disc[i, 4] = u, v, w
        angle[i] += w * dt
    if clumps is not None:
        fast += move_clumps(clumps, disc, load, weight, angle, damping, gravity, fastest, cap, kick, dt)
    if cap:
        counters[CAPS] += fast
    return fast
