"""Statistics of the directions of contacts (the fabric) and of the forces they carry.

Contact normals at angles theta (modulo 180 degrees) are described by E(theta) = (1 + a cos 2(theta -
theta_a)) / 2 pi, normal forces by f(theta) = f0 (1 + a_n cos 2(theta - theta_n)): L. Rothenburg, R.J.
Bathurst, Analytical study of induced anisotropy in idealized granular materials, Geotechnique 39 (1989)
601-614.
"""

from math import log, sqrt
from typing import TYPE_CHECKING, NamedTuple, Protocol

import numpy as np

if TYPE_CHECKING:
    from colluvium.results.rank_file import Fields


KINDS = ("soil-soil", "soil-stone", "stone-stone")  # by the number of discs that belong to a stone


class Contacts(Protocol):
    """Contacts of a fabric: all recorded ones, or some of them."""

    @property
    def ends(self) -> np.ndarray:
        """(C, 2) rows of the two discs."""
        ...

    @property
    def normal_force(self) -> np.ndarray:
        """(C,) normal forces [N]."""
        ...


class Fabric(NamedTuple):
    """Fitted parameters; angles in degrees from the x axis, counter-clockwise, in [0, 180)."""

    contacts: int
    a: float
    theta_a: float
    a_interval: tuple[float, float]  # 95 %, contacts taken as independent: the scatter over seeds is additional
    a_noise: float  # value below which 95 % of isotropic samples of this size are
    f0: float  # [N]
    a_n: float
    theta_n: float


def contact_fabric(discs: "Fields", contacts: Contacts, kind: str | None = None) -> Fabric:
    """Fabric of the contacts that `directions` counts, all of them or one of KINDS."""
    return fit_fabric(*directions(discs, contacts, kind))


def directions(discs: "Fields", contacts: Contacts, kind: str | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Angles (C,) [rad] and normal forces (C,) [N] of the compressed contacts between free discs, all or one of KINDS.

    Contacts inside one stone are left out: they describe the discs of the stone, not the contacts of stones and soil. Raises
    ValueError for another kind.
    """
    if kind is not None and kind not in KINDS:
        raise ValueError(f"no kind of contact {kind!r}; there are {', '.join(KINDS)}")
    ends, force = contacts.ends, contacts.normal_force
    used = force > 0.0
    if "control" in discs:
        used &= ~(discs.control[ends] == 1).any(axis=1)
    stone = discs.stone[ends] if "stone" in discs else np.full(ends.shape, -1)
    used &= (stone[:, 0] != stone[:, 1]) | (stone[:, 0] < 0)
    if kind is not None:
        used &= (stone >= 0).sum(axis=1) == KINDS.index(kind)
    branch = discs.xy[ends[used, 1]] - discs.xy[ends[used, 0]]
    return np.arctan2(branch[:, 1], branch[:, 0]), force[used]


def fit_fabric(theta: np.ndarray, force: np.ndarray) -> Fabric:
    """Fits both distributions to the normals' angles theta (C,) [rad] and the normal forces (C,) [N].

    a exp(2i theta_a) = 2 <exp(2i theta)>.
    f0, a_n, theta_n: least squares over all contacts of f0 + A cos 2theta + B sin 2theta.
    Raises ValueError for fewer than 3 contacts.
    """
    count = len(theta)
    if count < 3:
        raise ValueError(f"a fabric needs at least 3 contacts, there are {count}")
    moment = 2.0 * np.mean(np.exp(2j * theta))
    a, direction = abs(moment), np.angle(moment)
    half_width = 1.96 * 2.0 * np.std(np.cos(2.0 * theta - direction), ddof=1) / sqrt(count)
    basis = np.column_stack((np.ones(count), np.cos(2.0 * theta), np.sin(2.0 * theta)))
    f0, A, B = np.linalg.lstsq(basis, force, rcond=None)[0]
    return Fabric(
        contacts=count,
        a=float(a),
        theta_a=_axis(direction),
        a_interval=(float(max(a - half_width, 0.0)), float(a + half_width)),
        a_noise=sqrt(4.0 * log(20.0) / count),
        f0=float(f0),
        a_n=float(np.hypot(A, B) / f0),
        theta_n=_axis(np.arctan2(B, A)),
    )


def _axis(doubled: float) -> float:
    """Direction [deg], in [0, 180), from its doubled angle [rad]."""
    return float(np.degrees(doubled) / 2.0 % 180.0)
