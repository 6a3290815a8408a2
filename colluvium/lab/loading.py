"""Rate and length of a test, from the estimated stiffness and strength of the sample.

A wall at the rate e' (strain a step) puts the stress E e' on the sample in every step, and the sample's answer crosses about one
row of discs a step. A test is quasi-static if the stress that is put on while the answer crosses all N rows is small:

    e' = QUIET q / (E N)                                                         (1)

with the estimated strength q (colluvium/forecast/packing_moduli.py). It ends at the strain LONG q / E, between LEAST and MOST.
"""

from typing import Any, NamedTuple

from colluvium.forecast.packing_moduli import Estimate, estimate
from colluvium.lab.specimen import Specimen

QUIET = 0.01  # of the strength, put on while the answer crosses one row; over all rows Eq (1)
LONG = 8.0  # elastic strains at failure to the end of a test
LEAST, MOST = 0.01, 0.2  # strain at the end of a test
FEWEST = 15000  # steps of a test, which small samples would pass faster by Eq (1)
ELASTIC = 5000  # of an oedometer, in which nothing fails
PRESS = 2.0  # estimated axial strain of an oedometer, in those of its confining stress
SEAT = 0.02  # pressure of the plates on a Brazilian disc before the test, in the estimated tensile strength
PACKED = 4e-4  # least confinement of a packing over its estimated K2: stiffer ones often miss it, and all have one geometry
STIFFEST = 5e-5  # confinement over contact stiffness below which packings hardly come to rest
RELEASED = 0.1  # confinement of the packing of a Brazilian disc, in its estimated tensile strength


class Loading(NamedTuple):
    """Loading of a test: `confinement` of the packing and `pressure` of the press [Pa], `strain` at the end, `rate` a step."""

    confinement: float
    pressure: float
    strain: float
    rate: float

    @property
    def steps(self) -> int:
        """Steps of the test."""
        return max(1, round(self.strain / self.rate))


def loading(kind: str, scene: Any, body: Specimen, pressure: float, content: float, factor: float = 1.0) -> Loading:
    """Loading of a test at `pressure` [Pa] with a content of stones, its rate multiplied by `factor`."""
    lab, found = scene.lab, estimate(scene.discs, content)
    rows = body.height / (2.0 * scene.discs.radius)
    confinement, seat, load, modulus = _stresses(kind, found, pressure)
    longest = load / modulus if kind == "oedometer" else min(max(LONG * load / modulus, LEAST), MOST)
    strain = lab.strain or longest
    rate = lab.rate or min(QUIET * load / (modulus * rows), strain / (FEWEST if kind != "oedometer" else ELASTIC))
    return Loading(confinement, seat, strain, rate * factor)


def _stresses(kind: str, found: Estimate, pressure: float) -> tuple[float, float, float, float]:
    """Confinement of the packing, pressure of the walls, stress that the test puts on, and modulus against it [Pa]."""
    packed = max(pressure, PACKED * found.bulk)
    if kind == "oedometer":
        return packed, pressure, PRESS * pressure, found.constrained
    if kind == "brazilian":
        tension = max(found.tension, 1e-6 * found.bulk)
        return max(RELEASED * tension, STIFFEST * found.bulk), SEAT * tension, tension, found.young_plane
    return packed, pressure, found.strength(pressure), found.young_plane
