"""Detection of blow-up by energy, long before a number overflows.

Yield, slip and damping only dissipate energy. Since a moment with strain energy U0 and kinetic energy K0,

    K <= U0 + K0 + W

with W the work of weights, of applied forces and of the forces that drive prescribed gridpoints. A slope that fails fulfils this
at any speed, also in static mode, with scaled masses on both sides. A step that is too long for a stiff part does not: velocities
grow from step to step without work. Checks are some steps apart, so W is computed by the trapezoidal rule only, and K, of a half
step, can be twice the energy at omega^2 = 2: hence MARGIN. Sudden forces between two checks are included too late: hence K must
also have grown GROWTH times since it exceeded the margin.

With windows this applies to zones and discs together. The work of the discs' forces P on the rim is that of the ring on the
discs, so P is not an external force; a mapping that loses or adds power violates this. K, U0, K0 and the work of weights then
include those of the discs at their last observation, and the stored energy U counts also:

    K <= U0 + K0 + W - U,

or a share FLOOR of U0 + K0 + W, if U is nearly equal to this sum. The limit of growth is lower then (COUPLED_GROWTH), and applies
at the next check: the late forces are included.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from coupler_protocol.compiled.jit import jit
from coupler_protocol.files.kept import Kept
from coupler_protocol.geometry import spot
from coupler_protocol.wire.messages import Answer
from fdm_server.observe.energy import strain_energy
from fdm_server.step.gridpoint_pass import kinetic_energy
from fdm_server.step.present_shape import masses
from fdm_server.step.safety import Unstable

MARGIN, GROWTH, COUPLED_GROWTH, FLOOR = 5.0, 100.0, 25.0, 0.01
GIVEN, MOST, BEFORE, LOOKS, ONSET, NOW, FASTEST, HEIGHT, GRAVITY, FOUND = range(10)  # of Balance.sums
KINETIC, STORED, ABOVE = (Answer._fields.index(name) for name in ("kinetic", "stored", "height"))  # of the discs


class Balance(NamedTuple):
    """The balance of a stage. last (N,2) [m], before (N,2) [N]: displacements and external forces at the last check.

    outer (N,2): scratch memory. sums (10,): U0 + K0 + W [J], its largest value, K at the last check, number of checks, K when it
    exceeded the margin (0: it does not), K now, its fastest gridpoint, height of the discs [kg m] and gravity [m/s2] at the last
    check (NaN: none), and whether `EnergyWatch.judge` has to look.
    """

    last: NDArray[np.float64]
    before: NDArray[np.float64]
    outer: NDArray[np.float64]
    sums: NDArray[np.float64]


@jit
def external_force(n, k, force, applied, weight_mass, fixed, gravity):
    """Component k of the external force on gridpoint n [N]; on a held or driven component the reaction, without inertia."""
    if fixed[n, k]:
        return -force[n, k]
    return applied[n, k] - (gravity * weight_mass[n] if k == 1 else 0.0)


@jit
def work_kernel(force, applied, weight_mass, mass, added_mass, fixed, gravity, velocity, displacement, nodes, push, balance):
    """Work [J] since the last check, kinetic energy [J] of free components, and the gridpoint with the largest part of it.

    push (K,2) [N]: forces of the discs on the gridpoints `nodes` (K,), which are no external forces.
    """
    last, before, outer, _ = balance
    for n in range(applied.shape[0]):  # by number: what numba compiles for two arrays takes seconds
        outer[n, 0], outer[n, 1] = applied[n, 0], applied[n, 1]
    for i in range(len(nodes)):
        outer[nodes[i], 0] -= push[i, 0]
        outer[nodes[i], 1] -= push[i, 1]
    work = kinetic = most = 0.0
    fastest = 0
    for n in range(velocity.shape[0]):
        own = 0.0
        for k in range(2):
            v = velocity[n, k]
            external = external_force(n, k, force, outer, weight_mass, fixed, gravity)
            work += 0.5 * (before[n, k] + external) * (displacement[n, k] - last[n, k])
            before[n, k] = external
            last[n, k] = displacement[n, k]
            own += 0.0 if fixed[n, k] else 0.5 * (mass[n] + added_mass[n]) * v * v
        kinetic += own
        if own > most:
            most, fastest = own, n
    return work, kinetic, fastest


@jit
def watch_energy(
    force, applied, weight_mass, mass, added_mass, fixed, gravity, velocity, displacement, nodes, push, answers, balance
):  # fmt: skip
    """Updates the balance; returns whether the motion is so fast that `EnergyWatch.judge` has to look.

    answers (W,8): the last Answer of every window.
    """
    work, kinetic, fastest = work_kernel(
        force, applied, weight_mass, mass, added_mass, fixed, gravity, velocity, displacement, nodes, push, balance
    )
    sums = balance.sums
    sums[GIVEN] += work
    windows = len(answers)
    if windows > 0:
        height = discs = own = 0.0
        for w in range(windows):
            height += answers[w, ABOVE]
            own += answers[w, KINETIC] + answers[w, STORED]
            discs += answers[w, KINETIC]
        if np.isnan(sums[HEIGHT]):
            sums[GIVEN] += own
        else:
            sums[GIVEN] -= 0.5 * (gravity + sums[GRAVITY]) * (height - sums[HEIGHT])
        sums[HEIGHT], sums[GRAVITY] = height, gravity
        kinetic += discs
    sums[MOST] = max(sums[MOST], sums[GIVEN])
    sums[NOW], sums[FASTEST] = kinetic, fastest
    calm = kinetic <= (MARGIN * FLOOR if windows > 0 else 1.0) * sums[MOST]
    sums[FOUND] = 0.0 if calm else 1.0
    if calm:
        sums[BEFORE], sums[ONSET] = kinetic, 0.0
        sums[LOOKS] += 1.0
    return not calm


class EnergyWatch(Kept):
    """The balance above since the beginning of a stage; rims: of the windows, if they are coupled.

    With rims, warn(name, text) is called for motion beyond the margin at more than one check: work and discs may be late.
    """

    KEPT = ("balance",)

    def __init__(self, model, state, gravity, rims=(), warn=None):
        self.rims, self.warn = rims, warn
        self.nodes = np.concatenate([rim.nodes for rim in rims]) if rims else np.zeros(0, dtype=np.int64)
        N = state.displacement.shape
        self.balance = Balance(state.displacement.copy(), np.zeros(N), np.zeros(N), np.zeros(10))
        work_kernel(*self._grid(model, state, gravity), self.nodes, self._push(), self.balance)
        sums = self.balance.sums
        sums[GIVEN] = sums[MOST] = strain_energy(model, state) + kinetic_energy(model, state)
        sums[HEIGHT] = sums[GRAVITY] = np.nan

    @property
    def given(self):
        """U0 + K0 + W [J]."""
        return float(self.balance.sums[GIVEN])

    @property
    def most(self):
        """Largest `given` [J] so far."""
        return float(self.balance.sums[MOST])

    def _grid(self, model, state, gravity):
        return (
            state.force, state.applied, model.weight_mass, masses(model, state), state.added_mass, model.fixed,
            float(gravity), state.velocity, state.displacement,
        )  # fmt: skip

    def _push(self):
        return np.concatenate([rim.force for rim in self.rims]) if self.rims else np.zeros((0, 2))

    def check(self, model, state, gravity):
        """Updates the balance, between the kernels of a step, and judges it. Raises Unstable."""
        answers = np.array([rim.answer for rim in self.rims], dtype=np.float64).reshape(-1, len(Answer._fields))
        watch_energy(*self._grid(model, state, gravity), self.nodes, self._push(), answers, self.balance)
        self.judge(model, state)

    def judge(self, model, state):
        """Judges the balance of the last check. Raises Unstable."""
        sums = self.balance.sums
        if not sums[FOUND]:
            return
        kinetic, before, looks = float(sums[NOW]), float(sums[BEFORE]), int(sums[LOOKS]) + 1
        bound = self._bound(model, state, kinetic)
        limit = MARGIN * bound
        sums[BEFORE], sums[LOOKS], sums[FOUND] = kinetic, looks, 0.0
        if kinetic <= bound:
            sums[ONSET] = 0.0
        if kinetic <= limit:
            return
        again = sums[ONSET] > 0.0
        if not again:
            sums[ONSET] = limit if limit > 0.0 and looks > 1 else kinetic
            before = kinetic
        ends = self._too_much(kinetic, before, float(sums[ONSET]))
        if self.rims and (again or ends):
            self.warn("drift", self._text(kinetic))
        if ends:
            fastest = int(sums[FASTEST])
            zone = model.zone[np.flatnonzero((model.zones == fastest).any(axis=1))]
            where = spot(model.grid.xy[fastest], model.grid.origin, 6)
            raise Unstable(
                f"{'drift: ' if self.rims else ''}{self._text(kinetic)}. "
                f"The fastest gridpoint is at {where}, in zone {zone[0] if len(zone) else '-'}: "
                f"is it attached to something stiffer than its zones, or was a velocity set by hand?"
            )

    def _bound(self, model, state, kinetic):
        """Upper bound of K [J]; U is computed only if it matters."""
        least = FLOOR * self.most
        if not self.rims or kinetic <= MARGIN * least:
            return self.most
        stored = strain_energy(model, state) + sum(rim.answer.stored for rim in self.rims)
        return max(least, self.most - stored)

    def _too_much(self, kinetic, before, onset):
        if not self.rims:
            return kinetic > GROWTH * onset
        return kinetic * max(1.0, kinetic / before) > COUPLED_GROWTH * onset

    def _text(self, kinetic):
        return f"the kinetic energy is {kinetic:.3g} J, the work of all forces {self.most:.3g} J: the motion grows by itself"
