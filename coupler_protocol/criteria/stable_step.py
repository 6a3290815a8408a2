"""Longest stable step: the highest frequency of a linearised step, bounded by sums or computed exactly.

Leap-frog is stable if omega^2 dt^2 <= 4 for the largest omega^2 = u.K u / u.M u. Local and combined damping apply to a body
that slows down up to 1 + alpha times its unbalanced force, as if it had a mass M / (1 + alpha):

    dt <= 2 / (omega sqrt(1 + alpha)).                                                   (1)

A spring c of stiffness k_c between two sides lengthens by the sum over their blocks of b_cI . u_I; a block is the translation of
a node or body (its x and y) or the rotation of a body. With shares theta_cI that sum to 1, by the Cauchy-Schwarz inequality

    k_c (sum_I b_cI . u_I)^2 <= k_c sum_I (b_cI . u_I)^2 / theta_cI,                      (2)

so that u.K u <= sum_I u_I . A_I u_I with A_I = sum_c k_c b_cI b_cI^T / theta_cI, and omega^2 is at most the largest eigenvalue of
any A_I over the mass of block I. This is Gershgorin's theorem for blocks, spring by spring. Here each side of a spring has half
of the shares: equal shares for translation and rotation of a body if both lengthen the spring, shares in proportion to |b_cI|
for nodes.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

Limit = dict[str, Any]  # of run.json: share, dt, what, at


class Springs(NamedTuple):
    """Linear springs between K nodes (x, y each) and b bodies (x, y, rotation each).

    first, second (s, 2 K + 3 b), sparse: how unit motions of either side lengthen each spring; stiffness (s,) [N/m] (of springs
    against turning: lengthening in rad, stiffness in N m); nodes: K.
    """

    first: Any  # scipy.sparse.csr_array
    second: Any
    stiffness: NDArray[np.float64]
    nodes: int


class Sums(NamedTuple):
    """Largest eigenvalues of A_I of Eq (2): of nodes (K,) and bodies (b,) [N/m], of their rotation (b,) [N m]."""

    nodes: NDArray[np.float64]
    bodies: NDArray[np.float64]
    rotations: NDArray[np.float64]


def spring_sums(springs: Springs) -> Sums:
    """Sums of Eq (2) for all blocks, from Springs."""
    first, second = (_side_sums(scipy.sparse.csc_array(B), springs) for B in (springs.first, springs.second))
    xx, yy, xy = first + second
    largest = 0.5 * (xx + yy) + np.hypot(0.5 * (xx - yy), xy)
    nodes, count = springs.nodes, (len(largest) - springs.nodes) // 2
    return Sums(largest[:nodes], largest[nodes : nodes + count], largest[nodes + count :])


def _side_sums(B: Any, springs: Springs) -> np.ndarray:
    """xx, yy, xy of A_I (3, blocks) of one side: nodes, bodies, rotations."""
    split, twice = 2 * springs.nodes, 2.0 * springs.stiffness
    x, y = B[:, 0:split:2], B[:, 1:split:2]
    size = (x * x + y * y).sqrt().tocsr()
    over = size.copy()
    over.data = np.divide(1.0, size.data, out=np.zeros_like(size.data), where=size.data > 0.0)
    nodes = [(over * a * b).T @ (twice * size.sum(axis=1)) for a, b in ((x, x), (y, y), (x, y))]
    x, y, turn = B[:, split::3], B[:, split + 1 :: 3], B[:, split + 2 :: 3]
    blocks = ((x * x + y * y).sum(axis=1) > 0.0) * 1.0 + ((turn * turn).sum(axis=1) > 0.0)
    bodies = [(a * b).T @ (twice * blocks) for a, b in ((x, x), (y, y), (x, y))]
    rotations = (turn * turn).T @ (twice * blocks)
    still = np.zeros_like(rotations)
    return np.array([np.concatenate(part) for part in zip(nodes, bodies, (rotations, still, still), strict=True)])


def stiffness_matrix(springs: Springs) -> Any:
    """K (2 K + 3 b, 2 K + 3 b), sparse, of the springs."""
    stretch = springs.first + springs.second
    return stretch.T @ scipy.sparse.diags_array(springs.stiffness) @ stretch


def highest(K: Any, mass: np.ndarray) -> tuple[float, np.ndarray]:
    """Largest omega^2 of a sparse symmetric K with masses (d,), by Lanczos, and its mode (d,): kinetic energy 1/2 at omega 1.

    Infinite masses hold a component.
    """
    from scipy.sparse.linalg import eigsh

    scale = mass**-0.5
    scaled = scipy.sparse.diags_array(scale) @ K @ scipy.sparse.diags_array(scale)
    if len(mass) < 3:
        values, vectors = np.linalg.eigh(scaled.toarray())
    else:
        start = np.random.default_rng(0).standard_normal(len(mass)) * (scale > 0.0)  # the same result in every run
        values, vectors = eigsh(scaled, k=1, which="LA", v0=start, tol=1e-9, ncv=min(len(mass), 40))
    return float(values[-1]), scale * vectors[:, -1]


def step(omega2: float, alpha: float = 0.0) -> float:
    """Eq (1): longest stable step for omega^2; without any stiffness there is no limit."""
    return float(2.0 / np.sqrt(omega2 * (1.0 + alpha))) if omega2 > 0.0 else np.inf


def limit(omega2: float, alpha: float, dt: float | None, what: str, xy: Sequence[float] | np.ndarray) -> Limit:
    """Eq (1) for run.json: longest stable step over the step in use, `dt` [s] (None: static mode); `what` at `xy` [m] sets it."""
    longest = step(omega2, alpha)
    return {"share": longest if dt is None else longest / dt, "dt": dt, "what": what, "at": [float(x) for x in xy]}


def as_text(found: Limit) -> str:
    """Text of a limit: a multiple of the step in use, in real time also in seconds, and the object that sets it."""
    seconds = "" if found["dt"] is None else f" = {found['share'] * found['dt']:.3g} s"
    return f"{found['share']:.2f}{seconds} (set by {found['what']} at ({found['at'][0]:.2f}, {found['at'][1]:.2f}) m)"
