"""Model (built once, constant) and State (all that changes; a checkpoint is exactly State) of the discs.

The numbers of discs are constant: the R control discs of the ring first, in the order of the closed
counter-clockwise chain, then the free discs, sorted in space. One list contains all near pairs, and arrays of
the same length contain the histories of the contacts: pair p is of the discs first[p] < second[p]
(dem_server/step/neighbours.py gives the order).
"""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from coupler_protocol.interface.ring import inner_share
from dem_server.effects import RING, SOIL, Law, histories, law_from
from dem_server.effects.parameter_table import parameters_of

X, Y, VX, VY, SPIN, RADIUS, MASS, INERTIA = range(8)  # columns of State.disc
ANGLE = 5  # of Clumps.motion, whose other columns are those of a disc
FX, FY, MOMENT = range(3)  # columns of State.load (a fourth keeps rows aligned)
BUILDS, TENSION_BREAKS, SHEAR_BREAKS, CAPS = range(4)  # places in State.counters


@dataclass(frozen=True)
class Model:
    """Constant properties of the discs.

    ring: number R of control discs; material (n,) number of each disc's material; density (n,) [kg/m3];
    smallest_radius [m]: sets skin and velocity cap; real_time: None in static mode, in real time the fraction
    of the stable time step that is taken. surface (S, 2) [m]: of a window that reaches the ground surface, the points of the
    surface between its last and first control disc when it was filled; None for a closed ring.
    """

    law: Law
    ring: int
    material: np.ndarray
    density: np.ndarray
    smallest_radius: float
    real_time: float | None = None
    surface: np.ndarray | None = None

    @cached_property
    def parameters(self):
        """The law as kernels take it (Parameters)."""
        return parameters_of(self.law)

    @property
    def in_real_time(self):
        """Whether steps are in seconds; else the mode is static and the step is 1."""
        return self.real_time is not None

    @property
    def count(self):
        """Number of discs n, the ring included."""
        return len(self.material)

    @property
    def materials(self):
        """Number of materials; kinds of pairs are numbered a * materials + b."""
        return round(len(self.law.spring.normal) ** 0.5)


class Clumps(NamedTuple):
    """Rigid bodies of the State.

    motion (c, 8): x, y, vx, vy, spin, angle, mass, inertia. The other fields are constant: body (n,) number of
    each disc's clump or -1; start (c+1,), member (m,): discs of clump c are member[start[c]:start[c+1]]; offset
    (m, 2) [m]; reach (c,) largest offset [m]; gyration (c,) squared radius of gyration [m2].
    """

    motion: np.ndarray
    body: np.ndarray
    start: np.ndarray
    member: np.ndarray
    offset: np.ndarray
    reach: np.ndarray
    gyration: np.ndarray


class Servo(NamedTuple):
    """Servos of all W walls of a State.

    pressure (W,) [Pa], 0: no servo acts now; fastest (W,) [m/s]; average (W,): N; inward (W, 2): unit normals to the discs;
    drift (W,): V0 [m/s]. From the contacts: force (W,), averaged [N]; stiffness [N/m], dashpot [N s/m] (W,), of the last pass;
    length (W,): L of the last step [m].
    """

    pressure: np.ndarray
    fastest: np.ndarray
    average: np.ndarray
    inward: np.ndarray
    force: np.ndarray
    drift: np.ndarray
    stiffness: np.ndarray
    dashpot: np.ndarray
    length: np.ndarray


class Walls(NamedTuple):
    """W walls of the State: `ends` (W, 4) x0, y0, x1, y1 [m], `velocity` (W, 2), `force` (W, 2) of the discs on each [N].

    Histories (n, W): `normal`, `shear` [N], `rolled` [N m] (None without rolling resistance). summed_at (W, 4): `ends` when the
    masses were last set; servo: None where no wall has one.
    """

    ends: np.ndarray
    velocity: np.ndarray
    force: np.ndarray
    normal: np.ndarray
    shear: np.ndarray
    rolled: np.ndarray | None
    summed_at: np.ndarray
    servo: Servo | None = None


class Listed(NamedTuple):
    """The list of pairs as an argument of kernels: fields of State."""

    first: np.ndarray
    second: np.ndarray
    parts: np.ndarray
    kind: np.ndarray


@dataclass(kw_only=True)
class State(histories.OfPairs):
    """Everything that changes.

    Static mode: the step dt is 1, so velocities are displacements [m] and spins are turns [rad]. In real time
    dt (of the last step) and next_dt are in seconds, and masses and inertia are the real ones.
    disc (n, 8): x, y, vx, vy, spin, radius, mass, inertia in one record of 64 bytes a disc; load (n, 4):
    contact forces [N] and moment [N m]; weight (n,) mass that gravity acts on [kg/m], for control discs the
    share inside the ring; origin (n, 2): positions at zero displacement; angle (n,) [rad]. The list (m,): first and second
    disc, kind of pair, and the histories of pairs that effects declare (effects/histories.py). parts (P, 2): runs of the
    list in the order in which they are summed. listed_at (n, 2): positions of the discs when the list was made.
    counters: list builds, bonds broken in tension, in shear, capped velocities. stone (n,): number of the
    stone each disc belongs to, -1 for soil; clumps: the stones as rigid bodies; walls;
    breaks (k, 9): breaks of bonds that wait for the next look (step/breaks.py), None where there are none.
    """

    disc: np.ndarray
    load: np.ndarray
    weight: np.ndarray
    origin: np.ndarray
    angle: np.ndarray
    listed_at: np.ndarray
    first: np.ndarray
    second: np.ndarray
    parts: np.ndarray
    kind: np.ndarray
    counters: np.ndarray
    stone: np.ndarray | None = None
    clumps: Clumps | None = None
    walls: Walls | None = None
    breaks: np.ndarray | None = None
    dt: float = 1.0
    next_dt: float = 1.0

    listed = property(lambda self: Listed(self.first, self.second, self.parts, self.kind), doc="the list of pairs")
    x = property(lambda self: self.disc[:, X : Y + 1], doc="positions (n, 2) [m], a view")
    v = property(lambda self: self.disc[:, VX : VY + 1], doc="velocities (n, 2) [m/step or m/s], a view")
    spin = property(lambda self: self.disc[:, SPIN], doc="spins (n,) [rad/step or rad/s], a view")
    radius = property(lambda self: self.disc[:, RADIUS], doc="radii (n,) [m], a view")
    mass = property(lambda self: self.disc[:, MASS], doc="masses of the motion (n,), a view")
    inertia = property(lambda self: self.disc[:, INERTIA], doc="inertia of the motion (n,), a view")
    force = property(lambda self: self.load[:, : FY + 1], doc="contact forces (n, 2) [N], a view")
    moment = property(lambda self: self.load[:, MOMENT], doc="contact moments (n,) [N m], a view")
    displacement = property(lambda self: self.x - self.origin, doc="displacements since `origin` (n, 2) [m]")
    builds = property(lambda self: int(self.counters[BUILDS]), doc="lists built so far")
    broken_tension = property(lambda self: int(self.counters[TENSION_BREAKS]), doc="bonds broken in tension so far")
    broken_shear = property(lambda self: int(self.counters[SHEAR_BREAKS]), doc="bonds broken in shear so far")
    capped = property(lambda self: int(self.counters[CAPS]), doc="velocities capped so far")


def outline(model, state):
    """Corners (P, 2) of the window [m]: its control discs, and the points of the ground surface where it reaches that."""
    ring = state.x[: model.ring].copy()
    return ring if model.surface is None else np.concatenate([ring, model.surface])


def build_model(ring_xy, ring_radius, packing, discs, ring=None, insitu=True, surface=None):
    """Model and State of a packing inside its ring.

    ring_xy (R, 2), ring_radius (R,): control discs [m]; packing: free discs, `.xy` (n-R, 2), `.radius`
    (n-R,); discs: the scene's table; ring: its `ring` table or None (ring contacts take the properties of
    the touching disc); insitu: whether contacts get a reference gap, which virtual strain needs; surface: as in Model.
    """
    R, free = len(ring_xy), len(packing.xy)
    material = np.repeat(np.array([RING, SOIL], dtype=np.int32), (R, free))
    density = np.full(R + free, discs.soil.density)
    radius = np.concatenate([ring_radius, packing.radius])
    model = Model(law_from(discs, ring), R, material, density, float(radius.min()), surface=surface)
    return model, new_state(model, np.concatenate([ring_xy, packing.xy]), radius, reference_gap=insitu)


def new_state(model, xy, radius, reference_gap=True):
    """State at rest; the first force pass finds the contacts. `reference_gap` False: gr is always 0."""
    n, law = model.count, model.law
    disc = np.zeros((n, 8))
    disc[:, X : Y + 1] = xy
    disc[:, RADIUS] = radius
    weight = model.density * np.pi * np.asarray(radius) ** 2
    weight[: model.ring] *= inner_share(disc[: model.ring, X : Y + 1], model.surface)
    return State(
        disc=disc,
        load=np.zeros((n, 4)),
        weight=weight,
        origin=disc[:, X : Y + 1].copy(),
        angle=np.zeros(n),
        listed_at=np.full((n, 2), np.inf),
        first=np.zeros(0, dtype=np.uint32),
        second=np.zeros(0, dtype=np.uint32),
        parts=np.zeros((0, 2), dtype=np.uint64),
        kind=np.zeros(0, dtype=np.uint32),
        counters=np.zeros(4, dtype=np.int64),
        **histories.empty(law, reference_gap),
    )
