"""Strength that changes with plastic shear strain: cohesion, friction, dilation and tensile strength as polylines.

The plastic shear strain k of a triangle grows with the deviator e^p of every plastic strain increment of shear,

    dk = sqrt(e^p : e^p / 2)                       dk = lambda sqrt(1 + Np + Np^2)/sqrt(3) on a single plane

the measure of FLAC's strain-softening model (Itasca 2011, FLAC 7.0 Constitutive Models), which has it for a single plane. Plane
shear without dilation by the plastic angle gamma gives k = gamma/2. A return moves principal stresses along fixed directions, so
e^p is the deviator of (trial - result)/2G, also on edges and at the apex. Opening cracks do not change k. A zone has one k, the
area mean of its triangles.

Between two points a value is linear in k, beyond the last point it is constant. The strength of a step is that of k at its
beginning: it lags by one step. Unlike in FLAC, tensile strength also follows the plastic shear strain. A softening band is one
zone wide for any zone size: results depend on the zone size, and steep softening needs small steps of load.
"""

from math import sqrt
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field, model_validator

from coupler_protocol.scene.declare import Effect, History, quantity

INF = float("inf")
HISTORIES = (
    History(
        "plastic_shear", "zone", meaning="plastic shear strain k, area mean of the triangles", recorded="plastic_shear_strain"
    ),
)
CURVES = ("cohesion", "friction", "dilation", "tension")
NotNegative = Annotated[float, Field(ge=0)]
Angle = Annotated[float, Field(ge=0, lt=60)]


class Softening(Effect):
    """Strength that changes with plastic shear strain"""

    source: ClassVar[str] = "Itasca (2011), FLAC 7.0 Constitutive Models, strain-softening/hardening Mohr-Coulomb model"
    strain: list[Annotated[float, Field(gt=0)]] = quantity(
        meaning="plastic shear strains, increasing; at 0 the values are those of mohr_coulomb and tension", min_length=1
    )
    cohesion: list[NotNegative] | None = quantity(None, unit="Pa", meaning="cohesion at these strains; none: constant")
    friction: list[Angle] | None = quantity(
        None, unit="deg", meaning="friction angle at these strains; none: constant", usual=(1.6, 60)
    )
    dilation: list[Angle] | None = quantity(
        None, unit="deg", meaning="dilation angle at these strains; none: constant", usual=(0.1, 60)
    )
    tension: list[NotNegative] | None = quantity(None, unit="Pa", meaning="tensile strength at these strains; none: constant")

    @model_validator(mode="after")
    def _one_value_a_strain(self):
        if any(b <= a for a, b in zip(self.strain, self.strain[1:], strict=False)):
            raise ValueError("strain must increase from point to point")
        given = {name: values for name in CURVES if (values := getattr(self, name)) is not None}
        if not given:
            raise ValueError(f"nothing softens: give at least one of {', '.join(CURVES)}")
        for name, values in given.items():
            if len(values) != len(self.strain):
                raise ValueError(f"{name} has {len(values)} values for {len(self.strain)} strains: give one for each")
        return self


def curves(softening, mohr_coulomb, tension):
    """Values {name: list} at strain 0 and at the points of the table; without a table of strength infinite, and no angles."""
    start = {
        "cohesion": INF if mohr_coulomb is None else mohr_coulomb.cohesion,
        "friction": 0.0 if mohr_coulomb is None else mohr_coulomb.friction,
        "dilation": 0.0 if mohr_coulomb is None else mohr_coulomb.dilation,
        "tension": INF if tension is None else tension.strength,
    }
    points = 0 if softening is None else len(softening.strain)
    later = {name: softening and getattr(softening, name) for name in CURVES}
    return {name: [start[name], *(later[name] or [start[name]] * points)] for name in CURVES}


def parameters(materials):
    """Rows (M, 5 P) of M materials for the kernel: P strains [-], then as many values of every curve [Pa, deg].

    The last strain is infinite, with the values of the previous one.
    """
    count = 2 + max(len(m.softening.strain) if m.softening else 0 for m in materials)
    table = []
    for m in materials:
        strain = [0.0, *(m.softening.strain if m.softening else [])]
        rows = [strain + [INF] * (count - len(strain))]
        rows += [v + [v[-1]] * (count - len(v)) for v in curves(m.softening, m.mohr_coulomb, m.tension).values()]
        table.append(np.concatenate(rows))
    return np.array(table, dtype=np.float64)


def between(share, before, after):
    """Value [Pa or deg] at `share` of the distance between two points; equal values may be infinite."""
    return before if before == after else before + share * (after - before)


def shear_strain(d1, d2, d3, shear):
    """Plastic shear strain [-] of a return by d1, d2, d3 [Pa] of the principal stresses; shear: G [Pa]."""
    mean = (d1 + d2 + d3) / 3.0
    a, b, c = d1 - mean, d2 - mean, d3 - mean
    return sqrt(0.5 * (a * a + b * b + c * c)) / (2.0 * shear)
