"""Tables for the sides of the grid and for the initial stress of the ground."""

from typing import Annotated, Any, Literal

from pydantic import AfterValidator, model_validator

from coupler_protocol.scene.declare import Table, quantity
from coupler_protocol.scene.names import Hash, Name, hash_meaning


def _spanning(value: tuple[float, float]) -> tuple[float, float]:
    if not value[0] < value[1]:
        raise ValueError("a range is [first, last] with first < last")
    return value


Range = Annotated[tuple[float, float], AfterValidator(_spanning)]
Components = Literal["x", "y", "xy"]
MOTIONS, FORCES = ("fix", "free", "velocity", "quiet", "shaking"), ("pressure", "shear", "stress")


def waits_for_rest() -> Any:
    """The key `ratio` beside `over` of a load."""
    return quantity(
        None,
        meaning="unbalanced force ratio at which each part of the ramp waits for rest; 0: the ramp does not wait "
        "(none: 3e-4, or until.ratio if larger, where a static stage ends by a ratio and the ground can yield; else 0)",
        ge=0,
        lt=1,
    )


class Velocity(Table):
    """Velocity of a side, in metres a step, in stages with time = real in metres a second; an omitted component is free."""

    x: float | None = quantity(None, unit="m/step, m/s", meaning="to the right")
    y: float | None = quantity(None, unit="m/step, m/s", meaning="upwards")

    @model_validator(mode="after")
    def _not_empty(self) -> "Velocity":
        if self.x is None and self.y is None:
            raise ValueError("give x, y, or both")
        return self


class Shaking(Table):
    """Motion of a side over seconds, from a CSV file with the columns time [s], x and y [m/s], for a stage in real time.

    The motion begins with the stage of this table and ends with the file or with that stage; between the rows of the file it
    is linear. `compliant`: the ground continues below the side. The motion is that of the wave that arrives from there, half of
    the motion of a free surface of the same ground. The side is also quiet, so waves from above leave. `rigid`: the side has
    this velocity and reflects; later it is fixed.
    """

    file: str = quantity(meaning="CSV file; its path counts from the folder of the scene", min_length=1)
    file_hash: Hash | None = quantity(None, meaning=hash_meaning("file"))
    base: Literal["compliant", "rigid"] = quantity(meaning="whether waves from above leave through the side, or are reflected")
    x: float | None = quantity(None, meaning="factor on the column x (none: no motion to the right from the file)")
    y: float | None = quantity(None, meaning="factor on the column y (none: no motion upwards from the file)")

    @model_validator(mode="after")
    def _not_empty(self) -> "Shaking":
        if self.x is None and self.y is None:
            raise ValueError("give x, y, or both: factors on the columns of the file, such as x = 1.0")
        return self

    @property
    def factors(self) -> dict[str, float]:
        """Factors {column: factor} of the columns that are used."""
        return {name: value for name, value in (("x", self.x), ("y", self.y)) if value is not None}


class Traction(Table):
    """A stress whose traction (stress times outward normal) acts on a side, as from the ground beyond it."""

    xx: float = quantity(0.0, unit="Pa", meaning="horizontal normal stress, tension positive")
    yy: float = quantity(0.0, unit="Pa", meaning="vertical normal stress, tension positive")
    xy: float = quantity(0.0, unit="Pa", meaning="shear stress")


class Boundary(Table):
    """Condition on a side of the grid, or on a range of it: fixed, moved or loaded.

    A table prescribes the motion of gridpoints (fix, free, velocity, quiet, shaking) or their load (pressure and shear, or
    stress). It acts from the first stage on, in `[[stage.boundary]]` from that stage on, until a later table sets the same
    gridpoints. Of several tables for one component of a gridpoint's motion, the last one counts. Loads on the same side and
    range replace each other, loads on different ranges add up; loads keep the direction that they have at the start of their
    stage. If a table fixes or moves a component, the sum of the forces on the ground is recorded as histories
    `reaction_x:NAME` and `reaction_y:NAME` [N]; a gridpoint that two tables hold counts in both.
    """

    on: Literal["left", "right", "bottom", "top", "face", "inner", "outer"] = quantity(
        meaning="side of the grid; top: level ground, face: inclined or vertical ground; a ring has inner, outer, left, bottom"
    )
    name: Name | None = quantity(None, meaning="name in the histories; none: name of the side")
    x: Range | None = quantity(None, unit="m", place="x", meaning="only this range of the side; loads end exactly there")
    y: Range | None = quantity(None, unit="m", place="y", meaning="only this range of the side; loads end exactly there")
    fix: Components | None = quantity(None, meaning="components of velocity that stay zero")
    free: Components | None = quantity(None, meaning="components that an earlier table fixed or moved and that become free again")
    velocity: Velocity | None = quantity(None, meaning="components of velocity that are prescribed")
    quiet: Literal[True] | None = quantity(
        None, meaning="time = real: dashpots absorb arriving waves; the reactions at the start of the stage remain"
    )
    shaking: Shaking | None = quantity(None, meaning="time = real: motion from a CSV file, such as an earthquake")
    pressure: float | None = quantity(None, unit="Pa", meaning="normal to the side, positive in compression")
    shear: float | None = quantity(
        None, unit="Pa", meaning="along the side, positive with the ground on the left (on top: to the left)"
    )
    stress: Traction | None = quantity(None, meaning="traction of this stress on the side")
    over: int | None = quantity(
        None,
        unit="steps",
        meaning="steps of the ramp from the previous velocity or load to this one (none: 500 for a load that waits for rest in a "
        "[[stage.boundary]] of a later stage than the first, else 1)",
        ge=1,
    )
    ratio: float | None = waits_for_rest()

    @model_validator(mode="after")
    def _one_thing(self) -> "Boundary":
        given = [key for key in (*MOTIONS, *FORCES) if getattr(self, key) is not None]
        if len(given) != 1 and given != ["pressure", "shear"]:
            said = f"not {' and '.join(given)}" if given else "it says nothing"
            raise ValueError(f"give one of fix, free, velocity, quiet, shaking, stress, or pressure and shear: {said}")
        if self.ratio is not None and not self.loads:
            raise ValueError(f"ratio is for loads that wait for rest, not for {given[0]}: remove it")
        return self

    @property
    def loads(self) -> bool:
        """Whether this is a load, not a motion."""
        return not any(getattr(self, key) is not None for key in MOTIONS)

    @property
    def is_quiet(self) -> bool:
        """Whether dashpots absorb the waves that arrive at the side."""
        return self.quiet is not None or (self.shaking is not None and self.shaking.base == "compliant")

    @property
    def place(self) -> str:
        """Text of side and range: loads of the same place replace each other."""
        return " ".join([self.on, *(f"{axis} {span[0]!r} {span[1]!r}" for axis in "xy" if (span := getattr(self, axis)))])

    @property
    def summary(self) -> str:
        """Text of the condition and its place."""
        return f"{' and '.join(key for key in (*MOTIONS, *FORCES) if getattr(self, key) is not None)} on {self.place}"

    @property
    def label(self) -> str:
        """Name in the histories."""
        return self.name or self.on


class StressGradient(Table):
    """Change of stress with depth."""

    xx: float = quantity(0.0, unit="Pa/m", meaning="horizontal, negative if compression grows downwards")
    yy: float = quantity(0.0, unit="Pa/m", meaning="vertical, - density times gravity under level ground")
    zz: float = quantity(0.0, unit="Pa/m", meaning="out of the plane")
    xy: float = quantity(0.0, unit="Pa/m", meaning="shear")


class InitialStress(Table):
    """Stress of the ground before the first stage: uniform, with a gradient, or from the weight of the ground above.

    No table: none. Stress beyond the strength is reduced to the strength at once.
    """

    xx: float = quantity(0.0, unit="Pa", meaning="horizontal stress at `level`, tension positive")
    yy: float = quantity(0.0, unit="Pa", meaning="vertical stress at `level`")
    zz: float = quantity(0.0, unit="Pa", meaning="stress out of the plane at `level`")
    xy: float = quantity(0.0, unit="Pa", meaning="shear stress at `level`")
    level: float = quantity(0.0, unit="m", place="y", meaning="height y at which xx, yy, zz, xy hold")
    gradient: StressGradient | None = quantity(None, meaning="change per metre of depth below `level`")
    k0: float | None = quantity(
        None,
        meaning="the weight of the ground above, under the gravity of the first stage, is added to yy, k0 times it to xx and zz",
        ge=0,
    )

    @model_validator(mode="after")
    def _says_something(self) -> "InitialStress":
        if self.k0 is not None and self.gradient is not None:
            raise ValueError("give gradient or k0, not both")
        if self.k0 is None and self.gradient is None and not any((self.xx, self.yy, self.zz, self.xy)):
            raise ValueError("give stresses, a gradient, or k0")
        return self
