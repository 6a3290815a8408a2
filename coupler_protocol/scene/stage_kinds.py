"""Kinds of stages, one row each, for lists, rules and both servers.

fdm_server/procedure/kinds.py has a function of the grid for each kind; a test checks that it contains all kinds of a grid.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple


class Kind(NamedTuple):
    """One kind of stage."""

    name: str
    meaning: str
    grid: bool = True  # in scenes with a grid
    alone: bool = False  # in scenes of discs alone
    computes: bool = True  # takes steps; else it ends by itself and gravity stays
    fills: bool = False  # packs the discs, which exist from its end on
    couples: bool = False  # discs and grid are coupled from its start on
    locates: bool = False  # at its end the grid alone shows the position of the band
    overloads: bool = False  # gravity grows until the slope fails: its frames are searched for failure and states of the band
    before_couple: bool = False  # the grid alone: not after discs are coupled
    window: bool = False  # needs a window, and is allowed once
    needs: str = ""  # kind of a stage that must come before
    drawn: bool = False  # computes in the shape of the scene: never in large strain
    begins_drawn: bool = False  # begins in that shape
    band: bool = False  # may end by the state of the band (strains count from the end of the equilibrium)
    boundaries: bool = False  # boundaries may change
    discard: bool = False  # its result may be discarded
    table: str = ""  # its table; then gravity does not change
    rests: bool = False  # brings ground or discs to rest, unless it says otherwise (rest.py)
    keys: tuple[str, ...] = ()  # keys that only this kind has


KINDS = (
    Kind(
        "equilibrium",
        "the grid alone comes to rest, then displacements are set to zero",
        before_couple=True, drawn=True, begins_drawn=True, boundaries=True, discard=True, rests=True,
    ),
    Kind(
        "locate",
        "the grid alone under other gravity, to find the band; may be discarded",
        locates=True, before_couple=True, band=True, boundaries=True, discard=True,
    ),
    Kind(
        "fill",
        "discs fill the windows",
        alone=True, computes=False, fills=True, before_couple=True, window=True, drawn=True, begins_drawn=True, keys=("insitu",),
    ),
    Kind(
        "couple",
        "discs take over from the windows' zones",
        couples=True, window=True, needs="fill", begins_drawn=True, boundaries=True, rests=True, keys=("handover",),
    ),
    Kind("overload", "gravity changes", overloads=True, band=True, boundaries=True),
    Kind("excavate", "zones are excavated", band=True, boundaries=True, rests=True, table="excavate"),
    Kind("surcharge", "pressure on the ground surface", band=True, boundaries=True, rests=True, table="surcharge"),
    Kind("load", "sides are fixed, moved or loaded differently", boundaries=True, rests=True),
    Kind("discs", "without a grid, the discs alone", grid=False, alone=True, rests=True),
)  # fmt: skip
BY_NAME = {kind.name: kind for kind in KINDS}
NAMES = tuple(BY_NAME)


def named(**wanted: Any) -> tuple[str, ...]:
    """Names of the kinds whose fields have these values, in order; `band=True` gives the kinds that may end by a band."""
    return tuple(kind.name for kind in KINDS if all(getattr(kind, field) == value for field, value in wanted.items()))


def of(stage: Any) -> Kind:
    """The Kind of a stage of a scene."""
    return BY_NAME[stage.kind]


def number_of(stages: Sequence[Any], **wanted: Any) -> int | None:
    """Number of the first of `stages` whose kind has these values (couples=True), or None."""
    kinds = named(**wanted)
    return next((i for i, stage in enumerate(stages) if stage.kind in kinds), None)


def coupled(stages: Sequence[Any]) -> Sequence[Any]:
    """The stages in which discs and grid are coupled."""
    first = number_of(stages, couples=True)
    return [] if first is None else stages[first:]
