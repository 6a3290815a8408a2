"""The list of cracks of a rank: every break of a bond, with its time, place, mode and materials."""

from typing import NamedTuple

import numpy as np

MODES = {2: "tension", 3: "shear"}  # as bond_state
BONDS = {0: "contact bond", 1: "parallel bond"}
MATERIALS = {0: "ring", 1: "soil", 2: "stone"}


class Cracks(NamedTuple):
    """Breaks of bonds (k,) in the order of their steps; columns as in coupler_protocol.files.quantities.CRACKS.

    step, time: of the first look after the break (point of the histories, frame); place, normal (k, 2): point of contact [m],
    unit vector normal to the crack; size [m]: diameter of the smaller disc; disc_a, disc_b: ids of the discs; material_a,
    material_b: keys of MATERIALS; mode: of MODES; bond: of BONDS.
    """

    step: np.ndarray
    time: np.ndarray
    place: np.ndarray
    normal: np.ndarray
    size: np.ndarray
    disc_a: np.ndarray
    disc_b: np.ndarray
    material_a: np.ndarray
    material_b: np.ndarray
    mode: np.ndarray
    bond: np.ndarray

    def where(self, chosen: np.ndarray) -> "Cracks":
        """The rows of some breaks, chosen (k,) truth values or numbers."""
        return Cracks(*(column[chosen] for column in self))

    @property
    def in_tension(self) -> np.ndarray:
        """Whether each bond broke in tension (k,); else in shear."""
        return np.asarray(self.mode == 2)

    @property
    def segments(self) -> np.ndarray:
        """Both ends of each crack (k, 2, 2) [m], a line of the length `size` through its place."""
        along = 0.5 * self.size[:, None] * np.column_stack((-self.normal[:, 1], self.normal[:, 0]))
        return np.stack((self.place - along, self.place + along), axis=1)


NONE = Cracks(
    np.zeros(0, np.int64), np.zeros(0), np.zeros((0, 2)), np.zeros((0, 2)), np.zeros(0), *(np.zeros(0, np.int64),) * 2,
    *(np.zeros(0, np.int32),) * 4,
)  # fmt: skip
