"""A uniform stress passes the interface of a matched lattice.

Zones and lattice have the same moduli (block.py). All gridpoints and discs are moved by the same uniform strain along the
lattice, at 0 and 29 degrees. Then zones have the stress kn eps, and the unbalanced force on gridpoints of the rim and on free
discs is zero. The exceptions are the four corners of the rim: control discs have no contacts with each other, so the strip of
half a disc along the rim carries no stress, and a corner lacks kn eps R of each such strain, R times the traction on the
opposite side."""

import numpy as np

from fdm_server.observe import fields
from verification.coupling.block import KN, SIDE, R, block
from verification.coupling.joined import rotation
from verification.verdict_rows import row

NAME = "uniform stress"
SOURCE = "closed form (square lattice; Irons & Razzaque 1972, patch test)"
STRAIN = np.array([[-3e-6, 0.0], [0.0, 7e-6]])  # along the lattice


def strained(turned):
    """The block after one step of uniform strain, the turn (2,2), and forces (K,2) [N] left on the rim's gridpoints."""
    joined, turn = block(turned), rotation(turned)
    joined.strain(turn @ STRAIN @ turn.T)
    return joined, turn, joined.rim.nodal_forces(joined.discs) + joined.grid.force[joined.nodes]


def rows(fast):
    """Straight rims and corners, at both angles."""
    for turned, words in ((0.0, "0"), (0.5, "29")):
        joined, turn, left = strained(turned)
        traction = KN * np.abs(STRAIN).max()
        stress = turn @ (KN * STRAIN) @ turn.T
        wanted = np.array([stress[0, 0], stress[1, 1], 0.0, stress[0, 1]])
        error = np.abs(fields.stress(joined.grid_model, joined.grid) - wanted)[:, [0, 1, 3]].max() / traction
        yield row(f"at {words} degrees: stress of the zones, largest error", error, 0.0, 1e-8, SOURCE)
        free = joined.discs.force[joined.disc_model.ring :]
        size = np.abs(free).max() / (traction * 2.0 * R)
        yield row(f"at {words} degrees: forces on free discs, over kn eps s", size, 0.0, 1e-8, SOURCE)
        own = left @ turn  # along the lattice
        xy = joined.rim.nodes @ turn
        low, high = xy.min(axis=0), xy.max(axis=0)
        edge = (np.abs(xy - low) < 1e-6) | (np.abs(xy - high) < 1e-6)
        straight = edge.sum(axis=1) == 1
        size = np.abs(own[straight]).max() / (traction * SIDE)
        yield row(f"at {words} degrees: forces on straight rims, over kn eps l", size, 0.0, 1e-8, SOURCE)
        lacks = np.abs(own[~straight]) / (KN * R * np.abs(np.diag(STRAIN)))
        worst = lacks.flat[np.abs(lacks - 1.0).argmax()]
        yield row(f"at {words} degrees: what corners lack, over kn eps R", worst, 1.0, 1e-8, SOURCE)
