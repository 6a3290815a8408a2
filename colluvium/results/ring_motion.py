"""Opening and slip between the ring and the first free discs since the window took over.

For a free disc at x that touched a control disc at x_p when the discs took over (X, X_p), with d = x - x_p and D = X - X_p:

    opening = |d| - |D|                                                             (1)
    slip    = |d| (turn from D to d - turn of the rim at p)                          (2)

(1) is the change of the gap. (2) is the path of the disc's centre along the rim, counter-clockwise around the control disc, in a
frame that turns with the rim: with the line from the control disc before p to the one after it. Both are zero for a rigid motion
of window and rim together. A rolling disc counts with the path of its centre.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from colluvium.results.rank_file import Fields


class RingMotion(NamedTuple):
    """Pairs (m,) of control and free discs that touched in the first frame, in the order of its contacts."""

    control: NDArray[np.int64]  # (m,) ids of the control discs
    free: NDArray[np.int64]  # (m,) ids of the free discs
    opening: NDArray[np.float64]  # (m,) [m]
    slip: NDArray[np.float64]  # (m,) [m]
    parted: NDArray[np.bool_]  # (m,) whether the contact has opened


def ring_motion(before: tuple[Fields, Fields], now: tuple[Fields, Fields]) -> RingMotion:
    """RingMotion by Eqs (1) and (2); before, now: discs and contacts of the first frame and of another one, disc ids from 0."""
    held = np.sort(before[0].id[before[0].control == 1])
    control, free = pairs = _pairs(*before)
    X, x = (discs.xy[np.argsort(discs.id)] for discs, _ in (before, now))
    D, d = X[free] - X[control], x[free] - x[control]
    rim = _turn(*(np.roll(xy[held], -1, axis=0) - np.roll(xy[held], 1, axis=0) for xy in (X, x)))
    turn = np.angle(np.exp(1j * (_turn(D, d) - rim[np.searchsorted(held, control)])))
    length, code = np.hypot(*d.T), [len(X), 1]
    parted = ~np.isin(code @ pairs, code @ _pairs(*now))
    return RingMotion(control, free, length - np.hypot(*D.T), length * turn, parted)


def _pairs(discs: Fields, contacts: Fields) -> NDArray[np.int64]:
    """Ids (2, m) of the control and the free disc of each contact on the ring."""
    held = discs.control == 1
    ends = contacts.ends[held[contacts.ends].sum(axis=1) == 1]
    ends = np.where(held[ends[:, :1]], ends, ends[:, ::-1])
    return discs.id[ends].T


def _turn(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """Angles (m,) [rad] from the vectors a to b (m,2)."""
    return np.arctan2(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0], (a * b).sum(axis=1))
