"""The [[measure]] tables of a scene: regions in which discs are measured."""

from typing import Any

from pydantic import model_validator

from coupler_protocol.scene.declare import Table, quantity
from coupler_protocol.scene.names import Name
from coupler_protocol.scene.tables.grid import Point


class Measure(Table):
    """A circle or polygon, fixed in space, in which the discs of a window are measured every `record.measure` steps.

    Histories of the discs, with the region's name after a colon: `stress_xx`, `stress_yy`, `stress_xy`, `porosity`,
    `coordination`, `mechanical_coordination`, `sliding`, `strain_rate_xx`, `strain_rate_yy`, `strain_rate_xy`, each also with
    `_error`, its standard error, and `bodies` (docs/measuring.md).
    """

    name: Name = quantity(meaning="name of the region")
    window: Name | None = quantity(None, meaning="name of the window in which the region lies; none: the only one")
    centre: Point | None = quantity(None, unit="m", place="xy", meaning="centre of a circle, with `radius`")
    radius: float | None = quantity(None, unit="m", meaning="radius of a circle, with `centre`", gt=0)
    polygon: list[Point] | None = quantity(
        None, unit="m", place="xy", meaning="corners of a polygon, instead of a circle", min_length=3
    )

    @model_validator(mode="after")
    def _one_shape(self) -> "Measure":
        if (self.centre is None) != (self.radius is None) or (self.centre is None) == (self.polygon is None):
            raise ValueError("a region has centre and radius, or a polygon")
        return self

    @property
    def region(self) -> Any:
        """The region as coupler_protocol.measures.regions.Region takes it."""
        return self.polygon if self.centre is None else (*self.centre, self.radius)
