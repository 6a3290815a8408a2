"""The table `[lab]` of a scene: samples and loading of `colluvium lab`."""

from typing import Annotated, Literal

from pydantic import Field, model_validator

from coupler_protocol.scene.declare import Table, quantity

Positive = Annotated[float, Field(gt=0)]
Seed = Annotated[int, Field(ge=0, lt=2**63)]
Variant = Literal["soil", "clump", "cluster"]


class Lab(Table):
    """Laboratory tests of the scene's discs by `colluvium lab` (docs/lab.md); `colluvium run` does not use this table."""

    confinement: list[Positive] = quantity(
        [50e3, 100e3, 200e3],
        unit="Pa",
        meaning="stresses under which samples are pressed and tested, compression positive",
        min_length=1,
    )
    seeds: list[Seed] = quantity([1, 2, 3], meaning="a sample of each seed is tested under each stress", min_length=1)
    samples: list[Variant] | None = quantity(
        None,
        meaning="soil: without stones; clump, cluster: with the stones of [stones], rigid or bonded; "
        "none: soil, and with [stones] also its body",
        min_length=1,
    )
    width: float = quantity(50.0, unit="radii", meaning="width of a sample, or diameter, in mean radii of the discs", ge=16)
    slenderness: float = quantity(2.0, meaning="height over width of a biaxial sample", ge=0.5, le=4)
    press: Literal["smooth", "rough"] = quantity(
        "smooth", meaning="samples are packed and pressed without friction, as a window is, or with the friction of the discs"
    )
    bond_gap: float = quantity(
        0.0,
        unit="m",
        meaning="after the press, bonds are made at all contacts with a gap up to this; a window has more contacts than a sample",
        ge=0,
    )
    strain: float | None = quantity(
        None,
        meaning="strain at the end of a test, in a shear test displacement over height; none: 8 times the estimated strength "
        "over the estimated modulus, 0.01 .. 0.2",
        gt=0,
        lt=0.5,
    )
    rate: float | None = quantity(
        None,
        unit="1/step",
        meaning="strain a step; none: in the steps of one row of discs, 0.01 of the estimated strength is put on",
        gt=0,
        lt=1e-3,
    )
    points: int = quantity(400, meaning="points of a curve", ge=50, le=20000)

    @model_validator(mode="after")
    def _each_once(self) -> "Lab":
        for key in ("confinement", "seeds", "samples"):
            values = getattr(self, key) or []
            if len(set(values)) < len(values):
                raise ValueError(f"{key} holds a value twice")
        return self
