"""Bonds break when their strength is reached.

Contact bonds between discs of kn = 5e7, ks = 2e7 N/m, tension 1500 N, shear 3500 N (two discs touch, one is moved by 1e-7 m a
step, also at an angle): at F / k, with k in series (kn/2, ks/2) or of the contact itself. Parallel bonds of stiffness 4e9 and
1.5e9 Pa/m, strengths 0.2 and 0.3 MPa: at sigma / kn' and tau / ks', and in bending at the turn sigma / (kn' R).
The tolerance is one step (and in shear the turning of the contact).
"""

import numpy as np

from dem_server.effects.parallel_bond import ParallelBond
from dem_server.step.bonds_made import add_parallel_bonds
from verification.discrete.discs import displace, loose_discs
from verification.verdict_rows import row

NAME = "bonds"
R, STEP = 0.03, 1.0e-7
KN, KS = 4.0e9, 1.5e9  # stiffness of parallel bonds over area [Pa/m]
TENSION, SHEAR = 2.0e5, 3.0e5  # their strengths [Pa]


def pulled(direction, turned=0.0, **changes):
    """Displacement at which the bond of two touching discs breaks when one is moved along `direction`; Model and State."""
    along = np.array([np.cos(turned), np.sin(turned)])
    across = np.array([-along[1], along[0]])
    model, state = loose_discs([[0.3, 0.7], [0.3, 0.7] + 2.0 * R * along], [R, R], bonded=True, **changes)
    velocity = np.array([[0.0, 0.0], STEP * (along if direction == "normal" else across)])
    steps = 0
    while state.broken_tension + state.broken_shear == 0:
        displace(model, state, velocity)
        steps += 1
    return steps * STEP, model, state


def cement(**changes):
    """The parallel bond."""
    strengths = {"tension": TENSION, "shear": SHEAR, "radius": 1.0} | changes
    return ParallelBond(normal_stiffness=KN, shear_stiffness=KS, **strengths)


def everywhere(pairs):
    """All listed pairs are bonded."""
    return np.ones(len(pairs.slot), dtype=bool)


def moved(velocity, spin, **changes):
    """Steps until a parallel bond of two discs in touch breaks, and the State."""
    model, state = loose_discs(
        [[0.1, 0.2], [0.1 + 2.0 * R, 0.2]], [R, R], bond=None, friction=None, parallel_bond=cement(**changes)
    )
    add_parallel_bonds(model, state, everywhere)
    for step in range(1, 10000):
        displace(model, state, np.array(velocity), np.array(spin))
        if state.broken_tension + state.broken_shear:
            return step, state
    raise ArithmeticError("the bond holds")


def rows(fast):
    """Every way to break."""
    closed = "closed form"
    for stiffness, share in (("disc", 1.0), ("contact", 0.5)):
        for direction, reference, slack in (("normal", 6.0e-5, 0.0), ("shear", 3.5e-4, 1e-4)):
            reference *= share
            found = pulled(direction, 0.3, stiffness=stiffness)[0]
            tolerance = [-1e-5, 1.01 * STEP / reference + slack]
            yield row(f"contact bond, springs by {stiffness}, {direction}: breaks at [m]", found, reference, tolerance, closed)
    step = 1.0e-8
    turn = step / R
    one = 1.01 * step / (TENSION / KN)
    found = step * moved([[0.0, 0.0], [step, 0.0]], [0.0, 0.0])[0]
    yield row("parallel bond, tension: breaks at [m]", found, TENSION / KN, one, closed)
    found = 10.0 * step * moved([[0.0, 0.0], [0.0, 10.0 * step]], [0.0, 0.0], tension=1e9)[0]
    yield row("parallel bond, shear: breaks at [m]", found, SHEAR / KS, 10.1 * step / (SHEAR / KS), closed)
    found = turn * moved(np.zeros((2, 2)), [-0.5 * turn, 0.5 * turn])[0]
    yield row("parallel bond, bending: breaks at [rad]", found, TENSION / (KN * R), one, closed)
