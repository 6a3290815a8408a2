"""Energy ledger of the discs of a window in a coupled stage: energies and works.

It exists only if the scene has `record.energy`. Twin of fdm_server/observe/energy_ledger.py. At whole steps n, with
velocities v- and v+ half a step before and after:

    kinetic    T = v- . M v+ / 2 of free discs and clumps, spins included
    stored     U of all contacts (dem_server/observe/energy.py)

All other terms are works since the stage began. The work of forces X over the displacements du between whole steps follows the
trapezoidal rule, (X_n + X_n+1)/2 . du:

    gravity    of the weights
    ring       of the control discs on the others: minus contact forces and moments on them
    damping    of local damping and speed caps: - (M (v+ - v-)/dt - contacts - weight)
    friction   of the shear and rolling springs on slip; of a spring k, from force X to X', over the displacement w

                   -(X + X')/2 (w + (X' - X)/k)                                  (1)

    bonds      Eq (1) of all springs of a pair whose bond breaks in the step
    masses     change of T with the scaled masses of static mode, sum (M' - M) v-^2 / 2

    error = T - T0 + U - U0 + friction + bonds + damping - masses - gravity - ring

Bodies and contacts are booked separately. With linear springs of constant direction the error is round-off, also with damping,
slip and breakage in shear. The error contains what the trapezoidal rule misses when contacts close, open or turn within a step,
and the work of dashpots.
"""

import numpy as np

from coupler_protocol.compiled.jit import jit
from coupler_protocol.files.kept import Kept
from dem_server.effects import histories
from dem_server.model import INERTIA, MASS, MOMENT, SPIN, VX, VY
from dem_server.observe import energy
from dem_server.observe.pair_work import pair_losses
from dem_server.step.clumps import resultant
from dem_server.step.contact_pass import make_current

GRAVITY, RING, DAMPING = range(3)
NAMES = ("kinetic", "stored", "friction", "bonds", "damping", "masses", "gravity", "ring", "error")


@jit
def body_work(disc, load, weight, clumps, ring, gravity, dt, old, old_body, on_body, half_old, half_new):
    """Works [J] of a step's forces over half the displacements before (`old`) and after it; returns T [J].

    old (n,3), old_body (c,3): velocities and spins before the kick; on_body (c,3): forces and moments on clumps before the
    motion; half_old, half_new (3,): GRAVITY, RING, DAMPING.
    """
    half_old[:] = 0.0
    half_new[:] = 0.0
    kinetic = 0.0
    for i in range(disc.shape[0]):
        if i < ring:
            for k in range(3):
                half_old[RING] -= 0.5 * dt * load[i, k] * old[i, k]
                half_new[RING] -= 0.5 * dt * load[i, k] * disc[i, VX + k]
            continue
        half_old[GRAVITY] -= 0.5 * dt * gravity * weight[i] * old[i, 1]
        half_new[GRAVITY] -= 0.5 * dt * gravity * weight[i] * disc[i, VY]
        if clumps is not None:  # noqa: SIM102 (numba prunes this line only if it stands alone)
            if clumps.body[i] >= 0:
                continue
        for k in range(3):
            m = disc[i, INERTIA] if k == 2 else disc[i, MASS]
            force = load[i, k] - (weight[i] * gravity if k == 1 else 0.0)
            rest = m * (disc[i, VX + k] - old[i, k]) / dt - force
            kinetic += 0.5 * m * old[i, k] * disc[i, VX + k]
            half_old[DAMPING] += 0.5 * dt * rest * old[i, k]
            half_new[DAMPING] += 0.5 * dt * rest * disc[i, VX + k]
    if clumps is not None:
        body = clumps.motion
        for c in range(len(body)):
            if clumps.start[c] == clumps.start[c + 1]:
                continue
            for k in range(3):
                m = body[c, INERTIA] if k == 2 else body[c, MASS]
                rest = m * (body[c, VX + k] - old_body[c, k]) / dt - on_body[c, k]
                kinetic += 0.5 * m * old_body[c, k] * body[c, VX + k]
                half_old[DAMPING] += 0.5 * dt * rest * old_body[c, k]
                half_new[DAMPING] += 0.5 * dt * rest * body[c, VX + k]
    return kinetic


@jit
def forces_on_clumps(disc, load, weight, clumps, gravity, out):
    """Forces and moments (c,3) on all clumps, weight included."""
    for c in range(len(out)):
        out[c, 0], out[c, 1], out[c, 2] = resultant(c, clumps, disc, load, weight, gravity)


@jit
def mass_work(disc, clumps, ring, mass, inertia, body_mass, old, old_body):
    """Change [J] of the kinetic energy with masses and inertia; updates the arrays of masses and inertia."""
    total = 0.0
    for i in range(ring, disc.shape[0]):
        if clumps is not None:  # noqa: SIM102 (numba prunes this line only if it stands alone)
            if clumps.body[i] >= 0:
                continue
        total += (disc[i, MASS] - mass[i]) * (old[i, 0] ** 2 + old[i, 1] ** 2) + (disc[i, INERTIA] - inertia[i]) * old[i, 2] ** 2
        mass[i], inertia[i] = disc[i, MASS], disc[i, INERTIA]
    if clumps is not None:
        body = clumps.motion
        for c in range(len(body)):
            total += (body[c, MASS] - body_mass[c, 0]) * (old_body[c, 0] ** 2 + old_body[c, 1] ** 2)
            total += (body[c, INERTIA] - body_mass[c, 1]) * old_body[c, 2] ** 2
            body_mass[c, 0], body_mass[c, 1] = body[c, MASS], body[c, INERTIA]
    return 0.5 * total


class Ledger(Kept):
    """The ledger of one stage: `copy_before_step`, `book_motion`, `book_contacts` in every step, `values` between the last two.

    `power` [W] is that of the contact forces on the control discs in their velocities half a step later, as at the rim's nodes
    in the grid; `work` [J] is its sum over time since the stage began.
    """

    KEPT = (
        "dt", "mass", "inertia", "body_mass", "total", "half_new", "friction", "bonds", "masses", "power", "work", "begin",
    )  # fmt: skip

    def __init__(self, model, state):
        self.dt = state.dt
        self.old = state.disc[:, VX : SPIN + 1].copy()
        self.old_body = None if state.clumps is None else state.clumps.motion[:, VX : SPIN + 1].copy()
        self.mass, self.inertia = state.mass.copy(), state.inertia.copy()
        self.body_mass = None if state.clumps is None else state.clumps.motion[:, MASS : INERTIA + 1].copy()
        self.on_body = None if state.clumps is None else np.zeros((len(state.clumps.motion), 3))
        self.total = np.zeros(3)  # up to half a step ahead of the last whole step
        self.half_old, self.half_new = np.zeros(3), np.zeros(3)
        self.friction = self.bonds = self.masses = self.power = self.work = 0.0
        self.begin = None  # T0 + U0

    def copy_before_step(self, state, gravity):
        """Copies velocities, step, and forces on clumps (whose levers turn with them) before velocities change."""
        self.dt = state.dt
        self.old[:] = state.disc[:, VX : SPIN + 1]
        if state.clumps is not None:
            self.old_body[:] = state.clumps.motion[:, VX : SPIN + 1]
            forces_on_clumps(state.disc, state.load, state.weight, state.clumps, float(gravity), self.on_body)

    def book_motion(self, model, state, gravity, kick):
        """Books the motion, after all discs have moved and before contacts are computed.

        kick [s]: time over which forces acted; it differs from the step only in the first step of a stage.
        """
        self.masses += mass_work(
            state.disc, state.clumps, model.ring, self.mass, self.inertia, self.body_mass, self.old, self.old_body
        )
        if kick != state.dt:  # velocities are extrapolated back by a whole step
            extrapolate_back(self.old, state.disc, state.dt / kick)
            if state.clumps is not None:
                extrapolate_back(self.old_body, state.clumps.motion, state.dt / kick)
        self.kinetic = body_work(
            state.disc, state.load, state.weight, state.clumps, model.ring, float(gravity), state.dt, self.old, self.old_body,
            self.on_body, self.half_old, self.half_new,
        )  # fmt: skip
        if self.begin is None:  # the motion before the stage does not count
            self.begin = self.kinetic + energy.stored(model, state)
            self.half_old[:] = 0.0
            self.masses = 0.0
        self.total += self.half_old + self.half_new
        R = model.ring
        self.power = float(np.sum(state.load[:R, : MOMENT + 1] * state.disc[:R, VX : SPIN + 1]))
        self.work += self.power * state.dt

    def copy_contacts(self, model, state):
        """Copies contact histories before contact forces change, in the order of the list that `contact_forces` will use."""
        make_current(model, state)
        self.before = histories.copied(state)

    def book_contacts(self, model, state):
        """Books losses of contacts and power of the ring, after contact forces have changed."""
        law, after = model.law, histories.history_of(state)
        friction, bonds = pair_losses(state.disc, state.listed, state.dt, self.before, after, law.spring, law.parallel_bond)
        self.friction += friction
        self.bonds += bonds

    def values(self, model, state):
        """Energies {name: [J]} of the last whole step, before its contacts change: NAMES."""
        work = self.total - self.half_new
        stored = energy.stored(model, state)
        known = self.friction + self.bonds - work[DAMPING] - self.masses - work[GRAVITY] - work[RING]
        error = self.kinetic + stored - self.begin + known
        values = (
            self.kinetic, stored, self.friction, self.bonds, -work[DAMPING], self.masses, work[GRAVITY], work[RING], error,
        )  # fmt: skip
        return dict(zip(NAMES, map(float, values), strict=True))


def extrapolate_back(old, moved, ratio):
    """Extrapolates velocities `old` (b,3) to a whole step before those of `moved` (b,8); `ratio`: step over their distance."""
    now = moved[:, VX : SPIN + 1]
    old[:] = now - (now - old) * ratio
