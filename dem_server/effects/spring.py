"""Linear springs between two touching discs, normal and tangential.

Two discs whose stiffnesses act in series share one contact stiffness

    k = ka kb / (ka + kb)                                                        (1)

and with the gap g - gr between them (gr: reference gap, compression positive forces)

    Fn = -kn (g - gr),    Fs <- Fs - ks * slip.                                  (2)

Sources: Cundall & Strack (1979), Géotechnique 29, 47-65 (the law); Itasca, PFC2D 3.1 Theory, "Contact
constitutive models".
"""

from typing import ClassVar, NamedTuple

import numpy as np

from coupler_protocol.scene.declare import Effect, History, quantity


class Spring(Effect):
    """linear normal and shear springs at the contacts"""

    source: ClassVar[str] = "Cundall & Strack (1979), Géotechnique 29, 47-65"
    normal: float = quantity(unit="N/m", meaning="normal stiffness of a disc (or of a contact)", gt=0)
    shear: float = quantity(unit="N/m", meaning="shear stiffness of a disc (or of a contact)", ge=0)


HISTORIES = (
    History("normal", "pair", unit="N", meaning="normal force of the spring, compression positive"),
    History("shear", "pair", unit="N", meaning="shear force; only where the law has one"),
    History("reference_gap", "pair", unit="m", meaning="gr of Eqs (2); only where contacts are given one"),
)


class SpringTable(NamedTuple):
    """Contact stiffnesses of each kind of pair: `normal`, `shear` (kinds,) [N/m]."""

    normal: np.ndarray
    shear: np.ndarray


def in_series(ka, kb):
    """Stiffness k of Eq (1) [N/m]; zero if one of the two is zero."""
    return ka * kb / (ka + kb) if ka * kb > 0.0 else 0.0


def spring_table(pairs, stiffness):
    """Table of the kinds of pairs; `stiffness`: whether values of grains belong to the "disc" or to the "contact".

    Values of the contact are unchanged between discs of one material: the harmonic mean of both. A grain without
    springs has those of its partner. Values of a table of the pair belong to the contact.
    """
    factor = {"disc": 1.0, "contact": 2.0}[stiffness]
    grains = (grain for pair in pairs for grain in (pair.a, pair.b))
    some = next(grain.spring for grain in grains if grain.spring is not None)
    normal, shear = [], []
    for pair in pairs:
        a, b, own = pair.tables("spring")
        a, b = a or b or some, b or a or some
        normal.append(own.normal if own else factor * in_series(a.normal, b.normal))
        shear.append(own.shear if own else factor * in_series(a.shear, b.shear))
    return SpringTable(np.array(normal), np.array(shear))


def normal_force(kn, gap):
    """Normal force Fn of Eqs (2) [N], compression positive; gap: g - gr [m]."""
    return -kn * gap


def shear_force(ks, slip, before):
    """Shear force Fs of Eqs (2) [N]; slip: tangential displacement of this step [m], before: previous force [N]."""
    return before - ks * slip
