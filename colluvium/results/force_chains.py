"""Force chains: bodies under more than the mean stress in line with each other.

The stress of a body (a disc or a stone) with solid area V is s = sum f (x) r / V over its contacts, r from its centroid to the
contact, compression positive; s1 is its larger principal stress. A chain has at least three bodies with s1 above the mean over
all bodies with contacts. Two of them are linked if they touch and the line between their centroids is within 45 degrees of the
directions of s1 of both; of several such partners in one direction, the best aligned one counts. Chains that meet are one.

Source: J.F. Peters, M. Muthuswamy, J. Wibowo, A. Tordesillas, Characterization of force chains in granular material, Phys. Rev. E
72 (2005) 041307. Areas: a large body carries more force than a small one under the same stress.
"""

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from colluvium.results.averages import contact_forces
from colluvium.results.fabric import axis_of

if TYPE_CHECKING:
    from colluvium.results.rank_file import Fields

ALIGNED = 45.0  # [deg]
FEWEST = 3  # bodies of a chain


class ForceChains(NamedTuple):
    """Chains of a frame.

    links (L, 2): rows of the two discs whose contact joins bodies of a chain; chain (L,): number of its chain, from 0; chains:
    how many there are; bodies: in chains; share: of the bodies with contacts; longest: bodies of the largest chain; direction
    [deg] in [0, 180): of the links, and how much they agree (0: every direction, 1: one); NaN without chains.
    """

    links: np.ndarray
    chain: np.ndarray
    chains: int
    bodies: int
    share: float
    longest: int
    direction: float
    agreement: float


def force_chains(discs: "Fields", contacts: "Fields") -> ForceChains:
    """Chains of the contacts of a frame; control discs carry contact forces but are in no chain."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    body, centre, area = _bodies(discs)
    ends = contacts.ends
    between = body[ends[:, 0]] != body[ends[:, 1]]
    ends, force = ends[between], contact_forces(discs, contacts)[between]
    pressed = contacts.normal_force[between] > 0.0
    a, b = body[ends].T
    free = np.ones(len(area), dtype=bool)
    if "control" in discs:
        free[body[discs.control == 1]] = False
    major, direction = _principal(discs, centre, area, ends, body, force)
    touched = free & (np.bincount(np.concatenate((a, b)), minlength=len(area)) > 0)
    strong = touched & (major > major[touched].mean()) if touched.any() else touched
    line = centre[b] - centre[a]
    line = line / np.maximum(np.hypot(*line.T), 1e-300)[:, None]
    along_a, along_b = (np.abs((line * direction[one]).sum(axis=1)) for one in (a, b))
    joins = pressed & strong[a] & strong[b] & (np.minimum(along_a, along_b) >= np.cos(np.radians(ALIGNED)))
    joins &= _best(a, line, direction, along_a, joins) | _best(b, -line, direction, along_b, joins)
    graph = coo_array((np.ones(joins.sum()), (a[joins], b[joins])), shape=(len(area), len(area)))
    _, group = connected_components(graph, directed=False)
    size = np.bincount(group)
    kept = joins.copy()
    kept[joins] = size[group[a[joins]]] >= FEWEST
    numbers, chain = np.unique(group[a[kept]], return_inverse=True)
    bodies = int(size[numbers].sum())
    vector = complex(np.mean(np.exp(2j * np.arctan2(line[kept, 1], line[kept, 0])))) if len(chain) else complex(np.nan)
    return ForceChains(
        links=ends[kept],
        chain=chain,
        chains=len(numbers),
        bodies=bodies,
        share=bodies / max(int(touched.sum()), 1),
        longest=int(size[numbers].max(initial=0)),
        direction=axis_of(float(np.angle(vector))),
        agreement=float(abs(vector)),
    )


def _bodies(discs: "Fields") -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Number (n,) of each disc's body, centroids (B, 2) [m] and solid areas (B,) [m2] of the bodies."""
    key = np.arange(len(discs.xy))
    if "stone" in discs:
        key = np.where(discs.stone >= 0, len(key) + discs.stone, key)
    body = np.unique(key, return_inverse=True)[1]
    disc_area = np.pi * discs.radius**2
    area = np.bincount(body, disc_area)
    centre = np.column_stack([np.bincount(body, disc_area * part) / area for part in discs.xy.T])
    return body, centre, area


def _principal(
    discs: "Fields", centre: np.ndarray, area: np.ndarray, ends: np.ndarray, body: np.ndarray, force: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Larger principal stress (B,) [Pa], compression positive, and its direction (B, 2) of every body."""
    xy, radius = discs.xy, discs.radius
    branch = xy[ends[:, 1]] - xy[ends[:, 0]]
    gap = np.hypot(*branch.T) - radius[ends].sum(axis=1)
    lever = (radius[ends[:, 0]] + 0.5 * gap) / np.hypot(*branch.T)
    place = xy[ends[:, 0]] + lever[:, None] * branch
    parts = np.zeros((3, len(area)))
    for column, sign in ((0, 1.0), (1, -1.0)):  # the force on the first disc is -F: -F times an arm towards the second
        own = body[ends[:, column]]
        (fx, fy), (x, y) = (sign * force).T, (place - centre[own]).T
        for row, value in enumerate((fx * x, fy * y, 0.5 * (fx * y + fy * x))):
            parts[row] += np.bincount(own, value, len(area))
    xx, yy, xy_ = parts / area
    half = np.hypot(0.5 * (xx - yy), xy_)
    angle = 0.5 * np.arctan2(xy_, 0.5 * (xx - yy))
    return 0.5 * (xx + yy) + half, np.column_stack((np.cos(angle), np.sin(angle)))


def _best(one: np.ndarray, line: np.ndarray, direction: np.ndarray, along: np.ndarray, joins: np.ndarray) -> np.ndarray:
    """Whether each contact is the best aligned one of body `one` (C,) among those of `joins` on the same side of it."""
    side = (line * direction[one]).sum(axis=1) >= 0.0
    place = np.where(joins, 2 * one + side, -1)
    order = np.lexsort((-along, place))
    first = np.ones(len(order), dtype=bool)
    first[1:] = place[order][1:] != place[order][:-1]
    best = np.zeros(len(order), dtype=bool)
    best[order] = first
    return best & joins
