"""A cantilever of parallel bonds bends like a beam.

Ten discs in a row beside a held one, a tenth of R apart so that bonds alone act; the force P at the end, at an angle to the
row. With s the distance of centres, E = kn' s, A = 2 R, J = 2/3 R^3 and bending at N places instead of everywhere:

    across:  P L^3 / 3 E J (1 - 1 / 4 N^2) + P N / (ks' A),     along:  P N / (kn' A)

And a row between two held discs that turn by theta / 2 against each other, an end moment: all bonds carry kn' J theta / N and
the middle moves by L theta / 8.
"""

import numpy as np

from dem_server.observe.unbalanced_ratio import unbalanced_ratio
from dem_server.step.bonds_made import add_parallel_bonds
from dem_server.step.contact_pass import contact_forces
from dem_server.step.cycle import advance
from verification.discrete.bonds import KN, KS, R, cement, everywhere
from verification.discrete.discs import with_held
from verification.verdict_rows import row

NAME = "beam"
FORCE = 0.01  # at the end of the beam [N]


def cantilever(discs, turned, radius):
    """Way of the end across the row (with the force) and along it [m], under the force FORCE downwards; and the closed form's."""
    along, gap = np.array([np.cos(turned), np.sin(turned)]), 0.1 * R  # apart: bonds alone act
    xy = np.outer(np.arange(discs + 1) * (2.0 * R + gap), along)
    glue = cement(tension=1e9, shear=1e9, radius=radius)
    model, state = with_held(xy[:1], [R], xy[1:], np.full(discs, R), bond=None, friction=None, parallel_bond=glue)
    if add_parallel_bonds(model, state, everywhere) != discs:
        raise ArithmeticError("the row has not as many bonds as discs")
    state.weight[:] = 0.0
    state.weight[-1] = FORCE
    for _ in range(200):
        advance(model, state, 1.0, 1000)
        if unbalanced_ratio(model, state, 1.0) < 1e-9:
            break
    way = state.displacement[-1]
    return (-way @ [-along[1], along[0]], way @ along), bent(discs, turned, radius, 2.0 * R + gap)


def bent(discs, turned, radius, s):
    """The closed form: across, along [m]."""
    length, area, second = discs * s, 2.0 * R * radius, 2.0 / 3.0 * (R * radius) ** 3
    across, axial = FORCE * np.cos(turned), -FORCE * np.sin(turned)
    bending = across * length**3 / (3.0 * KN * s * second) * (1.0 - 1.0 / (4.0 * discs**2))
    return bending + across * discs / (KS * area), axial * discs / (KN * area)


def turned_ends(discs, turned, radius, theta=1e-5):
    """End moment over its closed form, the same of the way of the middle; `discs`: number of bonds, even."""
    along, step = np.array([np.cos(turned), np.sin(turned)]), 2.1 * R
    xy = np.outer(np.arange(discs + 1) * step, along)
    glue = cement(tension=1e9, shear=1e9, radius=radius)
    model, state = with_held(xy[[0, -1]], [R, R], xy[1:-1], np.full(discs - 1, R), bond=None, friction=None, parallel_bond=glue)
    add_parallel_bonds(model, state, everywhere)
    state.spin[:2] = -0.5 * theta, 0.5 * theta
    contact_forces(model, state)
    state.spin[:2] = 0.0
    for _ in range(200):
        advance(model, state, 0.0, 1000)
        if unbalanced_ratio(model, state, 0.0) < 1e-9:
            break
    moment = KN * 2.0 / 3.0 * (R * radius) ** 3 * theta / discs
    way = -(state.displacement[discs // 2 + 1] @ [-along[1], along[0]])
    return -state.moment[1] / moment, way / (discs * step * theta / 8.0)


def rows(fast):
    """At .6 rad, bonds as wide as the discs; the full run: half as wide too, and 20 discs."""
    for discs, radius in ((10, 1.0),) if fast else ((10, 1.0), (10, 0.5), (20, 1.0), (5, 1.5)):
        found, expected = cantilever(discs, 0.6, radius)
        name, source = f"{discs} discs, width {radius:g}", "closed form (Timoshenko's beam of N links)"
        yield row(f"{name}: way across [m]", found[0], expected[0], 1e-4, source)
        yield row(f"{name}: error of the way along over that across", (found[1] - expected[1]) / expected[0], 0.0, 1e-4, source)
    for discs, radius in ((8, 1.0),) if fast else ((8, 1.0), (8, 0.6), (16, 1.0)):
        moment, way = turned_ends(discs, 0.6, radius)
        yield row(f"{discs} bonds, width {radius:g}, turned ends: moment over kn' J theta / N", moment, 1.0, 1e-6, "closed form")
        yield row("the same: way of the middle over L theta / 8", way, 1.0, 1e-4, "closed form")
