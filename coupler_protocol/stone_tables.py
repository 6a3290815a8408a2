"""The [stones] table of a scene: how many, which sizes and shapes."""

from typing import Annotated, Literal

from pydantic import AfterValidator, Field, model_validator

from coupler_protocol.declare import Table, increasing, quantity

Corners = Annotated[int, Field(ge=4, le=64)]
Flatness = Annotated[float, Field(ge=1, le=5)]


class StoneSize(Table):
    """Lognormal sizes of stones: diameters of circles of equal area."""

    mean: float = quantity(unit="m", meaning="mean of the distribution before sizes beyond min and max are left out", gt=0)
    sigma: float = quantity(meaning="standard deviation of ln(size)", gt=0, le=2)
    min: float = quantity(unit="m", meaning="smallest size", gt=0)
    max: float = quantity(unit="m", meaning="largest size", gt=0)

    @model_validator(mode="after")
    def _in_order(self):
        if not self.min < self.mean < self.max:
            raise ValueError("min, mean and max must be in increasing order")
        return self


class Stones(Table):
    """Stones among the discs of every window: random polygons, convex and concave."""

    content: float = quantity(meaning="area of the stones over area of the window", gt=0, le=0.75)
    body: Literal["clump", "cluster"] = quantity("clump", meaning="rigid, or discs bonded to each other that can break")
    size: StoneSize = Field(description="lognormal sizes")
    vertices: Annotated[tuple[Corners, Corners], AfterValidator(increasing)] = quantity(
        (6, 12), meaning="least and largest number of corners"
    )
    flatness: Annotated[tuple[Flatness, Flatness], AfterValidator(increasing)] = quantity(
        (1.0, 1.8), meaning="least and largest ratio of long to short axis"
    )
    gap: float = quantity(0.0, unit="m", meaning="least distance between stones, and to the window's edge", ge=0)
