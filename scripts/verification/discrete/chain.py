"""Waves along a chain of bonded discs: dispersion.

Masses m and springs k at distances l.

    omega = 2 sqrt(k/m) sin(q l / 2),     of the leap-frog steps  sin(omega' dt / 2) = omega dt / 2

16 discs of R = 0.03 m between two held ones, at an angle, without damping; standing waves q = pi n / (17 l), l = 2 R. omega
comes from the second difference of 2,000 steps."""

import numpy as np

from dem_server.effects.bond import BONDED, Bond
from dem_server.step.cycle import advance, in_real_time
from verification.discrete.discs import KN, with_held
from verification.verdict_rows import row

NAME = "chain"
R, FREE = 0.03, 16


def frequencies(wave, turned):
    """Angular frequency of the standing wave [rad/s] as computed (of dt -> 0), and of the closed form."""
    along = np.array([np.cos(turned), np.sin(turned)])
    at = np.arange(FREE + 2) * 2.0 * R
    held, free = np.outer(at[[0, -1]], along), np.outer(at[1:-1], along)
    glue = Bond(tension=1e9, shear=1e9)
    model, state = with_held(held, [R, R], free, np.full(FREE, R), bond=glue, damping=None)
    state.bond_state[:] = BONDED
    model = in_real_time(model, state, 0.2)
    q = np.pi * wave / (FREE + 1) / (2.0 * R)
    shape = np.sin(q * at[1:-1])
    state.v[2:] = np.outer(1e-3 * shape, along)
    amplitude = []
    for _ in range(2000):
        advance(model, state, 0.0, 1)
        amplitude.append(shape @ (state.displacement[2:] @ along))
    a = np.array(amplitude)
    cosine = (a[2:] + a[:-2]) @ a[1:-1] / (2.0 * a[1:-1] @ a[1:-1])
    return np.sqrt(2.0 * (1.0 - cosine)) / state.dt, 2.0 * np.sqrt(KN / state.mass[2]) * np.sin(q * R)


def rows(fast):
    """Long, middle and shortest waves."""
    for wave in (1, 5, 16):
        found, expected = frequencies(wave, 0.8)
        yield row(f"frequency of wave {wave} of 16 [rad/s]", found, expected, 1e-6, "Brillouin (1946), Wave Propagation, ch. 1")
