"""A hundred thousand cycles of stick and slip.

*Discs*: the contact of the discrete case stick-slip, 16 steps a cycle (so that sticking begins and ends at steps), 100,000
cycles: the work against the closed form. *At the rim*: a disc that does not move is pressed with a force P against a control
disc of a coupled window, and the gridpoints of the rim rotate about it to and fro as one rigid body, 8 steps a cycle. The forces
that the mapping gives to the gridpoints do the work that friction dissipates: with l = mu P, the shear stiffness ks and a way ±A
at the contact,

    4 N l (A - l/ks) - l^2/(2 ks) in N cycles
"""

import numpy as np

from dem_server.step.contact_pass import contact_forces
from verification.coupling.joined import rotation
from verification.discrete import stickslip
from verification.hard.coupled_system import MODULUS, with_few_discs
from verification.verdict_rows import row

NAME = "cycles"
SIZE, MU, OVERLAP, STEPS = 0.25, 0.55, 1e-4, 8  # radius [m], friction, overlap over the radius, steps a cycle
SPRING, SHEAR = MODULUS, 0.4 * MODULUS  # of a contact [N/m]


def pressed(ring):
    """A disc inside of the window, pressed against control disc 3 by OVERLAP."""
    at, middle = ring.xy[3], ring.xy.mean(axis=0)
    inward = (middle - at) / np.hypot(*(middle - at))
    return [at + (ring.radius[3] + SIZE - OVERLAP * SIZE) * inward], np.array([SIZE])


def turned(cycles):
    """Work of the gridpoints [J] in so many cycles, and what friction dissipates and the spring stores by the closed form."""
    soil = {"density": 2000.0, "spring": {"normal": 2.0 * SPRING, "shear": 2.0 * SHEAR}, "friction": {"coefficient": MU}}
    found = with_few_discs(pressed, 1.0, SIZE, 0.0, frozen=False, discs={"radius": SIZE, "confinement": 1e3, "soil": soil})
    (window,) = found.windows
    discs, rim = window.state, window.rim
    centre, limit = discs.x[window.model.ring].copy(), MU * SPRING * OVERLAP * SIZE
    way = 4.0 * limit / SHEAR
    angles = way / (SIZE * (1.0 - 0.5 * OVERLAP)) * np.interp(np.arange(STEPS + 1) / STEPS, [0, 0.25, 0.75, 1], [0, 1, -1, 0])
    places = [centre + (rim.nodes - centre) @ rotation(angle).T for angle in angles]
    done, before = 0.0, rim.nodal_forces(discs).copy()
    for _ in range(cycles):
        for place in places[1:]:
            moved = place - rim.nodes
            rim.move(discs, moved)
            contact_forces(window.model, discs)
            force = rim.nodal_forces(discs)
            done -= 0.5 * float(np.sum((before + force) * moved))
            before = force.copy()
    return done, 4.0 * cycles * limit * (way - limit / SHEAR) - 0.5 * limit**2 / SHEAR


def rows(fast):
    """100,000 cycles (fast: 1,000)."""
    cycles = 1000 if fast else 100_000
    done, _, expected = stickslip.slipping(cycles, 16)
    yield row(f"work of {cycles:,} cycles of slip [J]", done, expected, 1e-3, "closed form")
    done, expected = turned(cycles)
    yield row(f"at the rim: work of the gridpoints in {cycles:,} cycles [J]", done, expected, 1e-3, "closed form")
