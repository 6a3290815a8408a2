"""Mohr-Coulomb strength from several tests, by least squares, with the scatter over samples.

    biaxial: s1 = N s3 + 2 c sqrt(N),  N = (1 + sin phi) / (1 - sin phi)         (1)
    shear:   t = c + s tan phi                                                    (2)

One line through all points gives c and phi; the line through those of each seed gives their scatter (standard deviation over
seeds). The window of stresses is that of the smaller principal stress (1) or of the normal stress (2): outside of it, c and phi
are not measured. A curved envelope shows in `misfit`, the largest difference of the mean strength at a stress from the line, over
the line.
"""

from collections.abc import Sequence
from math import asin, atan, degrees, sqrt
from typing import Any, NamedTuple

import numpy as np


class Line(NamedTuple):
    """Cohesion [Pa] and friction angle [deg] of a line."""

    cohesion: float
    friction: float


def line_of(kind: str, side: np.ndarray, axial: np.ndarray) -> Line | None:
    """The line through points by Eq (1) or (2); None for a single stress, or if the strength falls with the stress (1)."""
    if len(side) < 2 or np.ptp(side) < 1e-6 * np.abs(side).max():
        return None
    slope, start = np.polyfit(side, axial, 1)
    if kind == "shear":
        return Line(float(start), degrees(atan(slope)))
    if slope <= 0.0:
        return None
    return Line(float(start) / (2.0 * sqrt(slope)), degrees(asin((slope - 1.0) / (slope + 1.0))))


def strength_on(kind: str, line: Line, side: np.ndarray) -> np.ndarray:
    """Axial or shear stress (n,) [Pa] of a line at side or normal stresses (n,) [Pa]."""
    if kind == "shear":
        return line.cohesion + side * np.tan(np.radians(line.friction))
    passive = np.tan(np.radians(45.0 + 0.5 * line.friction)) ** 2
    return passive * side + 2.0 * line.cohesion * np.sqrt(passive)


def strength_of(kind: str, rows: Sequence[dict[str, Any]], when: str) -> dict[str, Any] | None:
    """c, phi, scatter, window and misfit of trials; rows: their answers with `seed` and `pressure`; when: peak, residual."""
    side, axial = (np.array([row[f"{when}_{name}"] for row in rows]) for name in ("side", "axial"))
    line = line_of(kind, side, axial)
    if line is None:
        return None
    seeds = np.array([row["seed"] for row in rows])
    each = [found for s in np.unique(seeds) if (found := line_of(kind, side[seeds == s], axial[seeds == s]))]
    pressures = np.array([row["pressure"] for row in rows])
    misfit = [
        float(axial[pressures == p].mean() / strength_on(kind, line, side[pressures == p]).mean() - 1.0)
        for p in np.unique(pressures)
    ]
    return {
        "c": line.cohesion,
        "phi": line.friction,
        "c_sd": deviation([found.cohesion for found in each]),
        "phi_sd": deviation([found.friction for found in each]),
        "window": [float(side.min()), float(side.max())],
        "misfit": max(misfit, key=abs),
        "samples": len(each),
    }


def deviation(values: Sequence[float]) -> float | None:
    """Standard deviation of a sample of values; None for a single one."""
    return float(np.std(values, ddof=1)) if len(values) > 1 else None
