"""A window with oblique and curved sides: forces of its discs arrive complete at the nodes.

*Shaken*: the body of `free_body.py`, free, all discs bonded, in real time without damping. *Packed*: a quarter of a ring held
on all sides, its discs under the pressure of their packing, not bonded; static mode, damped, until both codes are at rest: the
rim yields to them. Lost force, moment and power of the mapping are relative to the sums of their magnitudes; the resultant on
the closed ring under the outward pressure of the discs is zero except for the unbalanced forces of its discs."""

import numpy as np

from colluvium.forecast import step_limits
from dem_server.observe import unbalanced_ratio as balance
from dem_server.step.contact_pass import contact_forces
from fdm_server.step.gridpoint_pass import unbalanced_ratio
from verification.coupling.energy import followed
from verification.hard.coupled_system import System, scene
from verification.hard.free_body import SIZE, SMALL, Carried, body
from verification.verdict_rows import row

NAME = "curved rim"


def packed(carried, steps, stiffness=1.0):
    """The packed window after so many steps; its pressure is 1e-3 of the zones' modulus times `stiffness`."""
    found = System(*step_limits.open_model(scene(stiffness, SIZE, 0.7, oblique=True, **SMALL)))
    (window,) = found.windows
    contact_forces(window.model, window.state)
    for n in range(steps):
        found.state.added_mass[window.nodes] = window.rim.stiffness_sums(window.model, window.state)
        found.step()
        if n % 10 == 0:
            carried.look(window.rim, window.state)
    return found


def rows(fast):
    """20,000 steps shaken, 10,000 to rest (fast: 3,000 and 4,000)."""
    carried = Carried()
    _, lost = followed(body(), 3000 if fast else 20_000, 1e-6 * SIZE, every=10, look=lambda j: carried.look(j.rim, j.discs))
    yield from carried.rows("shaken: ")
    yield row("shaken: momentum of zones and discs lost, over its parts", lost, 0.0, 1e-13, "conservation")
    carried = Carried()
    found = packed(carried, 4000 if fast else 10_000)
    yield from carried.rows("packed: ")
    (window,) = found.windows
    ratio = max(balance.unbalanced_ratio(window.model, window.state, 0.0), unbalanced_ratio(found.model, found.state, 0.0))
    yield row("packed: unbalanced ratio of both codes at the end", ratio, 0.0, 1e-5, "it rests")
    force = window.rim.nodal_forces(window.state)
    left = np.abs(force.sum(axis=0)).max() / np.abs(force).sum()
    yield row("packed: sum of the nodes' forces over their sizes", left, 0.0, 1e-5, "equilibrium")
