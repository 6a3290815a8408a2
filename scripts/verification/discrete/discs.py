"""Small arrangements of discs, for cases and for tests of physical laws."""

from types import SimpleNamespace

import numpy as np

from dem_server.effects.bond import BONDED, Bond
from dem_server.effects.damping import Damping
from dem_server.effects.friction import Friction
from dem_server.effects.spring import Spring
from dem_server.model import build_model
from dem_server.step.contact_pass import contact_forces

KN, KS, MU = 2.5e7, 1.0e7, 0.55  # contact stiffnesses of the soil below [N/m], its friction coefficient


def soil_discs(**changes):
    """The `discs` table of the paper's soil (its Table 2), with `changes` to the soil or to the table."""
    soil = {
        "density": 2000.0,
        "spring": Spring(normal=5.0e7, shear=2.0e7),
        "friction": Friction(coefficient=MU),
        "bond": Bond(tension=1.5e3, shear=3.5e3),
        "rolling": None,
        "dashpot": None,
        "parallel_bond": None,
    }
    table = {"stiffness": "disc", "damping": Damping(local=0.7), "stone": None}
    for key, value in changes.items():
        (soil if key in soil else table)[key] = value
    return SimpleNamespace(soil=SimpleNamespace(**soil), **table)


def loose_discs(xy, radius, bonded=False, **changes):
    """Model and State of discs without a ring, contacts found; `bonded`: every closed contact is glued."""
    packing = SimpleNamespace(xy=np.asarray(xy, dtype=float), radius=np.asarray(radius, dtype=float))
    model, state = build_model(np.empty((0, 2)), np.empty(0), packing, soil_discs(**changes))
    contact_forces(model, state)
    if bonded:
        state.bond_state[:] = BONDED
    return model, state


def with_held(held_xy, held_radius, xy, radius, **changes):
    """Model and State of free discs at `xy` (m, 2) and of held ones, which come first; contacts found."""
    packing = SimpleNamespace(xy=np.asarray(xy, dtype=float), radius=np.asarray(radius, dtype=float))
    held = np.asarray(held_xy, dtype=float), np.asarray(held_radius, dtype=float)
    model, state = build_model(*held, packing, soil_discs(**changes), insitu=False)
    contact_forces(model, state)
    return model, state


def displace(model, state, velocity, spin=0.0):
    """One step of prescribed motion: every disc moves by `velocity` (n, 2) and turns by `spin` (n,)."""
    state.v[:] = velocity
    state.spin[:] = spin
    state.x[:] += velocity
    contact_forces(model, state)
