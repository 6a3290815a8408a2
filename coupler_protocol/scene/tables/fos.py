"""The table `[fos]` of a scene: search for a factor of safety."""

from typing import Annotated, Literal

from pydantic import Field, model_validator

from coupler_protocol.scene.declare import Table, quantity

Positive = Annotated[float, Field(gt=0)]


class FactorOfSafety(Table):
    """Search of `colluvium fos` for a factor of safety; `colluvium run` does not use this table."""

    by: Literal["strength", "gravity"] = quantity(
        "strength", meaning="divide c and tan(phi) by the factor, or multiply gravity (the result is then not a factor of safety)"
    )
    bracket: tuple[Positive, Positive] = quantity((1.0, 1.5), meaning="factors tried first; widened if both rest or both fail")
    resolution: float = quantity(0.005, meaning="width of the final bracket over its middle", gt=0, lt=0.5)
    ratio: float = quantity(1e-5, meaning="unbalanced force ratio below which a trial can be at rest", ge=1e-12, le=1e-3)
    steps: int | None = quantity(
        None,
        unit="steps",
        meaning="budget of a trial; without a verdict by then it is undecided (none: 60,000, or eight times the steps that "
        "the elastic grid needs to come to rest, whichever is larger)",
        ge=1000,
    )
    flow: Literal["scene", "zero", "associated"] = quantity(
        "scene",
        meaning="dilation angles psi of the materials, psi = 0, or psi = phi, before strength is divided "
        "(`colluvium fos --flow both`: the last two, one after the other)",
    )
    dilation: Literal["kept", "reduced"] = quantity(
        "kept", meaning="psi is kept until the reduced phi reaches it, or tan(psi) is also divided by the factor"
    )
    tension: Literal["kept", "reduced"] = quantity("kept", meaning="tensile strength is kept, or is also divided by the factor")
    zone_sizes: list[Positive] | None = quantity(
        None, unit="m", meaning="zone sizes in x of several meshes, for extrapolation; none: that of the grid", min_length=1
    )

    @model_validator(mode="after")
    def _in_order(self) -> "FactorOfSafety":
        if self.bracket[0] >= self.bracket[1]:
            raise ValueError("bracket is [low, high] with low < high")
        if self.zone_sizes and len(set(self.zone_sizes)) < len(self.zone_sizes):
            raise ValueError("zone_sizes holds a size twice")
        return self
