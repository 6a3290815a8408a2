"""Force, moment and power cross the interface unchanged, for any segments, discs, forces and velocities.

Random closed rims of 8 gridpoints, oblique, some of them long ellipses (5 : 1), each with 8 discs on gridpoints and 42 on or
off the segments (up to half a segment), 100,000 discs in all, carry random forces P and moments M. With F on gridpoints and
the discs' velocities v and spins w from random velocities V of the gridpoints:

    sum F = sum P,    sum X x F = sum x x P + M,    sum F.V = sum P.v + M w

and discs on the rim of a stretched or turned body move with it. The paper's mapping conserves force and moment of P alone (it
drops M) and, off the segments, no power: its row gives the loss.
"""

import numpy as np

from coupler_protocol.interface.mapping import forces_to_nodes, velocities_to_discs
from verification.verdict_rows import row

NAME = "mapping"
SOURCE = "identity (the transpose)"
NODES, DISCS = 8, 50


def rim(rng):
    """Gridpoints (8,2) of a rim, and its discs: seg0, seg1, w0, node and places (50,2)."""
    angle = np.linspace(0.0, 2.0 * np.pi, NODES, endpoint=False) + rng.uniform(0.0, 0.5, NODES)
    turn, long = rng.uniform(0.0, np.pi), rng.choice([1.0, 5.0])
    c, s = np.cos(turn), np.sin(turn)
    x = np.column_stack([long * np.cos(angle), np.sin(angle)]) * rng.uniform(0.7, 1.3, (NODES, 1)) @ [[c, s], [-s, c]]
    vector = np.roll(x, -1, axis=0) - x
    length = np.hypot(*vector.T)
    node = np.concatenate([np.arange(NODES), np.full(DISCS - NODES, -1)])
    seg1 = np.concatenate([np.arange(NODES), rng.integers(0, NODES, DISCS - NODES)])
    seg0 = np.where(node >= 0, (seg1 - 1) % NODES, seg1)
    w0 = np.where(node >= 0, length[seg0] / (length[seg0] + length[seg1]), 1.0)
    xi = np.where(node >= 0, 0.0, rng.uniform(-0.1, 1.1, DISCS))
    off = rng.uniform(-0.5, 0.5, DISCS) * rng.integers(0, 2, DISCS) * (node < 0)
    xd = x[seg1] + xi[:, None] * vector[seg1] + off[:, None] * np.column_stack([-vector[:, 1], vector[:, 0]])[seg1]
    return x, (seg0, seg1, w0, node), xd


def cross(a, b):
    """z components of a x b."""
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]


def lost(x, where, xd, P, M, V, paper=False):
    """Force, moment and power (3,) lost by forces P, moments M on discs xd of the rim x at velocities V, over sums of sizes."""
    F, v, w = np.empty_like(x), np.empty_like(xd), np.empty(len(xd))
    forces_to_nodes(x, *where, xd, P, M, F, paper)
    velocities_to_discs(x, V, *where, xd, v, w, paper)
    turning, power = cross(xd, P) + M, (P * v).sum(axis=1) + M * w
    return (
        np.abs(F.sum(axis=0) - P.sum(axis=0)).max() / np.abs(P).sum(),
        abs(cross(x, F).sum() - turning.sum()) / (np.abs(cross(x, F)).sum() + np.abs(turning).sum()),
        abs((F * V).sum() - power.sum()) / (np.abs(F * V).sum() + np.abs(power).sum()),
    )


def errors(count, paper=False, seed=1):
    """Largest errors of force, moment and power over `count` rims, each over the sum of the sizes of its terms."""
    rng, worst = np.random.default_rng(seed), np.zeros(3)
    for _ in range(count):
        x, where, xd = rim(rng)
        P, M, V = rng.normal(size=(DISCS, 2)), rng.normal(size=DISCS) * (not paper), rng.normal(size=(NODES, 2))
        worst = np.maximum(worst, lost(x, where, xd, P, M, V, paper))
    return worst


def rigid(count, seed=2):
    """Largest error of velocities and spins of discs, on and off the segments, on rims that move as rigid bodies."""
    rng, worst = np.random.default_rng(seed), 0.0
    for _ in range(count):
        x, where, xd = rim(rng)
        shift, spin = rng.normal(size=2), rng.normal()
        v, w = np.empty((DISCS, 2)), np.empty(DISCS)
        velocities_to_discs(x, shift + spin * np.column_stack([-x[:, 1], x[:, 0]]), *where, xd, v, w, False)
        wanted = shift + spin * np.column_stack([-xd[:, 1], xd[:, 0]])
        worst = max(worst, np.abs(v - wanted).max() / np.abs(wanted).max(), np.abs(w - spin).max() / abs(spin))
    return worst


def rows(fast):
    """2,000 rims (fast: 400)."""
    count = 400 if fast else 2000
    for name, error in zip(("force", "moment", "power"), errors(count), strict=True):
        yield row(f"{name}, largest error", error, 0.0, 1e-13, SOURCE)
    yield row("rigid motion of discs with their segments, largest error", rigid(count), 0.0, 1e-12, SOURCE)
    force, _, power = errors(count // 10, paper=True)
    yield row("paper's mapping: force", force, 0.0, 1e-13, SOURCE)
    yield row("paper's mapping: power that is lost, largest", power, 0.0, [1e-3, 1.0], "none: not the transpose off the segments")
