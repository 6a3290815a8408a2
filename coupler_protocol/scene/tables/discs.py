"""The [discs] table of a scene but for its materials, and its walls."""

from contextlib import suppress
from typing import Literal

from pydantic import Field, ValidationError, model_validator

from coupler_protocol.scene.declare import Table, quantity
from coupler_protocol.scene.tables.grading import Grading
from coupler_protocol.scene.tables.grid import Point


class Servo(Table):
    """A wall that moves along its normal until the discs press on it as they should (docs/packings.md).

    The pressure counts on the part of the wall on the discs' side of the walls that cross it. The servo acts from step to step
    by the stiffness of the wall's contacts; a wall that touches nothing moves towards the discs at `fastest`.
    """

    pressure: float = quantity(unit="Pa", meaning="force of the discs along its normal over its length, compression", gt=0)
    fastest: float = quantity(unit="m/s", meaning="its largest speed, in static stages in m a step", gt=0)
    average: float = quantity(1.0, unit="steps", meaning="steps over which the force is averaged", ge=1, le=1e4)


class Moves(Table):
    """How a wall moves: by a velocity or by a servo, or not at all."""

    velocity: Point = quantity((0.0, 0.0), unit="m/s", meaning="its velocity, in static stages in m a step")
    servo: Servo | None = quantity(None, meaning="moves it to a pressure, in place of `velocity`; none: no servo")

    @model_validator(mode="after")
    def _one_way(self):
        if self.servo is not None and self.velocity != (0.0, 0.0):
            raise ValueError("a wall has a velocity or a servo, not both")
        return self

    @property
    def moves(self):
        """Whether it moves at all."""
        return self.servo is not None or self.velocity != (0.0, 0.0)


class Wall(Moves):
    """A segment that holds discs back, in scenes without a grid; its contacts are of the material ring.

    Histories `wall_force_x:NAME`, `wall_force_y:NAME` [N], of the discs on the wall, and `wall_x:NAME`, `wall_y:NAME` [m], its
    middle.
    """

    name: str | None = quantity(None, meaning="its name; none: its number from 1", min_length=1, pattern=r"^[\w .+-]+$")
    ends: tuple[Point, Point] = quantity(unit="m", meaning="where it begins and ends")


class StageWall(Moves):
    """What becomes of a wall from this stage on; without velocity and servo it stops."""

    name: str = quantity(meaning="name or number of the wall", min_length=1)


def names_of_walls(walls):
    """Names of all walls; one without a name has its number from 1."""
    return [wall.name or str(number) for number, wall in enumerate(walls, start=1)]


class Discs(Table):
    """What fills a window."""

    radius: float = quantity(
        unit="m", meaning="mean radius, and about that of control discs; none with a grading: its mean", gt=0
    )
    spread: float = quantity(0.25, meaning="radii are uniform in radius (1 -+ spread)", ge=0, lt=0.8)
    grading: Grading | None = quantity(None, meaning="other sizes, in place of `spread`; no table: uniform radii")
    packing: Literal["relaxed", "inward"] = quantity("relaxed", meaning="spread and relaxed, or placed from the ring inward")
    target: Literal["stress", "porosity"] = quantity(
        "stress",
        meaning="stress: the packing ends at the mean pressure `confinement`, porosity follows; porosity: it ends at exactly "
        "`porosity`, its mean pressure follows and is reported",
    )
    porosity: float = quantity(0.16, meaning="porosity aimed at; packing inward fills what it can", gt=0.02, lt=0.4)
    confinement: float = quantity(100e3, unit="Pa", meaning="mean pressure of the fresh packing", gt=0)
    density_matching: bool = quantity(True, meaning="discs weigh what the zones they replace weighed")
    stiffness: Literal["disc", "contact"] = quantity("disc", meaning="springs belong to discs (in series) or to contacts")
    time_step: float = quantity(0.05, meaning="time = real: share of the discs' stable step, unless the stage says", gt=0, le=1)
    file: str | None = quantity(
        None, meaning="CSV file of the discs, in place of packing: x, y, radius, vx, vy, spin, material, stone (docs/packings.md)"
    )
    body: Literal["clump", "cluster"] = quantity("clump", meaning="with a file: what discs of one stone are, rigid or bonded")
    wall: list[Wall] = Field(default_factory=list, description="without a grid: segments that hold the discs")

    @model_validator(mode="before")
    @classmethod
    def _radius_of_the_grading(cls, data):
        if isinstance(data, dict) and "radius" not in data and data.get("grading") is not None:
            radius = 1.0  # where the grading itself is wrong, that is what will be said
            with suppress(ValidationError):
                radius = Grading.model_validate(data["grading"]).mean_radius
            return {**data, "radius": radius}
        return data
