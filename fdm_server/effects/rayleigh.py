"""Rayleigh damping: forces C v with C = a M + b K, of masses M and elastic stiffness K. For steps in real time.

A mode of angular frequency w has the fraction of critical damping

    xi(w) = (a/w + b w)/2

Both parts: a = xi w, b = xi/w at the given frequency w = 2 pi f, where xi(w) has its minimum. One part alone gives xi at this
frequency with a = 2 xi w or b = 2 xi/w.

The part of the masses is taken at mid-step, v' = (v (1 - a dt/2) + dt F/m)/(1 + a dt/2), which is stable at any step. The part of
the stiffness adds b times the stress rate of the previous step to the stress that makes forces; plastic flow reduces this rate
like the stress. It multiplies the stable step by sqrt(1 + xi^2) - xi at the highest frequency of the grid.

Source: Bathe, K.-J. (1996), Finite Element Procedures (Rayleigh damping); Belytschko, T., Liu, W. K. & Moran, B. (2000),
Nonlinear Finite Elements for Continua and Structures (the step under damping).
"""

from math import pi, sqrt
from typing import Literal, NamedTuple

from coupler_protocol.scene.declare import Table, quantity


class RayleighTable(Table):
    """Rayleigh damping of the grid, for stages in real time."""

    fraction: float = quantity(meaning="fraction of critical damping xi at `frequency`", gt=0, lt=1)
    frequency: float = quantity(unit="Hz", meaning="frequency f; with both parts, the frequency with the least damping", gt=0)
    part: Literal["both", "mass", "stiffness"] = quantity("both", meaning="proportionality of the damping")


class Rayleigh(NamedTuple):
    """Factors of the two parts; None: absent."""

    mass: float | None  # a [1/s]
    stiffness: float | None  # b [s]


def parameters(table):
    """Factors a and b of a scene's table."""
    w, xi = 2.0 * pi * table.frequency, table.fraction
    whole = 1.0 if table.part == "both" else 2.0
    return Rayleigh(
        None if table.part == "stiffness" else whole * xi * w,
        None if table.part == "mass" else whole * xi / w,
    )


def step_share(stiffness, undamped):
    """Damped over undamped stable step [-]; undamped: 2/w [s], stiffness: b [s]; xi = b w/2."""
    xi = stiffness / undamped
    return sqrt(1.0 + xi * xi) - xi


def drag(velocity, change, half):
    """Velocity [m/s] after a step with the change [m/s] by forces alone; half: a dt/2 [-]."""
    return ((1.0 - half) * velocity + change) / (1.0 + half)
