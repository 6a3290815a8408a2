"""Guard of the ring: the widest gap between control discs, and discs that have left the ring.

Control discs move with the grid. If the grid stretches the rim, gaps open between neighbouring control discs,

    gap = |x_(p+1) - x_p| - r_p - r_(p+1),                                       (1)

and a disc of radius r can be squeezed out through a gap of 2 r. A gap above one smallest radius causes a warning. A disc whose
centre is outside the polygon of the ring's centres by more than its radius is lost: no zone of the grid takes it.

A window that reaches the ground surface has an open ring. There is no gap between its last and its first disc, and its polygon
goes on upwards from both: a disc above the window is not lost, one that has crossed the ground surface beside the window is.
"""

from typing import NamedTuple

import numpy as np
import shapely

from coupler_protocol.compiled.jit import jit
from coupler_protocol.files.kept import Kept
from coupler_protocol.geometry import NOWHERE, spot
from coupler_protocol.scene.local_origin import in_the_scene
from dem_server.model import RADIUS, X, Y

SMALLEST, WIDTH, PLACE_X, PLACE_Y, NOW, WARNED, OPEN = range(7)  # of the ring that `watch_ring` watches


SKY = 100.0  # times the size of an open ring: height above it to which its discs may fly


class Opening(NamedTuple):
    """A gap of a ring: width [m], `place` (2,) [m] between its two control discs, from the ring's origin."""

    width: float
    place: np.ndarray


class RingGuard(Kept):
    """Guard of one window.

    origin (2,) [m]: point of the scene from which positions count; texts and reports have the coordinates of the scene.
    """

    KEPT = ("ring", "_builds")

    def __init__(self, model, state, origin=NOWHERE):
        self.origin = origin
        self.ring = np.zeros(7)
        self.ring[OPEN] = model.surface is not None
        self.ring[SMALLEST] = state.radius[model.ring :].min()
        self._builds = -1
        self.begin()

    def begin(self):
        """Begins a stage."""
        self.ring[WIDTH:OPEN] = 0.0

    @property
    def warned(self):
        """Whether an opening since the last call of `begin` has caused a warning."""
        return bool(self.ring[WARNED])

    @property
    def smallest(self):
        """Smallest radius of a disc [m]."""
        return float(self.ring[SMALLEST])

    @property
    def widest(self):
        """The widest Opening since the last call of `begin`."""
        return Opening(float(self.ring[WIDTH]), self.ring[PLACE_X : PLACE_Y + 1].copy())

    def knows_list(self, state):
        """Whether the present list of pairs has been checked for lost discs; they cannot leave the ring without a new one."""
        return state.builds == self._builds

    def check(self, model, state):
        """Measures the ring, and looks for lost discs if the contact list is new; returns a warning the first time, else "".

        Raises ArithmeticError if a disc is lost.
        """
        watch_ring(state.disc, model.ring, self.ring)
        if not self.knows_list(state):
            self.refuse_lost(model, state)
        return self.judge()

    def refuse_lost(self, model, state):
        """Raises ArithmeticError if a disc is lost."""
        self.note_list(state)
        lost = lost_discs(model, state)
        if len(lost):
            raise ArithmeticError(self._loss_as_text(model, state, ring_gaps(model, state), lost))

    def note_list(self, state):
        """Notes that the present list of pairs has been checked for lost discs."""
        self._builds = state.builds

    def judge(self):
        """Returns a warning of the last measurement the first time, else ""."""
        due = bool(self.ring[NOW] > self.ring[SMALLEST]) and not self.warned
        self.ring[WARNED] = self.warned or due
        return (
            f"the ring has opened: a gap of {self.as_text(self.widest)} (r: smallest disc radius; 2 r lets a disc escape)"
            if due
            else ""
        )

    def as_text(self, found):
        """Text with width and place of an Opening."""
        return f"{found.width / self.smallest:.2g} r at {spot(found.place, self.origin)}"

    def _loss_as_text(self, model, state, gaps, lost):
        disc = int(lost[0])
        where, radius = spot(state.x[disc], self.origin), state.radius[disc]
        near = int(np.hypot(*(state.x[: model.ring] - state.x[disc]).T).argmin())
        if self.ring[OPEN] and state.x[disc, Y] > state.x[near, Y] and near in (0, model.ring - 1):
            return (
                f"disc {disc} (radius {radius:.4g} m) has crossed the ground surface beside the window, at {where}: nothing "
                "carries it there. Use a wider window, or end the stage before"
            )
        beside = max(gaps[near - 1], gaps[near])
        return (
            f"{len(lost)} disc{'s have' if len(lost) > 1 else ' has'} left the ring: disc {disc} (radius {radius:.4g} m) is at "
            f"{where}, beyond control disc {near}, beside which the ring is open by {max(beside, 0.0):.3g} m; "
            f"its widest gap is {self.as_text(opening(model, state, gaps, int(gaps.argmax())))}"
        )

    def report(self, stage):
        """Content of run.json for a stage with a warning; None for others."""
        if not self.warned:
            return None
        return {
            "stage": stage,
            "radii": self.widest.width / self.smallest,
            "place": in_the_scene(self.widest.place, self.origin).tolist(),
        }


def ring_gaps(model, state):
    """Gap (R,) [m] from each control disc to the next, Eq (1); negative if they overlap."""
    return gaps_between(state.disc, model.ring, model.surface is not None)


@jit
def gaps_between(disc, ring, is_open):
    """Kernel of `ring_gaps`; the last disc of an open ring has no gap after it."""
    gaps = np.full(ring, -np.inf)
    for p in range(ring - 1 if is_open else ring):
        q = p + 1 if p + 1 < ring else 0
        distance = np.sqrt((disc[q, X] - disc[p, X]) ** 2 + (disc[q, Y] - disc[p, Y]) ** 2)
        gaps[p] = distance - disc[p, RADIUS] - disc[q, RADIUS]
    return gaps


@jit
def some_outside(disc, ring, is_open):
    """Whether the centre of a free disc is outside the polygon of the first `ring` discs."""
    return outside(around(disc, ring, is_open), disc, ring).any()


@jit
def around(disc, ring, is_open):
    """Polygon (P, 2) outside of which discs are lost: the ring, and above an open one all up to SKY times its size."""
    found = np.empty((ring + 2 if is_open else ring, 2))
    found[:ring] = disc[:ring, X : Y + 1]
    if is_open:
        size, top = 0.0, -np.inf
        for p in range(ring):
            size = max(size, abs(disc[p, X] - disc[0, X]), abs(disc[p, Y] - disc[0, Y]))
            top = max(top, disc[p, Y])
        found[ring, 0], found[ring + 1, 0] = disc[ring - 1, X], disc[0, X]
        found[ring:, 1] = top + SKY * size
    return found


@jit
def watch_ring(disc, ring, found):
    """Measures the widest of the gaps (1) of the first `ring` discs; returns whether a warning is due.

    found (7,): smallest radius of a free disc, width and place of the widest gap so far, widest gap now [m], whether was warned,
    whether the ring is open.
    """
    found[NOW] = -np.inf
    for p in range(ring - 1 if found[OPEN] else ring):
        q = p + 1 if p + 1 < ring else 0
        distance = np.sqrt((disc[q, X] - disc[p, X]) ** 2 + (disc[q, Y] - disc[p, Y]) ** 2)
        gap = distance - disc[p, RADIUS] - disc[q, RADIUS]
        found[NOW] = max(found[NOW], gap)
        if gap > found[WIDTH]:
            found[WIDTH] = gap
            found[PLACE_X], found[PLACE_Y] = 0.5 * (disc[p, X] + disc[q, X]), 0.5 * (disc[p, Y] + disc[q, Y])
    return found[NOW] > found[SMALLEST] and found[WARNED] == 0.0


def opening(model, state, gaps, disc):
    """The Opening between control disc `disc` and the next; gaps (R,): of the ring."""
    following = (disc + 1) % model.ring
    return Opening(float(gaps[disc]), 0.5 * (state.x[disc] + state.x[following]))


def lost_discs(model, state):
    """Numbers of the free discs whose centre is outside the ring by more than their radius, the farthest first."""
    ring = around(state.disc, model.ring, model.surface is not None)
    out = model.ring + np.flatnonzero(outside(ring, state.disc, model.ring))
    if not len(out):
        return out
    beyond = shapely.distance(shapely.LinearRing(ring), shapely.points(state.x[out])) - state.radius[out]
    order = np.argsort(-beyond, kind="stable")
    return out[order[beyond[order] > 0.0]]


@jit
def outside(polygon, disc, first):
    """(n - first,) whether a disc from `first` on has its centre outside a polygon (P,2): a ray to the right crosses it evenly.

    Edges are sorted into horizontal strips, so each disc needs only the edges of one strip.
    """
    P = len(polygon)
    low = high = polygon[0, 1]
    for i in range(1, P):
        low, high = min(low, polygon[i, 1]), max(high, polygon[i, 1])
    strips = P
    scale = strips / (high - low)
    start = np.zeros(strips + 1, dtype=np.int64)
    span = np.empty((P, 2), dtype=np.int64)
    for i in range(P):
        j = i + 1 if i + 1 < P else 0
        a, b = (polygon[i, 1] - low) * scale, (polygon[j, 1] - low) * scale
        span[i, 0], span[i, 1] = min(int(min(a, b)), strips - 1), min(int(max(a, b)), strips - 1)
        for s in range(span[i, 0], span[i, 1] + 1):
            start[s + 1] += 1
    for s in range(strips):
        start[s + 1] += start[s]
    edge, place = np.empty(start[strips], dtype=np.int64), start[:-1].copy()
    for i in range(P):
        for s in range(span[i, 0], span[i, 1] + 1):
            edge[place[s]] = i
            place[s] += 1
    out = np.empty(len(disc) - first, dtype=np.bool_)
    for d in range(first, len(disc)):
        x, y, crossed = disc[d, X], disc[d, Y], False
        if low <= y <= high:
            s = min(int((y - low) * scale), strips - 1)
            for k in range(start[s], start[s + 1]):
                e = edge[k]
                q = e + 1 if e + 1 < P else 0
                y0, y1 = polygon[e, 1], polygon[q, 1]
                if (y0 > y) != (y1 > y):
                    at = polygon[e, 0] + (y - y0) / (y1 - y0) * (polygon[q, 0] - polygon[e, 0])
                    crossed ^= at > x
        out[d - first] = not crossed
    return out
