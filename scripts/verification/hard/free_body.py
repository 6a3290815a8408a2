"""Bodies of zones with a window of discs that nothing holds, joined by the product's own kernels.

A quarter of a ring of zones with a window in it whose four sides are oblique or curved (a chain of chords), full of bonded
discs."""

import numpy as np

from dem_server.effects.bond import BONDED
from dem_server.step.contact_pass import contact_forces
from verification.coupling.joined import Joined, keep_gaps
from verification.coupling.mapping import lost
from verification.hard.coupled_system import MODULUS, system
from verification.verdict_rows import row

RING = {"kind": "ring", "part": "quarter", "inner": 1.0, "outer": 4.0, "around": 6, "growth": 1.1}
SIZE = 0.07  # mean radius of the discs [m]


def sector(low, high, first, last):
    """Corners of a sector between two radii [m] and two angles."""
    turns = ((low, 1), (high, -1))
    return [(r * np.cos(a), r * np.sin(a)) for r, turn in turns for a in np.linspace(first, last, 9)[::turn]]


SMALL = {"grid": RING, "window": [{"name": "hole", "polygon": sector(1.5, 3.2, 0.3, 1.25)}]}


def discs_that_break(strength, damping, **soil):
    """Table of discs as stiff as the zones of `body`, bonds of `strength` [N]; soil: more laws of theirs."""
    spring = {"normal": 2.0 * MODULUS, "shear": 0.8 * MODULUS}
    soil |= {"density": 2000.0, "spring": spring, "bond": {"tension": strength, "shear": strength}}
    return {"radius": SIZE, "confinement": 1e5, "damping": {"local": damping}, "soil": soil}


def body(stiffness=1.0, size=SIZE, mapping="work-consistent", shift=0.0, **tables):
    """The body, joined and free, contacts `stiffness` times as stiff as zones; not begun.

    shift [m]: how far control discs between nodes stand outside their segments; tables: of the scene.
    """
    found = system(stiffness, size, 0.0, **(SMALL | {"boundary": []} | tables))
    (window,) = found.windows
    bond_all(window)
    if shift:
        move_out(window, shift)
    return Joined((found.model, found.state), (window.model, window.state), window.nodes, window.rim.ring, mapping)


def bond_all(window):
    """Bond all listed pairs without force: no disc rattles loose among the others, none comes to touch another one."""
    window.state.bond_state[:] = BONDED
    keep_gaps(window.state)
    contact_forces(window.model, window.state)


def move_out(window, shift):
    """Control discs between nodes move outwards across their segments by `shift` [m]; bonds take the new gaps as theirs."""
    ring, state = window.rim.ring, window.state
    between = np.flatnonzero(ring.node < 0)
    along = (np.roll(ring.nodes, -1, axis=0) - ring.nodes)[ring.seg0[between]]
    along /= np.hypot(*along.T)[:, None]
    state.x[between] += shift * np.column_stack([along[:, 1], -along[:, 0]])
    state.origin[:] = state.x
    keep_gaps(state)
    contact_forces(window.model, state)


class Carried:
    """Force, moment and power (3,) that the mapping has lost at most since this was made, over the sums of their sizes."""

    def __init__(self, seed=1):
        self.worst, self.rng = np.zeros(3), np.random.default_rng(seed)

    def look(self, rim, discs):
        """Measure with the present contact forces, and random velocities of the nodes."""
        ring, R = rim.ring, rim.discs
        where = (ring.seg0, ring.seg1, ring.w0, ring.node)
        V = self.rng.normal(size=rim.nodes.shape)
        found = lost(rim.nodes, where, discs.x[:R].copy(), discs.force[:R].copy(), discs.moment[:R].copy(), V)
        self.worst = np.maximum(self.worst, found)

    def rows(self, where=""):
        """A row each, named with `where` before it."""
        for name, value in zip(("force", "moment", "power"), self.worst, strict=True):
            yield row(f"{where}{name} lost between discs and nodes, largest", value, 0.0, 1e-13, "identity (the transpose)")
