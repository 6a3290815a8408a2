"""The table `[calibrate]` of a scene: targets, tests and free parameters of `colluvium calibrate`."""

from typing import Annotated, Literal

from pydantic import AfterValidator, Field, model_validator

from coupler_protocol.scene.declare import Table, increasing, quantity
from coupler_protocol.scene.tables.lab import Positive, Seed, Variant

Goal = Literal["young", "poisson", "strength", "dilation"]
Free = Literal["normal", "ratio", "friction", "bond", "rolling"]
Bounds = Annotated[tuple[Positive, Positive], AfterValidator(increasing)]
FromZero = Annotated[tuple[Annotated[float, Field(ge=0)], Positive], AfterValidator(increasing)]


class LaboratoryCurve(Table):
    """A curve of a soil laboratory that is a target (docs/calibration.md describes the file)."""

    file: str = quantity(
        meaning="CSV file, from the folder of the scene: strain, deviator, and volume if it was measured", min_length=1
    )
    confinement: float = quantity(unit="Pa", meaning="confining stress of the test, compression positive", gt=0)
    test: Literal["plane", "triaxial"] = quantity("plane", meaning="plane strain, or equal stresses on all sides")


class FreeBounds(Table):
    """Bounds of the parameters that vary."""

    normal: Bounds | None = quantity(None, unit="N/m", meaning="normal stiffness of the soil; none: 1/30 .. 30 times the start")
    ratio: Bounds = quantity((0.05, 1.0), meaning="shear over normal stiffness of the soil")
    friction: Bounds = quantity((0.02, 1.0), meaning="friction coefficient of the soil")
    bond: Bounds | None = quantity(
        None, unit="N", meaning="tensile strength of a bond of the soil; none: 1/30 .. 30 times the start"
    )
    rolling: FromZero = quantity((0.0, 0.5), meaning="rolling coefficient of soil and stone")


class Calibrate(Table):
    """Search for parameters of the discs that give a target soil, by `colluvium calibrate` (docs/calibration.md).

    Targets without a value are those of the material of the window, in a coupled scene. Tests are biaxial tests with the stresses
    and samples of [lab]. `colluvium run` does not use this table.
    """

    fit: list[Goal] = quantity(
        ["young", "poisson", "strength"],
        meaning="what is fitted; strength: peaks at all stresses of lab.confinement",
        min_length=1,
    )
    young: float | None = quantity(None, unit="Pa", meaning="target of Young's modulus", gt=0)
    poisson: float | None = quantity(None, meaning="target of Poisson's ratio", ge=0, lt=1)
    moduli: Literal["solid", "plane"] = quantity(
        "solid", meaning="`young` and `poisson` are the moduli in three dimensions (plane strain), or those in the plane"
    )
    cohesion: float | None = quantity(None, unit="Pa", meaning="target of the cohesion", ge=0)
    friction: float | None = quantity(None, unit="deg", meaning="target of the friction angle", gt=0, lt=60)
    dilation: float | None = quantity(None, unit="deg", meaning="target of the dilation angle after the peak", gt=-45, lt=60)
    curve: list[LaboratoryCurve] = Field(
        default_factory=list, description="curves of a soil laboratory, instead of these numbers"
    )
    sample: Variant | None = quantity(
        None, meaning="sample that has the targets; none: with the stones of [stones] if there are any"
    )
    seeds: list[Seed] = quantity(
        [1, 2], meaning="samples of the search; all sets of parameters are tested with them", min_length=1
    )
    check: list[Seed] = quantity([11, 12, 13], meaning="other samples, which check the answer and give its scatter", min_length=1)
    tolerance: float = quantity(0.1, meaning="relative difference from young and strength that is accepted", gt=0, lt=1)
    tolerance_poisson: float = quantity(0.03, meaning="difference from poisson that is accepted", gt=0, lt=0.5)
    tolerance_dilation: float = quantity(3.0, unit="deg", meaning="difference from dilation that is accepted", gt=0, lt=45)
    vary: list[Free] = quantity(
        ["normal", "ratio", "friction", "bond"], meaning="parameters that vary; others stay", min_length=1
    )
    bounds: FreeBounds = Field(default=FreeBounds(), description="bounds of the parameters that vary")
    tests: int = quantity(100, meaning="largest number of tests, those of an interrupted calibration included", ge=1, le=10000)

    @model_validator(mode="after")
    def _consistent(self) -> "Calibrate":
        for key in ("fit", "seeds", "check", "vary"):
            if len(set(getattr(self, key))) < len(getattr(self, key)):
                raise ValueError(f"{key} holds a value twice")
        if common := sorted(set(self.seeds) & set(self.check)):
            raise ValueError(f"seeds and check share {common[0]}: give check other seeds")
        if self.moduli == "solid" and (self.poisson or 0.0) >= 0.5:
            raise ValueError(
                f'poisson {self.poisson:g} is not possible in three dimensions; give moduli = "plane" or less than 0.5'
            )
        return self
