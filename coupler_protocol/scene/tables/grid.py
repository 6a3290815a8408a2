"""The [grid] table of a scene: kind, extent and zone size of the mesh."""

from numbers import Real
from typing import Annotated, Any, Literal, cast

from pydantic import BeforeValidator, Field, model_validator

from coupler_protocol.scene.declare import Table, quantity


def _both_ways(value: Any) -> Any:
    return (value, value) if isinstance(value, Real) and not isinstance(value, bool) else value


Positive = Annotated[float, Field(gt=0)]
Point = tuple[float, float]
Span = tuple[Annotated[int, Field(ge=0)], Annotated[int, Field(ge=0)]]  # first and last zone

NEEDED = {
    "slope": ("length", "height", "zone_size", "profile"),
    "box": ("length", "height", "zone_size"),
    "ring": ("inner", "outer", "around"),
}
ALLOWED = {"slope": ("fit", "graded"), "box": ("graded",), "ring": ("part", "growth")}


class Graded(Table):
    """Zones of `zone_size` in a rectangle, with sizes that grow from there towards the sides and the bottom."""

    x: tuple[float, float] | None = quantity(None, unit="m", place="x", meaning="first and last x of the rectangle; none: all")
    y: tuple[float, float] | None = quantity(
        None, unit="m", place="y", meaning="lowest and highest y of the rectangle; none: all"
    )
    ratio: float = quantity(meaning="size ratio of a zone to its neighbour nearer to the rectangle", gt=1, le=1.5)

    @model_validator(mode="after")
    def _in_order(self) -> "Graded":
        if self.x is None and self.y is None:
            raise ValueError("give x = [first, last], y = [lowest, highest], or both")
        for axis in ("x", "y"):
            span = getattr(self, axis)
            if span is not None and not span[0] < span[1]:
                raise ValueError(f"{axis} is [first, last] with first < last")
        return self


class Grid(Table):
    """Mesh of the continuum. A kind takes the keys whose meaning names it, and those whose meaning names no kind."""

    kind: Literal["slope", "box", "ring"] = quantity(
        "slope", meaning="a slope under `profile`, a box, or zones around a circular hole with its centre at `origin`"
    )
    length: float | None = quantity(None, unit="m", meaning="extent in x, from `origin` (slope and box, required)", gt=0)
    height: float | None = quantity(None, unit="m", meaning="extent in y, from `origin` (slope and box, required)", gt=0)
    zone_size: Annotated[tuple[Positive, Positive], BeforeValidator(_both_ways)] | None = quantity(
        None,
        unit="m",
        meaning="slope and box, required: size of a zone, one number or [in x, in y]; length and height must be whole "
        'multiples of it; with fit = "profile" or graded it is adjusted slightly',
    )
    origin: Point | None = quantity(
        None,
        unit="m",
        meaning="lower left corner of the grid, centre of the hole of a ring; none: (0, 0), or if a profile begins elsewhere "
        "(UTM) its first x, and `height` below its highest point if all of it is higher than `height`",
    )
    profile: list[Point] | None = quantity(
        None,
        unit="m",
        place="xy",
        meaning="slope, required: ground surface from left (x of `origin`) to right (`length` further), faces up to vertical, no "
        "overhangs",
        min_length=2,
    )
    fit: Literal["diagonals", "profile", "face"] = quantity(
        "diagonals",
        meaning="slope: diagonals: faces run along sides and diagonals of equal zones (the profile snaps to them, a face at "
        "another angle is refused); profile: gridpoints move onto the profile, whatever its angles; face: columns of "
        "quadrilaterals run along the faces, for ground that rises, stays level and falls (half the error in factors of safety)",
    )
    graded: Graded | None = Field(
        default=None, description='box, and slope with fit = "profile": zones that grow towards the sides; no table: none'
    )
    inner: float | None = quantity(None, unit="m", meaning="ring, required: radius of the hole", gt=0)
    outer: float | None = quantity(None, unit="m", meaning="ring, required: radius of the outer side", gt=0)
    around: int | None = quantity(
        None, meaning="ring, required: zones along the wall of the hole (of the meshed part)", ge=3, le=100_000
    )
    part: Literal["full", "half", "quarter"] = quantity(
        "full", meaning="ring: full, the half y >= 0 (side bottom), or the quarter x, y >= 0 (sides left and bottom)"
    )
    growth: float | None = quantity(
        None,
        meaning="ring: radial size ratio of a zone to its neighbour nearer to the hole; the first zone is about square; "
        "none: all zones about square",
        ge=1,
        le=1.5,
    )
    mixed: Literal["zone", "nodal"] = quantity(
        "zone",
        meaning="volumetric strain of triangles is averaged over their zone, or also at gridpoints over the zones around them "
        "(nodal mixed discretisation: no pressure of alternate signs in plastic flow; docs/theory.md says when)",
    )
    large_strain: bool = quantity(False, meaning="zones follow their gridpoints, in all stages except those of kind equilibrium")

    @model_validator(mode="after")
    def _keys_of_the_kind(self) -> "Grid":
        needed = NEEDED[self.kind]
        missing = [key for key in needed if getattr(self, key) is None]
        if missing:
            raise ValueError(f'kind = "{self.kind}" needs {", ".join(missing)}')
        known = {"kind", "mixed", "origin", "large_strain", *needed, *ALLOWED[self.kind]}
        fields = type(self).model_fields
        extra = [key for key in fields if key not in known and getattr(self, key) != fields[key].default]
        if extra:
            raise ValueError(f'kind = "{self.kind}" takes no {", ".join(extra)}')
        if self.kind == "slope" and self.graded is not None and self.fit != "profile":
            raise ValueError(f'fit = "{self.fit}" takes no graded: use fit = "profile" with graded, or leave graded out')
        if self.kind == "ring" and not cast(float, self.inner) < cast(float, self.outer):
            raise ValueError(f"the outer radius, {self.outer:g} m, must be larger than the inner one, {self.inner:g} m")
        return self

    @property
    def regular(self) -> bool:
        """Whether all zones have the size `zone_size`."""
        return self.kind != "ring" and self.fit == "diagonals" and self.graded is None
