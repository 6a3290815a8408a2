"""Answers of one curve: stiffness, strength, dilation, by the definitions in docs/lab.md.

    E2 = d(axial) / d(strain),   nu2 = -d(side_strain) / d(strain)    at constant side stress               (1)
    sin(psi) = -(de1 + de3) / (de1 - de3)     (e1 axial, e3 lateral strain, compression positive)           (2)
    M = d(axial) / d(strain),   K0 = d(side) / d(axial)               without lateral strain                (3)
    st = 2 P / (pi D) (sin 2a - a) / sin a    with P / D the column `axial`, flat ends of half angle a      (4)

Sources: (2) Vermeer & de Borst (1984), Heron 29(3). (4) Hondros (1959), Aust. J. Appl. Sci. 10, 243-268; flattened discs: Wang et
al. (2004), Int. J. Rock Mech. Min. Sci. 41, 245-253.
"""

from math import degrees, pi, sin
from typing import Any

import numpy as np

from colluvium.forecast.packing_moduli import solid_of_plane
from colluvium.lab.curves import Curve
from colluvium.lab.specimen import FLAT

SMOOTHED = 5  # points of the running mean that gives peaks
RISE = (0.1, 0.4)  # shares of the rise to the peak between which stiffness is fitted
RESIDUAL = 0.2  # last share of the test that gives residual strength
NEAR = 0.1  # strain range from the peak on, in the test's length, that gives dilation


def answers_of(kind: str, curve: Curve) -> dict[str, float]:
    """Numbers of a trial by name, with SI units and degrees."""
    return {"biaxial": _biaxial, "shear": _shear, "oedometer": _oedometer, "brazilian": _brazilian}[kind](curve) | _balance(curve)


def smooth(values: np.ndarray, points: int = SMOOTHED) -> np.ndarray:
    """Running mean (n,) of values (n,); shorter at both ends."""
    window = np.ones(min(points, len(values)))
    return np.convolve(values, window, "same") / np.convolve(np.ones_like(values), window, "same")


def _biaxial(curve: Curve) -> dict[str, float]:
    deviator = smooth(curve["axial"] - curve["side"])
    top = int(deviator.argmax())
    last = len(deviator) - max(1, round(RESIDUAL * len(deviator)))
    young, poisson = _stiffness(curve, deviator, top)
    solid = solid_of_plane(young, poisson)
    peak_side = float(smooth(curve["side"])[top])
    return {
        "E2": young,
        "nu2": poisson,
        "E": solid.young,
        "nu": solid.poisson,
        "K2": young / (2.0 * (1.0 - poisson)),
        "G": young / (2.0 * (1.0 + poisson)),
        "peak_side": peak_side,
        "peak_axial": float(deviator[top]) + peak_side,
        "peak_strain": float(curve["strain"][top]),
        "residual_side": float(curve["side"][last:].mean()),
        "residual_axial": float(curve["axial"][last:].mean()),
        "dilation": _dilation(curve, top),
        "side_error": float(np.abs(curve["side"] / curve["side"][0] - 1.0).mean()),
        "side_bias": float((curve["side"] / curve["side"][0] - 1.0).mean()),
    }


def _rising(load: np.ndarray, top: int) -> slice:
    """Points before the peak whose load is between the shares RISE of the rise to it, at least three."""
    level = (load[: top + 1] - load[0]) / max(load[top] - load[0], 1e-300)
    first = int(np.argmax(level >= RISE[0]))
    last = int(np.argmax(level >= RISE[1]))
    return slice(max(0, min(first, last - 2)), max(last + 1, 3))


def _stiffness(curve: Curve, deviator: np.ndarray, top: int) -> tuple[float, float]:
    part = _rising(deviator, top)
    strain = curve["strain"][part]
    return _slope(strain, (curve["axial"] - curve["side"])[part]), -_slope(strain, curve["side_strain"][part])


def _slope(x: np.ndarray, y: np.ndarray) -> float:
    """Slope of the line of least squares."""
    x = x - x.mean()
    return float(x @ (y - y.mean()) / max(float(x @ x), 1e-300))


def _dilation(curve: Curve, top: int) -> float:
    """psi [deg] of Eq (2) in the strain range NEAR from the peak on."""
    strain = curve["wall_strain"]
    near = _after(strain, top)
    e1, e3 = curve["strain"][near], curve["side_strain"][near]
    rate = _slope(strain[near], e1), _slope(strain[near], e3)
    return degrees(np.arcsin(np.clip(-(rate[0] + rate[1]) / max(rate[0] - rate[1], 1e-300), -1.0, 1.0)))


def _after(strain: np.ndarray, top: int) -> np.ndarray:
    """(n,) whether points are in the strain range NEAR from the peak on; at least two are."""
    near = (strain >= strain[top]) & (strain <= strain[top] + NEAR * float(np.ptp(strain)))
    near[min(top, len(near) - 2) : top + 2] = True
    return near


def _shear(curve: Curve) -> dict[str, float]:
    shear = smooth(curve["axial"])
    top, last = int(shear.argmax()), len(shear) - max(1, round(RESIDUAL * len(shear)))
    strain = curve["strain"]
    near = _after(strain, top)
    return {
        "stiffness": _slope(strain[_rising(shear, top)], curve["axial"][_rising(shear, top)]),
        "peak_side": float(smooth(curve["side"])[top]),
        "peak_axial": float(shear[top]),
        "peak_strain": float(strain[top]),
        "residual_side": float(curve["side"][last:].mean()),
        "residual_axial": float(curve["axial"][last:].mean()),
        "dilation": degrees(np.arctan(_slope(strain[near], curve["volume"][near]))),
        "side_error": float(np.abs(curve["side"] / curve["side"][0] - 1.0).mean()),
        "side_bias": float((curve["side"] / curve["side"][0] - 1.0).mean()),
    }


def _oedometer(curve: Curve) -> dict[str, float]:
    there, back = slice(0, curve.turn + 1), slice(curve.turn, None)
    return {
        "M": _slope(curve["strain"][there], curve["axial"][there]),
        "M_unload": _slope(curve["strain"][back], curve["axial"][back]),
        "K0": _slope(curve["axial"][there], curve["side"][there]),
        "side_strain": float(np.abs(curve["side_strain"]).max()),
    }


def tensile_strength(load: float) -> float:
    """Stress at the centre of a Brazilian disc [Pa] under the force over its diameter `load` [Pa], Eq (4)."""
    return 2.0 * load / pi * (sin(2.0 * FLAT) - FLAT) / sin(FLAT)


def _brazilian(curve: Curve) -> dict[str, float]:
    load = smooth(curve["axial"])
    top = int(load.argmax())
    return {"tension": tensile_strength(float(load[top])), "peak_strain": float(curve["wall_strain"][top])}


def _balance(curve: Curve) -> dict[str, Any]:
    """Energy at the end of the test over the work of the walls."""
    work = float(curve["work"][curve.turn])
    parts = {name: float(curve[name][curve.turn]) / work if work else 0.0 for name in ("stored", "kinetic", "lost")}
    return (
        {"work": work}
        | {f"{name}_share": value for name, value in parts.items()}
        | {"bonds_broken": float(curve["bonds_broken"][curve.turn])}
    )
