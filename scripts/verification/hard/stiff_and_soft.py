"""A row of discs across a hole in a grid, far stiffer or far softer than the zones, down to 1/32 of a zone.

The box and the hole of "step limit"; discs stand in one row between the rim nodes in the middle of its lower and upper side, in
line with them, bonded without force; all moves along the row only. *Stiff*: undamped, the disc in the middle is pushed along the
row; in so far as both codes are one leap-frog scheme, v(n - 1/2).M v(n + 1/2)/2 + u.K u/2 stays what it is at the first step.
Positions are rounded to 4e-16 m at every step, which lets the energy walk at random: the tolerance grows with the root of the
steps and with the number of discs. *Soft*: damped, the disc in the middle has a weight; when the unbalanced ratios of both codes
are below 1e-5 it has sunk by K^-1 f, solved with the assembled stiffness.
"""

from dataclasses import replace

import numpy as np
import scipy.sparse.linalg

from colluvium import coupled
from dem_server import balance
from fdm_server.motion import unbalanced_ratio
from verification.hard.coupled_system import MODULUS, with_few_discs
from verification.rows import row

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


def band(stiffness, size, steps):
    """Largest deviation of the energy from that of the first step, over that."""
    found = row_of(stiffness, size, 0.0)
    found.windows[0].state.v[middle(found), 1] = 0.09 * size
    first, worst = None, 0.0
    found.step()
    for _ in range(steps):
        kept, stored = momenta(found)[0], work(found)
        found.step()
        energy = 0.5 * (np.sum(kept * momenta(found)[1]) + stored)
        first = energy if first is None else first
        worst = max(worst, abs(energy / first - 1.0))
    return worst


def sunk(stiffness, size, most=400_000):
    """How far the loaded disc sinks over what the assembled stiffness says; steps that took."""
    found = row_of(stiffness, size, 0.8)
    (window,), heavy = found.windows, middle(found)
    window.state.weight[:] = 0.0
    window.state.weight[heavy] = 1e-4 * size * stiffness * MODULUS
    expected = static(found, heavy)
    for n in range(1, most + 1):
        found.step(1.0)
        if n % 100 == 0:
            discs = balance.unbalanced_ratio(window.model, window.state, 1.0)
            if max(discs, unbalanced_ratio(found.model, found.state, 0.0)) <= RATIO:
                break
    return window.state.displacement[heavy, 1] / expected, n


def static(found, heavy):
    """Displacement [m] of the loaded disc by K u = f; discs move along the row only."""
    K, mass = coupled.operator(*found)
    points, window = 2 * len(found.model.grid.xy), found.windows[0]
    free = np.isfinite(mass)
    free[points:] = np.arange(len(mass) - points) % 3 == 1
    load, at = np.zeros(len(mass)), points + 3 * (heavy - window.model.ring) + 1
    load[at] = -window.state.weight[heavy]
    u = np.zeros(len(mass))
    u[free] = scipy.sparse.linalg.spsolve(K[free][:, free].tocsc(), load[free])
    return u[at]


def rows(fast):
    """Cheap; fast: fewer steps."""
    steps = 2_000 if fast else 20_000
    for size in SIZES:
        found = band(1000.0, size, steps)
        name = f"stiff, k/K 1000, R/zone 1/{1 / size:.0f}: band of the energy in {steps} steps"
        walk = 1e-12 / (4.0 * size) * (steps / 1000.0) ** 0.5
        yield row(name, found, 0.0, walk, "leap-frog")
    for size in SIZES:
        found, taken = sunk(1e-3, size)
        name = f"soft, k/K 1e-3, R/zone 1/{1 / size:.0f}: sinking of the loaded disc, at rest after {taken} steps"
        yield row(name, found, 1.0, 1e-4, "K^-1 f")
