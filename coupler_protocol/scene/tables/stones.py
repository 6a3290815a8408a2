"""The [stones] table of a scene: content, sizes, shapes and directions of random stones, or a file of mapped stones."""

from typing import Annotated, Literal

from pydantic import AfterValidator, Field, model_validator

from coupler_protocol.scene.declare import Table, increasing, quantity
from coupler_protocol.scene.names import Hash, hash_meaning

Corners = Annotated[int, Field(ge=4, le=64)]
Flatness = Annotated[float, Field(ge=1, le=5)]


class StoneSize(Table):
    """Lognormal sizes of stones: diameters of circles of equal area."""

    mean: float = quantity(unit="m", meaning="mean of the distribution before truncation at min and max", gt=0)
    sigma: float = quantity(meaning="standard deviation of ln(size)", gt=0, le=2)
    min: float = quantity(unit="m", meaning="smallest size", gt=0)
    max: float = quantity(unit="m", meaning="largest size", gt=0)

    @model_validator(mode="after")
    def _in_order(self) -> "StoneSize":
        if not self.min < self.mean < self.max:
            raise ValueError("min, mean and max must be in increasing order")
        return self


class Azimuth(Table):
    """Directions of the stones' long axes, counter-clockwise from x; 10 and 190 degrees are the same direction.

    mean and spread: wrapped normal, the angle is normal and counted modulo 180 degrees; twice the angle then has the mean
    resultant exp(-2 spread^2), spread in radians. range: uniform between two angles. The window has exactly the directions
    drawn: to find room, stones move and exchange directions, but do not turn.
    """

    mean: float | None = quantity(None, unit="deg", meaning="mean direction", ge=-180, le=180)
    spread: float | None = quantity(None, unit="deg", meaning="standard deviation of the normal angle", ge=0, le=180)
    range: Annotated[tuple[float, float], AfterValidator(increasing)] | None = quantity(
        None, unit="deg", meaning="smallest and largest direction, at most 180 degrees apart"
    )

    @model_validator(mode="after")
    def _one_distribution(self) -> "Azimuth":
        normal = self.mean is not None and self.spread is not None
        if normal == (self.range is not None) or (self.mean is None) != (self.spread is None):
            raise ValueError("give mean and spread, or range")
        if self.range is not None and self.range[1] - self.range[0] > 180.0:
            raise ValueError("a range spans at most 180 degrees")
        return self


class Stones(Table):
    """Stones among the discs of every window: random polygons, traced shapes at random positions, or a map of traced stones.

    content, size: random stones, polygons convex and concave, or with `shapes` copies of traced ones. file: the traced
    stones at their positions; each window takes those inside it. Files are GeoJSON (Polygons, MultiPolygons: exterior
    rings) or CSV (stone, x, y: corners in order); paths are relative to the folder of the scene.
    """

    body: Literal["clump", "cluster"] = quantity("clump", meaning="rigid, or discs with bonds that can break")
    content: float | None = quantity(
        None, meaning="area of the stones over area of the window; required without file", gt=0, le=0.75
    )
    size: StoneSize | None = Field(default=None, description="lognormal sizes; required without file")
    vertices: Annotated[tuple[Corners, Corners], AfterValidator(increasing)] = quantity(
        (6, 12), meaning="smallest and largest number of corners"
    )
    flatness: Annotated[tuple[Flatness, Flatness], AfterValidator(increasing)] = quantity(
        (1.0, 1.8), meaning="smallest and largest ratio of long to short axis"
    )
    gap: float = quantity(0.0, unit="m", meaning="smallest distance between stones, and to the edge of the window", ge=0)
    azimuth: Azimuth | None = Field(default=None, description="directions of the long axes; no table: uniform")
    shapes: str | None = quantity(None, meaning="file of traced stones whose shapes random stones take", min_length=1)
    shapes_hash: Hash | None = quantity(None, meaning=hash_meaning("shapes"))
    file: str | None = quantity(None, meaning="file of traced stones, kept at their positions", min_length=1)
    file_hash: Hash | None = quantity(None, meaning=hash_meaning("file"))
    scale: float = quantity(1.0, unit="m", meaning="length of a unit of `file`, such as a pixel", gt=0)
    origin: tuple[float, float] = quantity((0.0, 0.0), unit="m", meaning="position of the point (0, 0) of `file`")
    flip_y: bool = quantity(False, meaning="y of the file points downwards, as in images")
    outside: Literal["clip", "leave out", "refuse"] = quantity(
        "clip", meaning="stones of `file` that reach beyond the window: clipped at its edge, left out, or refused"
    )

    def changed(self, *keys: str) -> list[str]:
        """Those of `keys` whose values differ from the defaults."""
        return [key for key in keys if getattr(self, key) != type(self).model_fields[key].default]
