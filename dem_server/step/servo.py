"""Servos: walls that keep a pressure by small motions along their normal in every step.

With F the force of the discs on the wall, averaged over N steps, L the effective length of the wall, p the target pressure, and
the stiffness and dashpots of the discs that touch the wall now,

    F <- F + (force - F) / N,   V = G / N (p L - F) / (dt sum kn + sum cn),   |V| <= fastest         (1)

is the velocity towards the discs; a wall without contacts moves at `fastest`. If the discs do not move, a wall corrects the share
G / N of the missing force in one step. With G = 1/4 the averaged force and the wall that follows it are a critically damped pair
for every N (their equation is z^2 + z / N + G / N^2 = 0), and their response to the motion of the discs only dissipates energy.
Source of servo walls: Itasca, PFC2D 3.1 Theory, "Numerical servo-mechanism".

By Eq (1) alone, a wall moves at a steady speed only if force is missing. If another wall is driven with a velocity and the discs
yield steadily, the pressure would differ by the force that belongs to this speed. The servo then adds to V the drift

    V0 <- V0 + V / (T N),   V of Eq (1)                                          (2)

which becomes the steady speed; without a driven wall V0 = 0. T = 1024 is long against the response of samples of some ten rows,
so V0 does not oscillate with them. Eqs (1) and (2) still only dissipate energy: they respond as a dashpot beside a mass.

Pieces of a straight wall, drawn end to end with the same servo and the discs on the same side, are one wall: F, L and both sums
are those of all pieces, which move together. Walls may be longer than the side that they close: only the part on the discs' side
of the walls that cross it counts. So if the walls of a box cross beyond its corners, p acts on the present side of the box.
"""

import numpy as np

from coupler_protocol.compiled.jit import jit
from dem_server.model import Servo

GAIN = 0.25  # G of Eq (1)
FOLLOWS = 1024  # T of Eq (2)
STRAIGHT = 1e-12  # one minus cosine: largest angle between pieces of a straight wall
END_TO_END = 1e-9  # of a wall's length: largest gap between pieces of one wall


def make_servo(ends, xy):
    """Servo of walls `ends` (W, 4) [m], all without a pressure; `xy` (n, 2) [m]: discs, which define the inner side of walls."""
    along = ends[:, 2:] - ends[:, :2]
    inward = np.column_stack([-along[:, 1], along[:, 0]]) / np.hypot(*along.T)[:, None]
    away = xy.mean(axis=0) - 0.5 * (ends[:, 2:] + ends[:, :2])
    inward[(inward * away).sum(axis=1) < 0.0] *= -1.0
    pressure, fastest, force, drift, stiffness, dashpot, length = np.zeros((7, len(ends)))
    return Servo(pressure, fastest, np.ones(len(ends)), inward, force, drift, stiffness, dashpot, length)


def pressures(walls):
    """Present pressure (W,) [Pa] of the discs on each wall; pieces of one servo wall have that of the whole wall."""
    servo = walls.servo
    measure(walls.ends, servo.inward, servo.length)
    force, length = np.array([whole(walls.ends, walls.force, servo, w)[:2] for w in range(len(walls.ends))]).T
    return force / length


def begin(walls, w):
    """Starts the averaged force on wall w."""
    walls.servo.force[w] = whole(walls.ends, walls.force, walls.servo, w)[0]


def error(walls):
    """Largest relative difference between target and present pressure of the walls with a servo; 0 without servos."""
    on = walls.servo.pressure > 0.0
    if not on.any():
        return 0.0
    return float(np.abs(pressures(walls)[on] / walls.servo.pressure[on] - 1.0).max())


@jit(borrows=True)
def steer(walls, servo, dt):
    """Sets velocities by Eqs (1) and (2) for all walls with a target pressure."""
    velocity, inward = walls.velocity, servo.inward
    measure(walls.ends, inward, servo.length)
    driven = False
    for w in range(len(velocity)):
        driven |= servo.pressure[w] <= 0.0 and (velocity[w, 0] != 0.0 or velocity[w, 1] != 0.0)
    for w in range(len(velocity)):
        if servo.pressure[w] <= 0.0:
            continue
        N = servo.average[w]
        force, length, stiffness, dashpot = whole(walls.ends, walls.force, servo, w)
        servo.force[w] += (force - servo.force[w]) / N
        fastest = speed = servo.fastest[w]
        drift = 0.0
        if stiffness > 0.0:
            missing = servo.pressure[w] * length - servo.force[w]
            wanted = GAIN / N * missing / (dt * stiffness + dashpot)
            if driven:
                drift = min(max(servo.drift[w] + wanted / (FOLLOWS * N), -fastest), fastest)
            speed = min(max(wanted + drift, -fastest), fastest)
        servo.drift[w] = drift
        velocity[w, 0], velocity[w, 1] = speed * inward[w, 0], speed * inward[w, 1]


@jit(borrows=True)
def whole(ends, force, servo, w):
    """Force of the discs against the normal [N], length, stiffness and dashpots of wall w and of the pieces that belong to it.

    Summed from one end of the wall to the other, so that all pieces get the same bits.
    """
    piece = following = w
    while following >= 0:
        piece, following = following, next_piece(ends, servo, following, -1.0)
    pressing = length = stiffness = dashpot = 0.0
    while piece >= 0:
        pressing += -(force[piece, 0] * servo.inward[piece, 0] + force[piece, 1] * servo.inward[piece, 1])
        length += servo.length[piece]
        stiffness += servo.stiffness[piece]
        dashpot += servo.dashpot[piece]
        piece = next_piece(ends, servo, piece, 1.0)
    return pressing, length, stiffness, dashpot


@jit(borrows=True)
def next_piece(ends, servo, w, way):
    """Number of the wall that continues wall w in its line with the same servo, along (ny, -nx) `way`; -1 without one."""
    if servo.pressure[w] <= 0.0:
        return -1
    nx, ny = servo.inward[w, 0], servo.inward[w, 1]
    tx, ty = way * ny, -way * nx
    last = 2 if (ends[w, 2] - ends[w, 0]) * tx + (ends[w, 3] - ends[w, 1]) * ty > 0.0 else 0
    for v in range(len(ends)):
        if v == w or servo.inward[v, 0] * nx + servo.inward[v, 1] * ny < 1.0 - STRAIGHT:
            continue
        if servo.pressure[v] != servo.pressure[w] or servo.fastest[v] != servo.fastest[w] or servo.average[v] != servo.average[w]:
            continue
        ex, ey = ends[v, 2] - ends[v, 0], ends[v, 3] - ends[v, 1]
        first = 0 if ex * tx + ey * ty > 0.0 else 2
        gap = abs(ends[v, first] - ends[w, last]) + abs(ends[v, first + 1] - ends[w, last + 1])
        if gap <= END_TO_END * (abs(ex) + abs(ey)):
            return v
    return -1


@jit
def measure(ends, inward, length):
    """Length (W,) [m] of each wall on the discs' side of the walls that cross it; where only ends meet, nothing is cut off."""
    for w in range(len(ends)):
        x, y = ends[w, 0], ends[w, 1]
        ex, ey = ends[w, 2] - x, ends[w, 3] - y
        first, last = 0.0, 1.0
        for v in range(len(ends)):
            ax, ay = ends[v, 0] - x, ends[v, 1] - y
            fx, fy = ends[v, 2] - ends[v, 0], ends[v, 3] - ends[v, 1]
            cross = ex * fy - ey * fx
            if v == w or cross * cross < 1e-12 * (ex * ex + ey * ey) * (fx * fx + fy * fy):
                continue
            here, there = (ax * fy - ay * fx) / cross, (ax * ey - ay * ex) / cross
            if 1e-9 < here < 1.0 - 1e-9 and -1e-9 <= there <= 1.0 + 1e-9:
                if ex * inward[v, 0] + ey * inward[v, 1] > 0.0:
                    first = max(first, here)
                else:
                    last = min(last, here)
        length[w] = max(last - first, 1e-3) * (ex * ex + ey * ey) ** 0.5
