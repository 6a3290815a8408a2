"""A row of discs across a hole in a grid, much stiffer or much softer than the zones, down to 1/32 of a zone.

The box and the hole of "step limit"; discs form one row between the rim nodes in the middle of its lower and upper side, in
line with them, bonded without force; all motion is along the row. *Stiff*: undamped, the disc in the middle is pushed along
the row; if both codes are one leap-frog scheme, E = v(n - 1/2).M v(n + 1/2)/2 + u.K u/2 keeps its value of the first step.
Positions are rounded to 4e-16 m at every step. Where x(n + 1) = x(n) + v dt + d, with the rounding d known to the bit, the
scheme gives E(n + 1) - E(n) = -d.(F(n) + F(n + 1))/2: forces do work on the rounding, and the energy is a random walk. The
first rows subtract this work; the next ones include it, with a tolerance that grows with the root of the steps and with the
number of discs. *Soft*: damped, the disc in the middle has a weight; when the unbalanced ratios of both codes are below 1e-5,
it has settled by K^-1 f, solved with the assembled stiffness."""

from dataclasses import replace

import numpy as np
import scipy.sparse.linalg

from colluvium.forecast import linearised_step
from dem_server.observe import unbalanced_ratio as balance
from fdm_server.step.gridpoint_pass import unbalanced_ratio
from verification.hard.coupled_system import MODULUS, with_few_discs
from verification.verdict_rows import row

NAME = "stiff and soft"
SIZES = (1 / 4, 1 / 8, 1 / 32)
RATIO = 1e-5


def across(ring):
    """Middles and radii of the discs between the control discs in the middle of the lower and upper side; all of one size."""
    (lower,) = np.flatnonzero(np.all(np.isclose(ring.xy, [4.0, 2.0]), axis=1))
    r = ring.radius[lower]
    count = round((4.0 - 2.0 * r) / (2.0 * r))
    y = 2.0 + 2.0 * r * (1 + np.arange(count)) * (4.0 / (2.0 * r * (count + 1)))
    return np.column_stack([np.full(count, 4.0), y]), np.full(count, r * (1.0 + 1e-9))


def middle(found):
    """Number of the disc in the middle of the row."""
    discs = found.windows[0].model
    return discs.ring + (discs.count - discs.ring) // 2


def row_of(stiffness, size, damping):
    """The system; all gridpoints are held across the row and contacts have no shear spring, so that it cannot buckle."""
    found = with_few_discs(across, stiffness, size, damping, shear=0.0)
    fixed = found.model.fixed.copy()
    fixed[:, 0] = True
    return found._replace(model=replace(found.model, fixed=fixed))


def momenta(found):
    """Masses times velocities of gridpoints and discs, and the velocities."""
    (window,) = found.windows
    free = slice(window.model.ring, None)
    mass = np.concatenate([found.model.mass + found.state.added_mass, window.state.mass[free]])
    v = np.concatenate([found.state.velocity, window.state.v[free]])
    return mass[:, None] * v, v


def work(found):
    """-u.F of gridpoints and discs: twice the energy of the springs, where forces are -K u."""
    (window,) = found.windows
    free = slice(window.model.ring, None)
    zones = np.sum(found.state.displacement * found.state.force)
    rim = np.sum(found.state.displacement[window.nodes] * window.rim.nodal_forces(window.state))
    return -(zones + rim + np.sum(window.state.displacement[free] * window.state.force[free]))


def bands(stiffness, size, steps):
    """Largest deviation of the energy from that of the first step, over that: without and with the work on roundings."""
    found = row_of(stiffness, size, 0.0)
    found.windows[0].state.v[middle(found), 1] = 0.09 * size
    found.step()
    energy, rounding = np.empty(steps), np.empty(steps)
    for n in range(steps):
        kept, stored, before = momenta(found)[0], work(found), places(found)
        found.step()
        energy[n] = 0.5 * (np.sum(kept * momenta(found)[1]) + stored)
        rounding[n] = on_rounding(before, places(found))
    whole = energy + np.concatenate([[0.0], np.cumsum(rounding[:-1])])
    return np.abs(whole / whole[0] - 1.0).max(), np.abs(energy / energy[0] - 1.0).max()


def places(found):
    """Positions, velocities of the last step and forces of discs, control discs among them, and of gridpoints' zones."""
    discs, grid = found.windows[0].state, found.state
    sides = (discs.x, discs.v, discs.force), (grid.displacement, grid.velocity, grid.force)
    return [np.concatenate(columns) for columns in zip(*sides, strict=True)]


def on_rounding(before, after):
    """d.(F(n) + F(n + 1))/2 over a step, from `places` before and after it; both differences in d are exact."""
    d = (after[0] - before[0]) - after[1]
    return 0.5 * np.sum(d * (before[2] + after[2]))


def sunk(stiffness, size):
    """How far the loaded disc sinks over what the assembled stiffness says; steps that took."""
    found = row_of(stiffness, size, 0.8)
    (window,), heavy = found.windows, middle(found)
    load(window.state, heavy, 1e-4 * size * stiffness * MODULUS)
    expected = static(found, heavy, [False, True, False])
    steps = come_to_rest(found)
    return window.state.displacement[heavy, 1] / expected[1], steps


def load(state, heavy, weight):
    """Only the disc `heavy` has a weight [N] under a gravity of 1 m/s2."""
    state.weight[:] = 0.0
    state.weight[heavy] = weight


def come_to_rest(found, most=400_000):
    """Step until the unbalanced ratios of both codes are below RATIO; how many steps."""
    (window,) = found.windows
    for n in range(1, most + 1):
        found.step(1.0)
        if n % 100 == 0:
            discs = balance.unbalanced_ratio(window.model, window.state, 1.0)
            if max(discs, unbalanced_ratio(found.model, found.state, 0.0)) <= RATIO:
                break
    return n


def static(found, heavy, moves=(True, True, True)):
    """Displacement (2,) [m] of the loaded disc by K u = f; moves: which of x, y, rotation discs are free in."""
    K, mass = linearised_step.operator(*found)
    points, window = 2 * len(found.model.grid.xy), found.windows[0]
    free, force = np.isfinite(mass), np.zeros(len(mass))
    free[points:] &= np.tile(moves, (len(mass) - points) // 3)
    at = points + 3 * (heavy - window.model.ring)
    force[at + 1] = -window.state.weight[heavy]
    u = np.zeros(len(mass))
    u[free] = scipy.sparse.linalg.spsolve(K[free][:, free].tocsc(), force[free])
    return u[at : at + 2]


def rows(fast):
    """Cheap; fast: fewer steps."""
    steps = 2_000 if fast else 20_000
    for size in SIZES:
        exact, found = bands(1000.0, size, steps)
        name = f"stiff, k/K 1000, R/zone 1/{1 / size:.0f}: band of the energy in {steps} steps"
        yield row(f"{name}, work on roundings taken out", exact, 0.0, 1e-12, "leap-frog")
        walk = 1e-12 / (4.0 * size) * (steps / 1000.0) ** 0.5
        yield row(f"{name}, left in", found, 0.0, walk, "leap-frog, walk of roundings")
    for size in SIZES:
        found, taken = sunk(1e-3, size)
        name = f"soft, k/K 1e-3, R/zone 1/{1 / size:.0f}: sinking of the loaded disc, at rest after {taken} steps"
        yield row(name, found, 1.0, 1e-4, "K^-1 f")
