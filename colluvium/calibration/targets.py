"""Targets of a calibration, as goals with a tolerance: from [calibrate], curves of a laboratory, or the material of the window.

Young's modulus and Poisson's ratio are those in three dimensions of plane strain. The strength is the peak deviator at each
confining stress s3, which tests measure with less scatter than cohesion and friction angle:

    q = (N - 1) s3 + 2 c sqrt(N),    N = (1 + sin phi) / (1 - sin phi)           (1)

A goal compares logarithms of moduli and strengths, so that 10 % too much and too little count alike.
"""

from math import log, radians, sqrt, tan
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from colluvium.calibration.laboratory_curve import Measured, measured
from colluvium.forecast.packing_moduli import solid_of_plane

UNITS = {"young": ("E", "MPa", 1e6), "poisson": ("nu", "", 1.0), "dilation": ("psi", "deg", 1.0)}
FITTED = {"young": ("young",), "poisson": ("poisson",), "strength": ("cohesion", "friction"), "dilation": ("dilation",)}


class Goal(NamedTuple):
    """A target: its name, its value, the accepted difference (relative if `relative`), and the confining stress of a strength."""

    name: str
    value: float
    tolerance: float
    relative: bool
    pressure: float = 0.0

    @property
    def elastic(self) -> bool:
        """Whether it is a modulus, which a short test measures."""
        return self.name in ("young", "poisson")

    @property
    def label(self) -> str:
        """Its symbol, as in tables."""
        return UNITS[self.name][0] if self.name in UNITS else f"q({self.pressure / 1e3:g} kPa)"

    def words(self, value: float) -> str:
        """A value of this quantity with its unit."""
        _, unit, size = UNITS.get(self.name, ("", "kPa", 1e3))
        return f"{value / size:.3g}{' ' + unit if unit else ''}"

    def scaled(self, value: float) -> float:
        """The coordinate in which goals compare: the logarithm of a relative quantity; NaN for one that has none."""
        if not self.relative:
            return value
        return log(value) if value > 0.0 else float("nan")

    def plain(self, scaled: float) -> float:
        """The value of a coordinate."""
        return float(np.exp(scaled)) if self.relative else scaled

    def miss(self, scaled: float) -> float:
        """Difference of a coordinate from the target, in tolerances."""
        return (scaled - self.scaled(self.value)) / self.width

    @property
    def width(self) -> float:
        """The tolerance as a difference of coordinates."""
        return log(1.0 + self.tolerance) if self.relative else self.tolerance


class Targets(NamedTuple):
    """Goals of a calibration; `cohesion` [Pa] and `friction` [deg] if known; `source`: where the values are from, in words."""

    goals: list[Goal]
    cohesion: float | None
    friction: float | None
    source: str

    def value(self, name: str) -> float | None:
        """Value of the first goal of this name; None without one."""
        return next((goal.value for goal in self.goals if goal.name == name), None)


def deviator(cohesion: float, friction: float, pressure: float) -> float:
    """Peak deviator of Eq (1) [Pa]; friction [deg]."""
    passive = tan(radians(45.0 + 0.5 * friction)) ** 2
    return (passive - 1.0) * pressure + 2.0 * cohesion * sqrt(passive)


def strength_name(pressure: float) -> str:
    """Name of the goal of the strength at a confining stress [Pa]."""
    return f"strength.{pressure / 1e3:g}kPa"


def targets_of(scene: Any, folder: Path) -> tuple[Targets, list[tuple[str, str, str]]]:
    """Targets of a scene, and its problems as (key, problem, remedy); curves are read from `folder`."""
    table = scene.calibrate
    curves, problems = _curves(table, folder)
    numbers, source = _numbers(scene, table)
    if curves:
        numbers, source = numbers | _of_curves(curves), "curves of a laboratory"
    for name in table.fit:
        given = name == "strength" and curves
        for key in FITTED[name]:
            if numbers.get(key) is None and not given:
                remedy = "give a value, " + (
                    f"or remove {name!r} from calibrate.fit" if len(table.fit) > 1 else "or a curve with it"
                )
                problems.append((f"calibrate.{key}", "there is no target", remedy))
    if problems:
        return Targets([], None, None, source), problems
    goals = [_goal(table, name, numbers[name]) for name in ("young", "poisson", "dilation") if name in table.fit]
    if "strength" in table.fit:
        peaks = {c.confinement: m.deviator for c, m in curves} or {
            p: deviator(numbers["cohesion"], numbers["friction"], p) for p in scene.lab.confinement
        }
        goals += [Goal(strength_name(p), q, table.tolerance, True, p) for p, q in sorted(peaks.items())]
    return Targets(goals, numbers.get("cohesion"), numbers.get("friction"), source), []


def _goal(table: Any, name: str, value: float) -> Goal:
    tolerance = {"young": table.tolerance, "poisson": table.tolerance_poisson, "dilation": table.tolerance_dilation}[name]
    return Goal(name, value, tolerance, name == "young")


def _curves(table: Any, folder: Path) -> tuple[list[tuple[Any, Measured]], list[tuple[str, str, str]]]:
    """Curves of a laboratory with their tables, and problems of their files."""
    found, problems = [], []
    for number, curve in enumerate(table.curve):
        try:
            found.append((curve, measured(folder / curve.file, curve.confinement, curve.test == "triaxial")))
        except (OSError, ValueError) as error:
            why = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
            problems.append((f"calibrate.curve[{number}].file", f"{curve.file}: {why}", "docs/calibration.md describes the file"))
    if len({curve.confinement for curve in table.curve}) < len(table.curve):
        problems.append(("calibrate.curve", "two curves have the same confinement", "give the mean of both, or one of them"))
    return found, problems


def _of_curves(curves: list[tuple[Any, Measured]]) -> dict[str, float]:
    """Means over curves of what each of them has."""
    means = {}
    for name in ("young", "poisson", "dilation"):
        values = [value for _, one in curves if (value := getattr(one, name)) is not None]
        if values:
            means[name] = float(np.mean(values))
    return means


def _numbers(scene: Any, table: Any) -> tuple[dict[str, Any], str]:
    """Targets by key, those of the table before those of the window's material, and where they are from."""
    found, source = _of_window(scene)
    own = {key: getattr(table, key) for key in ("young", "poisson", "cohesion", "friction", "dilation")}
    own = {key: value for key, value in own.items() if value is not None}
    if table.moduli == "plane" and {"young", "poisson"} <= set(own):
        solid = solid_of_plane(own["young"], own["poisson"])
        own |= {"young": solid.young, "poisson": solid.poisson}
    if own and found:
        source = f"[calibrate] for {', '.join(own)}, else {source}" if set(found) - set(own) else "[calibrate]"
    return found | own, source or "[calibrate]"


def _of_window(scene: Any) -> tuple[dict[str, Any], str]:
    """Targets of the material that most of the zones of the windows have; none without a grid."""
    if scene.grid is None or not scene.window:
        return {}, ""
    from coupler_protocol.scene.local_origin import local
    from fdm_server.effects.elastic import poisson_ratio, young_modulus
    from fdm_server.mesh.grid import areas, build_grid
    from fdm_server.mesh.window_zones import window_zones

    ground = local(scene)
    grid = build_grid(ground)
    inside = np.any([window_zones(grid, window) for window in ground.window], axis=0)
    share = np.bincount(grid.material[inside], areas(grid.xy, grid.zones)[inside], len(scene.material))
    material = scene.material[int(share.argmax())]
    words = f"material {material.name!r} of the window"
    if (share > 0.0).sum() > 1:
        words += f" ({100.0 * share.max() / share.sum():.0f} % of its area)"
    found = {"young": young_modulus(material.elastic), "poisson": poisson_ratio(material.elastic)}
    law = material.mohr_coulomb
    if law is not None:
        found |= {"cohesion": law.cohesion, "friction": law.friction, "dilation": law.dilation}
    return found, words
