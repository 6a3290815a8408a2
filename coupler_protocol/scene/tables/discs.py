"""The [discs] table of a scene without its materials, and its walls."""

from collections.abc import Sequence
from contextlib import suppress
from typing import Any, Literal

from pydantic import Field, ValidationError, model_validator

from coupler_protocol.scene.declare import Table, quantity
from coupler_protocol.scene.names import Hash, Name, hash_meaning
from coupler_protocol.scene.tables.grading import Grading
from coupler_protocol.scene.tables.grid import Point


class Servo(Table):
    """A wall that moves along its normal until the discs press on it with the given pressure (docs/packings.md).

    The pressure refers to the length of the wall between the walls that cross it, on the side of the discs. The servo acts in
    every step and uses the stiffness of the wall's contacts; a wall without contacts moves towards the discs at `fastest`.
    Straight pieces end to end with the same servo are one wall.
    """

    pressure: float = quantity(
        unit="Pa", meaning="force of the discs along the normal over the length, compression positive", gt=0
    )
    fastest: float = quantity(unit="m/s", meaning="largest speed; in static stages in m a step", gt=0)
    average: float = quantity(1.0, unit="steps", meaning="steps over which the force is averaged", ge=1, le=1e4)


class Moves(Table):
    """How a wall moves: by a velocity or by a servo, or not at all."""

    velocity: Point = quantity((0.0, 0.0), unit="m/s", meaning="velocity; in static stages in m a step")
    servo: Servo | None = quantity(None, meaning="moves the wall towards a pressure, instead of `velocity`; none: no servo")

    @model_validator(mode="after")
    def _one_way(self) -> "Moves":
        if self.servo is not None and self.velocity != (0.0, 0.0):
            raise ValueError("a wall has a velocity or a servo, not both")
        return self

    @property
    def moves(self) -> bool:
        """Whether the wall moves."""
        return self.servo is not None or self.velocity != (0.0, 0.0)


class Wall(Moves):
    """A segment that confines discs, in scenes without a grid; its contacts have the material ring.

    Walls that meet are one surface.

    Histories: `wall_force_x:NAME`, `wall_force_y:NAME` [N], force of the discs on the wall, and `wall_x:NAME`, `wall_y:NAME`
    [m], its middle.
    """

    name: Name | None = quantity(None, meaning="name; none: its number from 1")
    ends: tuple[Point, Point] = quantity(unit="m", place="xy", meaning="first and last point")


class StageWall(Moves):
    """Motion of a wall from this stage on; without velocity and servo it stops."""

    name: str = quantity(meaning="name or number of the wall", min_length=1)


def names_of_walls(walls: Sequence[Wall]) -> list[str]:
    """Names of all walls; one without a name has its number from 1."""
    return [wall.name or str(number) for number, wall in enumerate(walls, start=1)]


class Discs(Table):
    """Discs that fill a window, or a scene without a grid."""

    radius: float = quantity(
        unit="m", meaning="mean radius, and approximate radius of control discs; may be omitted with a grading (its mean)", gt=0
    )
    spread: float = quantity(0.25, meaning="radii are uniform in radius (1 ± spread)", ge=0, lt=0.8)
    grading: Grading | None = quantity(None, meaning="other sizes, instead of `spread`; no table: uniform radii")
    packing: Literal["relaxed", "inward"] = quantity(
        "relaxed", meaning="discs spread evenly and relaxed, or placed one by one from the ring inward"
    )
    target: Literal["stress", "porosity"] = quantity(
        "stress",
        meaning="stress: the packing ends at the mean pressure `confinement`, porosity follows; porosity: it ends at exactly "
        "`porosity`, its mean pressure follows and is reported",
    )
    porosity: float = quantity(0.16, meaning="target porosity; inward packing fills as much as it can", gt=0.02, lt=0.4)
    confinement: float = quantity(100e3, unit="Pa", meaning="mean pressure of the fresh packing", gt=0)
    density_matching: bool = quantity(True, meaning="discs have the weight of the zones that they replace")
    stiffness: Literal["disc", "contact"] = quantity("disc", meaning="springs belong to discs (in series) or to contacts")
    time_step: float = quantity(
        0.05, meaning="time = real: share of the stable step of the discs, unless the stage gives one", gt=0, le=1
    )
    file: str | None = quantity(
        None, meaning="CSV file of the discs, instead of packing: x, y, radius, vx, vy, spin, material, stone (docs/packings.md)"
    )
    file_hash: Hash | None = quantity(None, meaning=hash_meaning("file"))
    body: Literal["clump", "cluster"] = quantity("clump", meaning="with a file: discs of one stone are rigid or bonded")
    wall: list[Wall] = Field(default_factory=list, description="without a grid: segments that confine the discs")

    @model_validator(mode="before")
    @classmethod
    def _radius_of_the_grading(cls, data: Any) -> Any:
        if isinstance(data, dict) and "radius" not in data and data.get("grading") is not None:
            radius = 1.0  # if the grading is wrong, only the grading is reported
            with suppress(ValidationError):
                radius = Grading.model_validate(data["grading"]).mean_radius
            return {**data, "radius": radius}
        return data
