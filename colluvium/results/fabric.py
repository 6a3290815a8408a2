"""Statistics of the directions of contacts (the fabric) and of the forces they carry.

Contact normals at angles theta (modulo 180 degrees) are described by E(theta) = (1 + a cos 2(theta -
theta_a)) / 2 pi, normal forces by f(theta) = f0 (1 + a_n cos 2(theta - theta_n)): L. Rothenburg, R.J.
Bathurst, Analytical study of induced anisotropy in idealized granular materials, Geotechnique 39 (1989)
601-614. Intervals: coupler_protocol/measures/sampling_error.py.
"""

from typing import TYPE_CHECKING, NamedTuple, Protocol

import numpy as np

from coupler_protocol.measures.sampling_error import Spread, spreads

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


class Directions(NamedTuple):
    """Counted contacts: angles theta (C,) [rad], normal forces (C,) [N], centres (C, 2, 2) of the two bodies of each [m]."""

    theta: np.ndarray
    force: np.ndarray
    bodies: np.ndarray


class Fabric(NamedTuple):
    """Fitted parameters; angles in degrees from the x axis, counter-clockwise, in [0, 180).

    Intervals (low, high) and errors (half widths) are of 95 % and say how much another packing of the same kind would differ.
    a_noise, a_n_noise: values that 95 % of isotropic packings of this kind do not exceed. An a at or below it cannot be told from
    an isotropic packing: its interval then begins at 0, and the error of its direction is 90 degrees.
    """

    contacts: int
    a: float
    theta_a: float
    a_interval: tuple[float, float]
    a_noise: float
    f0: float  # [N]
    a_n: float
    theta_n: float
    theta_a_error: float  # [deg]
    a_n_interval: tuple[float, float]
    a_n_noise: float
    theta_n_error: float  # [deg]

    @property
    def contacts_isotropic(self) -> bool:
        """Whether the directions of the contacts cannot be told from isotropic ones."""
        return self.a <= self.a_noise

    @property
    def forces_isotropic(self) -> bool:
        """Whether the forces cannot be told from forces of the same mean in every direction."""
        return self.a_n <= self.a_n_noise


def contact_fabric(discs: "Fields", contacts: Contacts, kind: str | None = None) -> Fabric:
    """Fabric of the contacts that `directions` counts, all of them or one of KINDS."""
    return fit_fabric(*directions(discs, contacts, kind))


def directions(discs: "Fields", contacts: Contacts, kind: str | None = None) -> Directions:
    """The compressed contacts between free discs, all or one of KINDS.

    Contacts inside one stone are left out: they describe the discs of the stone, not the contacts of stones and soil. Raises
    ValueError for another kind.
    """
    used, ends = counted(discs, contacts, kind), contacts.ends
    branch = discs.xy[ends[used, 1]] - discs.xy[ends[used, 0]]
    centres = _body_centres(discs.xy, discs.stone if "stone" in discs else None)
    return Directions(np.arctan2(branch[:, 1], branch[:, 0]), contacts.normal_force[used], centres[ends[used]])


def counted(discs: "Fields", contacts: Contacts, kind: str | None = None) -> np.ndarray:
    """Whether `directions` counts each of the contacts (C,)."""
    if kind is not None and kind not in KINDS:
        raise ValueError(f"no kind of contact {kind!r}; there are {', '.join(KINDS)}")
    ends = contacts.ends
    used = contacts.normal_force > 0.0
    if "control" in discs:
        used &= ~(discs.control[ends] == 1).any(axis=1)
    stone = discs.stone[ends] if "stone" in discs else np.full(ends.shape, -1)
    used &= (stone[:, 0] != stone[:, 1]) | (stone[:, 0] < 0)
    if kind is not None:
        used &= (stone >= 0).sum(axis=1) == KINDS.index(kind)
    return np.asarray(used)


def fit_fabric(theta: np.ndarray, force: np.ndarray, bodies: np.ndarray | None = None) -> Fabric:
    """Fits both distributions to the normals' angles theta (C,) [rad] and the normal forces (C,) [N].

    a exp(2i theta_a) = 2 <exp(2i theta)>.
    f0, a_n, theta_n: least squares over all contacts of f0 + A cos 2theta + B sin 2theta.
    bodies (C, 2, 2): centres of the two bodies of each contact [m]; without them the contacts are taken as independent.
    Raises ValueError for fewer than 3 contacts.
    """
    count = len(theta)
    if count < 3:
        raise ValueError(f"a fabric needs at least 3 contacts, there are {count}")
    wave = np.exp(2j * theta)
    moment = complex(2.0 * np.mean(wave))
    basis = np.column_stack((np.ones(count), wave.real, wave.imag))
    f0, A, B = np.linalg.lstsq(basis, force, rcond=None)[0]
    ratio = complex(A + 1j * B) / f0
    # influence of each contact: of the mean, and of a least-squares fit, (X^T X)^-1 x_c (f_c - X b)
    on_moment = (2.0 * wave - moment) / count
    on_fit = (basis * (force - basis @ (f0, A, B))[:, None]) @ np.linalg.pinv(basis.T @ basis)
    on_ratio = (on_fit[:, 1] + 1j * on_fit[:, 2] - ratio * on_fit[:, 0]) / f0
    of_moment, of_ratio = spreads([on_moment, on_ratio], bodies)
    a_interval, a_noise, theta_a_error = interval_of(moment, of_moment)
    a_n_interval, a_n_noise, theta_n_error = interval_of(ratio, of_ratio)
    return Fabric(
        contacts=count,
        a=float(abs(moment)),
        theta_a=axis_of(np.angle(moment)),
        a_interval=a_interval,
        a_noise=a_noise,
        f0=float(f0),
        a_n=float(abs(ratio)),
        theta_n=axis_of(np.angle(ratio)),
        theta_a_error=theta_a_error,
        a_n_interval=a_n_interval,
        a_n_noise=a_n_noise,
        theta_n_error=theta_n_error,
    )


def interval_of(vector: complex, spread: Spread) -> tuple[tuple[float, float], float, float]:
    """Interval of the absolute value of an estimated vector, its noise, and the error of half its angle [deg]."""
    size, noise = float(abs(vector)), spread.noise()
    along, across = (spread.half_width(float(np.angle(vector)) + turn) for turn in (0.0, np.pi / 2.0))
    if size <= noise:
        return (0.0, size + along), noise, 90.0
    return (max(size - along, 0.0), size + along), noise, float(np.degrees(np.arcsin(min(across / size, 1.0))) / 2.0)


def _body_centres(xy: np.ndarray, stone: np.ndarray | None) -> np.ndarray:
    """Centres (n, 2) of the bodies that discs at xy (n, 2) belong to: the mean of the discs of a stone, or the disc."""
    if stone is None or not (stone >= 0).any():
        return xy
    own = stone >= 0
    number = np.maximum(np.bincount(stone[own]), 1)
    means = np.column_stack([np.bincount(stone[own], part) / number for part in xy[own].T])
    centres = xy.copy()
    centres[own] = means[stone[own]]
    return centres


def axis_of(doubled: float) -> float:
    """Direction [deg], in [0, 180), from its doubled angle [rad]."""
    return float(np.degrees(doubled) / 2.0 % 180.0)
