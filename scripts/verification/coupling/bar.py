"""A bar of zones with a chain of discs on its end: both codes in one dimension.

The bar, n columns of width dx and height dx, moves along its axis only: springs K = M dx/dx between columns of mass
rho dx^2, impedance Z = rho c dx, c^2 = M/rho. The control disc is on the middle of its end.
"""

import numpy as np

from coupler_protocol.interface.ring import Ring
from dem_server.effects.bond import Bond
from dem_server.effects.spring import Spring
from verification.coupling.joined import Joined, glue, zones
from verification.discrete.discs import with_held

M, DENSITY = 0.7e9, 2700.0  # constrained modulus [Pa], of bulk .5 GPa and shear .15 GPa
SPEED = (M / DENSITY) ** 0.5


def bar(columns, dx, discs, stiffness, mass, bonded=True, half_mass=True, share=0.5):
    """Bar and `discs` discs of `mass` [kg/m] and contacts of `stiffness` [N/m]; its free end is at x = 0. Not begun."""
    model, state = zones(columns * dx, dx, dx, 0.5e9, 0.15e9, DENSITY)
    model.fixed[:, 1] = True
    end = np.flatnonzero(model.grid.xy[:, 0] == model.grid.xy[:, 0].max())
    end = end[np.argsort(model.grid.xy[end, 1])]
    R, nodes = 0.5 * dx, model.grid.xy[end]
    middle = nodes.mean(axis=0)
    one = np.zeros(1, dtype=np.int64)
    ring = Ring(nodes.copy(), middle[None, :], np.array([R]), one, one, np.ones(1), one - 1, np.array([dx]))
    xy = middle + np.outer(2.0 * R * np.arange(1, discs + 1), [1.0, 0.0])
    laws = {"spring": Spring(normal=stiffness, shear=0.4 * stiffness), "friction": None, "damping": None, "stiffness": "contact"}
    laws |= {"density": mass / (np.pi * R**2), "bond": Bond(tension=1e30, shear=1e30) if bonded else None}
    disc_model, discs = with_held([middle], [R], xy, np.full(len(xy), R), **laws)
    discs.weight[0] = 0.5 * mass
    if bonded:
        glue(discs)
    joined = Joined((model, state), (disc_model, discs), end, ring, half_mass=half_mass)
    return joined, xy[:, 0]
