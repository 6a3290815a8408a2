"""Servos: walls that keep a pressure by small motions along their normal in every step.

With F the force of the discs on the wall, averaged over N steps, L the effective length of the wall, p the target pressure, and
the stiffness and dashpots of the discs that touch the wall now,

    F <- F + (force - F) / N,   V = G / N (p L - F) / (dt sum kn + sum cn),   |V| <= fastest         (1)

is the velocity towards the discs; a wall without contacts moves at `fastest`. If the discs do not move, a wall corrects the share
G / N of the missing force in one step. With G = 1/4 the averaged force and the wall that follows it are a critically damped pair
for every N (their equation is z^2 + z / N + G / N^2 = 0), and their response to the motion of the discs only dissipates energy.
Source of servo walls: Itasca, PFC2D 3.1 Theory, "Numerical servo-mechanism".

Walls may be longer than the side that they close: only the part on the discs' side of the walls that cross it counts. So if the
walls of a box cross beyond its corners, p acts on the present side of the box.
"""

import numpy as np

from coupler_protocol.compiled.jit import jit
from dem_server.model import Servo

GAIN = 0.25  # G of Eq (1)


def make_servo(ends, xy):
    """Servo of walls `ends` (W, 4) [m], all without a pressure; `xy` (n, 2) [m]: discs, which define the inner side of walls."""
    along = ends[:, 2:] - ends[:, :2]
    inward = np.column_stack([-along[:, 1], along[:, 0]]) / np.hypot(*along.T)[:, None]
    away = xy.mean(axis=0) - 0.5 * (ends[:, 2:] + ends[:, :2])
    inward[(inward * away).sum(axis=1) < 0.0] *= -1.0
    pressure, fastest, force, stiffness, dashpot, length = np.zeros((6, len(ends)))
    return Servo(pressure, fastest, np.ones(len(ends)), inward, force, stiffness, dashpot, length)


def pressures(walls):
    """Pressure of the discs on each wall now (W,) [Pa]."""
    servo = walls.servo
    measure(walls.ends, servo.inward, servo.length)
    return -(walls.force * servo.inward).sum(axis=1) / servo.length


def error(walls):
    """Largest relative difference between target and present pressure of the walls with a servo; 0 without servos."""
    on = walls.servo.pressure > 0.0
    if not on.any():
        return 0.0
    return float(np.abs(pressures(walls)[on] / walls.servo.pressure[on] - 1.0).max())


@jit
def steer(walls, servo, dt):
    """Sets velocities by Eq (1) for all walls with a target pressure."""
    velocity, inward = walls.velocity, servo.inward
    measure(walls.ends, inward, servo.length)
    for w in range(len(velocity)):
        if servo.pressure[w] <= 0.0:
            continue
        nx, ny = inward[w, 0], inward[w, 1]
        N = servo.average[w]
        servo.force[w] += (-(walls.force[w, 0] * nx + walls.force[w, 1] * ny) - servo.force[w]) / N
        speed = servo.fastest[w]
        if servo.stiffness[w] > 0.0:
            missing = servo.pressure[w] * servo.length[w] - servo.force[w]
            wanted = GAIN / N * missing / (dt * servo.stiffness[w] + servo.dashpot[w])
            speed = min(max(wanted, -speed), speed)
        velocity[w, 0], velocity[w, 1] = speed * nx, speed * ny


@jit
def measure(ends, inward, length):
    """Length (W,) [m] of each wall on the discs' side of the walls that cross it."""
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
            if 0.0 < here < 1.0 and -1e-9 <= there <= 1.0 + 1e-9:
                if ex * inward[v, 0] + ey * inward[v, 1] > 0.0:
                    first = max(first, here)
                else:
                    last = min(last, here)
        length[w] = max(last - first, 1e-3) * (ex * ex + ey * ey) ** 0.5
