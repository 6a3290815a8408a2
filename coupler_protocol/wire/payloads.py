"""Layout of the arrays in messages, for both sides: a rim of K nodes, B bins of strain, n zones.

FORCE     Answer, P (K,2) [N], sums (K,) [N/m] of the mass rule, and with the flag STRAIN B rows x, y, shear strain
VELOCITY  Order, velocities (K,2) [m/step or m/s]
FIELD     a row a zone: x, y [m], area [m2], stresses xx, yy, xy [Pa], density [kg/m3]
READY     mass (K,) [kg] of the ring's inner shares
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from coupler_protocol.wire import messages
from coupler_protocol.wire.frames import StepFrame, WireError, pack_array, unpack_array


class ForceFrame(StepFrame):
    """FORCE in one buffer: `force` (K,2), `sums` (K,) and `strain` (B,3) are views into it. talk: a Conversation."""

    def __init__(self, talk: Any, nodes: int, bins: int = 0) -> None:
        super().__init__(messages.FORCE, talk.session, talk.rank, len(messages.Answer._fields), 3 * (nodes + bins))
        self.force = self.values[: 2 * nodes].reshape(-1, 2)
        self.sums = self.values[2 * nodes : 3 * nodes]
        self.strain = self.values[3 * nodes :].reshape(-1, 3)

    @property
    def answer(self) -> messages.Answer:
        """The scalars as an Answer."""
        return messages.Answer(*self.scalars.tolist())


class VelocityFrame(StepFrame):
    """VELOCITY in one buffer: `velocity` (K,2) is a view into it. talk: a Conversation."""

    def __init__(self, talk: Any, nodes: int) -> None:
        super().__init__(messages.VELOCITY, talk.session, talk.rank, len(messages.Order._fields), 2 * nodes)
        self.velocity = self.values.reshape(-1, 2)

    @property
    def order(self) -> messages.Order:
        """The scalars as an Order."""
        return messages.Order(*self.scalars.tolist())


class FieldColumns(NamedTuple):
    """Columns of FIELD by name."""

    x: int = 0
    y: int = 1
    area: int = 2
    xx: int = 3
    yy: int = 4
    xy: int = 5
    density: int = 6


FIELD = FieldColumns()
PLACE, STRESS = slice(FIELD.x, FIELD.y + 1), slice(FIELD.xx, FIELD.xy + 1)  # of FIELD


def field_rows(place: np.ndarray, area: np.ndarray, stress: np.ndarray, density: np.ndarray) -> np.ndarray:
    """Rows (n,7) of FIELD; place (n,2) [m], area (n,) [m2], stress (n,3): xx, yy, xy [Pa], density (n,) [kg/m3]."""
    rows = np.empty((len(area), len(FIELD)))
    rows[:, PLACE], rows[:, FIELD.area], rows[:, STRESS], rows[:, FIELD.density] = place, area, stress, density
    return rows


def field_content(rows: np.ndarray, gravity: float, insitu: bool) -> dict[str, Any]:
    """Content of FIELD with rows (n,7). gravity [m/s2]; insitu: whether the discs are brought to this stress."""
    return {"field": pack_array(rows), "gravity": gravity, "insitu": insitu}


def field_of(content: Mapping[str, Any]) -> np.ndarray:
    """Rows (n,7) of a FIELD; raises WireError for another size, numbers that are not finite, and zones without area or mass."""
    rows = unpack_array(content["field"], len(FIELD))
    if not len(rows) or (rows[:, [FIELD.area, FIELD.density]] <= 0.0).any():
        raise WireError("FIELD has no zones, or some without area or density")
    return rows


def ready_content(inner_mass: np.ndarray, report: Mapping[str, Any]) -> dict[str, Any]:
    """Content of READY. inner_mass (K,) [kg]; report: of the window."""
    return {"inner_mass": pack_array(inner_mass), "report": report}


def inner_mass_of(content: Mapping[str, Any], nodes: int) -> np.ndarray:
    """Masses (K,) of a READY; raises WireError for another size or numbers that are not finite."""
    return unpack_array(content["inner_mass"], rows=nodes)
