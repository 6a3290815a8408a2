"""Stress from fabric and forces: anisotropy of normal and tangential forces, and the identity that joins them to the stress.

With the distributions of colluvium/results/fabric.py and that of the tangential forces on the second disc, along (-n_y, n_x),

    E(theta)  = (1 + a cos 2(theta - theta_a)) / 2 pi                                        (1)
    fn(theta) = f0 (1 + a_n cos 2(theta - theta_n))                                          (2)
    ft(theta) = -f0 a_t sin 2(theta - theta_t)                                               (3)

and branches of one length along the normals, the integral of E (fn n + ft t) (x) n gives, with a = a exp(2 i theta_a) and so on,

    (s1 - s2) / (s1 + s2) = |a + a_n + a_t| / (2 + Re(a conj a_n))                           (4)

exactly; with one direction of all, and without the product, it is (a + a_n + a_t) / 2 of the authors below. The left side is
measured from the same contacts with their true branches, between the centroids of both bodies. The difference has three causes:
forces and branches whose lengths depend on each other (discs of several sizes), clumps, whose branches are not along the normals,
and distributions that are not of second order. Intervals are those of coupler_protocol/measures/sampling_error.py.

Source: L. Rothenburg, R.J. Bathurst, Analytical study of induced anisotropy in idealized granular materials, Geotechnique 39
(1989) 601-614; the same, Micromechanical features of granular assemblies with planar elliptical particles, Geotechnique 42 (1992)
79-95.
"""

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from colluvium.results.fabric import Contacts, Fabric, axis_of, counted, directions, fit_fabric, interval_of
from coupler_protocol.measures.sampling_error import spreads

if TYPE_CHECKING:
    from colluvium.results.rank_file import Fields

BINS = 18  # over half a turn, for the goodness of fit


class StressForceFabric(NamedTuple):
    """Fabric, tangential forces and the identity of a frame; angles in degrees in [0, 180), intervals of 95 % as in Fabric.

    fit_a, fit_n, fit_t: share of the variance of the means of BINS bins of direction that Eqs (1) to (3) explain. sine: left side
    of Eq (4), theta: direction of the larger compression; predicted: right side; residual: sine - predicted.
    """

    fabric: Fabric
    a_t: float
    theta_t: float
    a_t_interval: tuple[float, float]
    a_t_noise: float
    theta_t_error: float  # [deg]
    fit_a: float
    fit_n: float
    fit_t: float
    sine: float
    theta: float
    predicted: float

    @property
    def residual(self) -> float:
        """Part of the mobilised sine that Eq (4) does not explain."""
        return self.sine - self.predicted


def stress_force_fabric(discs: "Fields", contacts: Contacts, kind: str | None = None) -> StressForceFabric:
    """Eqs (1) to (4) for the contacts that a fabric counts; raises ValueError for fewer than 3."""
    used = counted(discs, contacts, kind)
    theta, force, bodies = directions(discs, contacts, kind)
    shear = contacts["shear_force"][used] if "shear_force" in contacts else np.zeros(len(theta))  # type: ignore[operator,index]
    centre = discs.centroid if "centroid" in discs else discs.xy
    return fitted(theta, force, shear, bodies, np.diff(centre[contacts.ends[used]], axis=1)[:, 0])


def fitted(
    theta: np.ndarray,
    force: np.ndarray,
    shear: np.ndarray,
    bodies: np.ndarray | None = None,
    branch: np.ndarray | None = None,
) -> StressForceFabric:
    """Fits Eqs (1) to (3) to contacts (C,) with normals at theta [rad], and compares both sides of Eq (4).

    force, shear (C,) [N]: normal and tangential forces; bodies (C, 2, 2): as of `fit_fabric`; branch (C, 2) [m]: None for
    branches of one length along the normals.
    """
    fabric = fit_fabric(theta, force, bodies)
    wave, f0 = np.exp(2j * theta), fabric.f0
    basis = np.column_stack((wave.real, wave.imag))
    P, Q = np.linalg.lstsq(basis, shear, rcond=None)[0]  # ft = P cos 2 theta + Q sin 2 theta
    tangential = complex(-Q, P) / f0
    on_fit = (basis * (shear - basis @ (P, Q))[:, None]) @ np.linalg.pinv(basis.T @ basis)
    on_f0 = _influence_on_f0(wave, force)
    influence = (-on_fit[:, 1] + 1j * on_fit[:, 0] - tangential * on_f0) / f0
    interval, noise, error = interval_of(tangential, spreads([influence], bodies)[0])
    a, a_n = (size * np.exp(2j * np.radians(angle)) for size, angle in ((fabric.a, fabric.theta_a), (fabric.a_n, fabric.theta_n)))
    line = np.column_stack((np.cos(theta), np.sin(theta))) if branch is None else branch
    deviator, mean = _stress(theta, force, shear, line)
    return StressForceFabric(
        fabric=fabric,
        a_t=float(abs(tangential)),
        theta_t=axis_of(float(np.angle(tangential))),
        a_t_interval=interval,
        a_t_noise=noise,
        theta_t_error=error,
        fit_a=_explained_of_density(theta, a),
        fit_n=_explained(theta, force, f0 * (1.0 + (a_n.conjugate() * wave).real)),
        fit_t=_explained(theta, shear, basis @ (P, Q)),
        sine=float(abs(deviator) / mean),
        theta=axis_of(float(np.angle(deviator))),
        predicted=float(abs(a + a_n + tangential) / (2.0 + (a * a_n.conjugate()).real)),
    )


def _influence_on_f0(wave: np.ndarray, force: np.ndarray) -> np.ndarray:
    """Influence (C,) of each contact on the f0 of the least-squares fit of Eq (2)."""
    basis = np.column_stack((np.ones(len(wave)), wave.real, wave.imag))
    rest = force - basis @ np.linalg.lstsq(basis, force, rcond=None)[0]
    return np.asarray(((basis * rest[:, None]) @ np.linalg.pinv(basis.T @ basis))[:, 0])


def _stress(theta: np.ndarray, force: np.ndarray, shear: np.ndarray, line: np.ndarray) -> tuple[complex, float]:
    """Deviator (s_xx - s_yy) / 2 + i s_xy and mean of the stress, compression positive, times the area [N m]."""
    x, y = np.cos(theta), np.sin(theta)
    on_second = np.stack((force * x - shear * y, force * y + shear * x))
    (xx, xy), (yx, yy) = on_second @ line
    return complex(0.5 * (xx - yy), 0.5 * (xy + yx)), float(0.5 * (xx + yy))


def _explained(theta: np.ndarray, values: np.ndarray, fit: np.ndarray) -> float:
    """Share of the variance of the bins' mean values that the bins' mean fit explains; NaN if they do not vary."""
    place, number = _bins(theta)
    mean, expected = (np.bincount(place, column, BINS) / np.maximum(number, 1) for column in (values, fit))
    return _share(mean, expected, number)


def _explained_of_density(theta: np.ndarray, a: complex) -> float:
    """The same for the number of contacts in the bins."""
    _, number = _bins(theta)
    edges = np.arange(BINS + 1) * np.pi / BINS
    integral = edges + 0.5 * (a.conjugate() * np.exp(2j * edges)).imag  # of 1 + a cos 2(theta - theta_a)
    return _share(1.0 * number, len(theta) * np.diff(integral) / np.pi, np.ones(BINS))


def _bins(theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    place = np.floor(theta % np.pi / (np.pi / BINS)).astype(int) % BINS
    return place, np.bincount(place, minlength=BINS)


def _share(mean: np.ndarray, expected: np.ndarray, weight: np.ndarray) -> float:
    varies = weight @ (mean - weight @ mean / weight.sum()) ** 2
    return float(1.0 - weight @ (mean - expected) ** 2 / varies) if varies > 0.0 else float("nan")
