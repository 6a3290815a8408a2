"""The table `[fos]` of a scene: how a factor of safety is looked for."""

from typing import Annotated, Literal

from pydantic import Field, model_validator

from coupler_protocol.scene.declare import Table, quantity

Positive = Annotated[float, Field(gt=0)]


class FactorOfSafety(Table):
    """How `colluvium fos` finds a factor of safety; `colluvium run` does not read it."""

    by: Literal["strength", "gravity"] = quantity(
        "strength", meaning="divide c and tan(phi) by the factor, or multiply gravity (then it is no factor of safety)"
    )
    bracket: tuple[Positive, Positive] = quantity((1.0, 1.5), meaning="factors tried first; widened where both rest or fail")
    resolution: float = quantity(0.005, meaning="width of the last bracket over its middle", gt=0, lt=0.5)
    ratio: float = quantity(1e-5, meaning="unbalanced force ratio below which a trial can be at rest", gt=0, le=1e-3)
    steps: int | None = quantity(
        None,
        unit="steps",
        meaning="budget of a trial; one without a verdict by then is undecided (none: 60,000, or eight times as many as the "
        "elastic grid needs to come to rest, whichever is more)",
        ge=1000,
    )
    dilation: Literal["kept", "reduced"] = quantity(
        "kept", meaning="psi stays until the reduced phi reaches it, or tan(psi) is divided by the factor too"
    )
    tension: Literal["kept", "reduced"] = quantity("kept", meaning="tensile strength stays, or is divided by the factor too")
    zone_sizes: list[Positive] | None = quantity(
        None, unit="m", meaning="sizes in x of the zones of several meshes, for extrapolation; none: the grid's own", min_length=1
    )

    @model_validator(mode="after")
    def _in_order(self):
        if self.bracket[0] >= self.bracket[1]:
            raise ValueError("bracket is [low, high] with low < high")
        if self.zone_sizes and len(set(self.zone_sizes)) < len(self.zone_sizes):
            raise ValueError("zone_sizes holds a size twice")
        return self
