"""Zones, rim, control discs and discs of a strained body turned rigidly by a quarter turn.

The body of `free_body.py` in large strain, under a uniform strain of its zones and random normal and shear forces in its
contacts. Gridpoints and free discs are moved as one rigid body, the rim by the mapping. Contact forces are constant; forces on
the nodes turn with the body. Both hold to second order in the step."""

import numpy as np

from dem_server.step.contact_pass import contact_forces
from fdm_server.step.present_shape import begin_large_strain, present
from fdm_server.step.zone_pass import advance
from verification.coupling.joined import rotation
from verification.coupling.rigid import forces
from verification.hard.coupled_system import MODULUS
from verification.hard.free_body import SIZE, body
from verification.verdict_rows import row

NAME = "quarter turn"
SOURCE = "identity (objectivity)"
CENTRE = np.array([0.3, -0.4])  # of the turn [m]


def strained():
    """The body under stress."""
    joined, rng = body(), np.random.default_rng(4)
    joined.strain(np.array([[-2e-4, 1e-4], [0.0, 3e-4]]))
    begin_large_strain(joined.grid_model, joined.grid)
    joined.grid.velocity[:] = 0.0
    advance(joined.grid_model, joined.grid)  # forces in the present shape
    discs = joined.discs
    discs.reference_gap[:] += 1e-4 * SIZE * rng.normal(size=len(discs.normal))
    discs.v[:], discs.spin[:] = 0.0, 0.0
    discs.shear[:] = 1e-4 * SIZE * MODULUS * rng.normal(size=len(discs.shear))
    contact_forces(joined.disc_model, discs)
    return joined


def turned(steps, angle=0.5 * np.pi):
    """Largest change of a contact force, and of a node's beside its turned one, after a turn in so many steps, over kn R."""
    joined = strained()
    grid, discs, free = joined.grid, joined.discs, slice(joined.disc_model.ring, None)
    before, on_nodes = forces(discs), joined.rim.nodal_forces(discs) + grid.force[joined.nodes]
    points, middles = present(joined.grid_model, grid).copy(), discs.x[free].copy()
    for step in range(1, steps + 1):
        turn = rotation(angle * step / steps)
        grid.velocity[:] = CENTRE + (points - CENTRE) @ turn.T - present(joined.grid_model, grid)
        there = CENTRE + (middles - CENTRE) @ turn.T
        discs.v[free], discs.spin[free] = there - discs.x[free], angle / steps
        discs.x[free] = there
        joined.rim.move(discs, grid.velocity[joined.nodes])
        contact_forces(joined.disc_model, discs)
        advance(joined.grid_model, grid)
    after = joined.rim.nodal_forces(discs) + grid.force[joined.nodes]
    scale = MODULUS * SIZE
    return np.abs(forces(discs) - before).max() / scale, np.abs(after - on_nodes @ turn.T).max() / scale


def rows(fast):
    """10,000 steps and a quarter of that (fast: 2,500)."""
    many = 2500 if fast else 10_000
    (contact, node), coarse = turned(many), turned(many // 4)
    orders = np.log(np.array(coarse) / [contact, node]) / np.log(4.0)
    limit = 1.6e-7 if fast else 1e-8
    for name, value, order in zip(("contact forces", "forces on the rim's nodes"), (contact, node), orders, strict=True):
        yield row(f"{name}: largest change in {many:,} steps, over kn R", value, 0.0, limit, SOURCE, order=order)
        yield row(f"{name}: order of the change in the step", order, 2.0, 0.1, SOURCE, order=order)
