"""The [[window]] table of a scene: its zones, and its own discs and stones.

A window's table [window.discs] has the keys of [discs], none of them required: those given replace the keys of [discs] in this
window. Classes with effects are made from those of the effects, as for changes of stages (coupler_protocol.scene.tables.changes);
coupler_protocol.scene.of_window applies them.
"""

from pydantic import Field, model_validator

from coupler_protocol.scene.declare import Table, quantity
from coupler_protocol.scene.names import Name
from coupler_protocol.scene.tables.grid import Point, Span
from coupler_protocol.scene.tables.materials import Substance
from coupler_protocol.scene.tables.stones import Stones


class WindowGrain(Table):
    """Material of discs in one window: the keys that differ from `[discs]`; `false` in place of a table leaves it out."""


class WindowPair(Table):
    """Contacts between two materials of discs in one window: effects that differ from those of `[[discs.pair]]`."""

    between: tuple[Substance, Substance] = quantity(meaning="the two materials")


class WindowDiscs(Table):
    """Discs of one window: the keys and tables of `[discs]` that differ in this window.

    `spread` and `grading` replace each other, and a `grading` without `radius` gives the radius too. A material `stone` that
    `[discs]` does not have begins here, with all its required keys.
    """


class Window(Table):
    """Zones that become a hole and are computed by one discrete process.

    They are given by columns and rows, or by a polygon, convex or not, around their centres. At least one zone remains between a
    window and the sides, and other windows. A window may reach the ground surface, in one stretch: its discs are free there.
    Without a grid: the polygon that discs fill.
    """

    name: Name = quantity(meaning="name of the window")
    columns: Span | None = quantity(None, meaning="first and last zone in x, from 0")
    rows: Span | None = quantity(None, meaning="first and last zone in y, from 0")
    polygon: list[Point] | None = quantity(
        None, unit="m", place="xy", meaning="corners of the outline: zones with their centre inside become the hole", min_length=3
    )
    stones: Stones | None = Field(default=None, description="stones of this window, instead of `[stones]`; no table: those")

    @model_validator(mode="after")
    def _in_order(self) -> "Window":
        if any(span is not None and span[0] > span[1] for span in (self.columns, self.rows)):
            raise ValueError("columns and rows are [first, last] with first <= last")
        return self
