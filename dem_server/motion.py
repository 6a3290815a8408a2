"""Motion of the free discs in the static mode (leap-frog, dt = 1, velocities at half steps).

    v <- v + F'/m,   x <- x + v,   w <- w + M'/I                                 (1)

F', M': contact forces and weight with their damping. Speeds are capped at a tenth of the smallest radius a
step, so that no disc can pass through another one; every cap is counted. Discs of a clump move with it.
"""

from coupler_protocol.jit import jit
from dem_server.clumps import move_clumps
from dem_server.effects import damping as damping_law
from dem_server.model import CAPS

damped = jit(damping_law.damped)

SPEED_CAP = 0.1  # of the smallest radius, a step


def move_free(model, state, gravity):
    """One step of the free discs under contact forces and `gravity` [m/s2], which acts along -y."""
    move(
        state.disc, state.load, state.weight, state.angle, state.counters, model.law.damping, state.clumps,
        model.ring, gravity, SPEED_CAP * model.smallest_radius,
    )


@jit
def move(disc, load, weight, angle, counters, damping, clumps, first, gravity, fastest):
    """Kernel of `move_free`: Eq (1) for discs `first`..n-1, then the clumps."""
    for i in range(first, disc.shape[0]):
        if clumps is not None:  # noqa: SIM102 (numba prunes this line only if it stands alone)
            if clumps.body[i] >= 0:
                continue
        fx, fy, m = load[i, 0], load[i, 1] - weight[i] * gravity, load[i, 2]
        u, v, w = disc[i, 2], disc[i, 3], disc[i, 4]
        if damping is not None:
            alpha = damping.local
            fx, fy, m = damped(fx, u, alpha), damped(fy, v, alpha), damped(m, w, alpha)
        u += fx / disc[i, 6]
        v += fy / disc[i, 6]
        w += m / disc[i, 7]
        speed2 = u * u + v * v
        if speed2 > fastest * fastest:
            scale = fastest / speed2**0.5
            u *= scale
            v *= scale
            counters[CAPS] += 1
        disc[i, 0] += u
        disc[i, 1] += v
        disc[i, 2], disc[i, 3], disc[i, 4] = u, v, w
        angle[i] += w
    if clumps is not None:
        counters[CAPS] += move_clumps(clumps, disc, load, weight, angle, damping, gravity, fastest)
