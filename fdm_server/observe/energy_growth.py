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

import numpy as np

from coupler_protocol.compiled.jit import jit
from coupler_protocol.files.kept import Kept
from coupler_protocol.geometry import spot
from fdm_server.observe.energy import strain_energy
from fdm_server.step.gridpoint_pass import kinetic_energy
from fdm_server.step.present_shape import masses
from fdm_server.step.safety import Unstable

MARGIN, GROWTH, COUPLED_GROWTH, FLOOR = 5.0, 100.0, 25.0, 0.01


@jit
def external_force(n, k, force, applied, weight_mass, fixed, gravity):
    """Component k of the external force on gridpoint n [N]; on a held or driven component the reaction, without inertia."""
    if fixed[n, k]:
        return -force[n, k]
    return applied[n, k] - (gravity * weight_mass[n] if k == 1 else 0.0)


@jit
def work_kernel(force, applied, weight_mass, mass, added_mass, fixed, gravity, velocity, displacement, last, before):
    """Work [J] since the last check, kinetic energy [J] of free components, and the gridpoint with the largest part of it.

    last (N,2) [m], before (N,2) [N]: displacements and external forces at the last check, replaced by the present ones.
    """
    work = kinetic = most = 0.0
    fastest = 0
    for n in range(velocity.shape[0]):
        own = 0.0
        for k in range(2):
            v = velocity[n, k]
            external = external_force(n, k, force, applied, weight_mass, fixed, gravity)
            work += 0.5 * (before[n, k] + external) * (displacement[n, k] - last[n, k])
            before[n, k] = external
            last[n, k] = displacement[n, k]
            own += 0.0 if fixed[n, k] else 0.5 * (mass[n] + added_mass[n]) * v * v
        kinetic += own
        if own > most:
            most, fastest = own, n
    return work, kinetic, fastest


class EnergyWatch(Kept):
    """The balance above since the beginning of a stage; rims: of the windows, if they are coupled.

    With rims, warn(name, text) is called for motion beyond the margin at more than one check: work and discs may be late.
    """

    KEPT = ("heights", "last", "before", "given", "most", "onset", "kinetic", "looks")

    def __init__(self, model, state, gravity, rims=(), warn=None):
        self.rims, self.warn = rims, warn
        self.heights = None  # of the discs at the last check, and its gravity
        self.last = state.displacement.copy()
        self.before = np.zeros_like(self.last)
        self._kernel(model, state, gravity)
        self.given = strain_energy(model, state) + kinetic_energy(model, state)  # U0 + K0 + W [J]
        self.most = self.given
        self.onset = None  # K when it exceeded the margin
        self.kinetic, self.looks = 0.0, 0  # K at the last check

    def _kernel(self, model, state, gravity):
        applied = state.applied
        if self.rims:
            applied = applied.copy()
            for rim in self.rims:
                applied[rim.nodes] -= rim.force
        return work_kernel(
            state.force, applied, model.weight_mass, masses(model, state), state.added_mass, model.fixed,
            float(gravity), state.velocity, state.displacement, self.last, self.before,
        )  # fmt: skip

    def check(self, model, state, gravity):
        """Updates the balance, between the kernels of a step. Raises Unstable."""
        work, kinetic, fastest = self._kernel(model, state, gravity)
        self.given += work
        if self.rims:
            kinetic += self._check_discs(gravity)
        self.most = max(self.most, self.given)
        bound, before = self._bound(model, state, kinetic), self.kinetic
        limit = MARGIN * bound
        self.kinetic, self.looks = kinetic, self.looks + 1
        if kinetic <= bound:
            self.onset = None
        if kinetic <= limit:
            return
        again = self.onset is not None
        if not again:
            self.onset = limit if limit > 0.0 and self.looks > 1 else kinetic
            before = kinetic
        ends = self._too_much(kinetic, before)
        if self.rims and (again or ends):
            self.warn("drift", self._text(kinetic))
        if ends:
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

    def _too_much(self, kinetic, before):
        if not self.rims:
            return kinetic > GROWTH * self.onset
        return kinetic * max(1.0, kinetic / before) > COUPLED_GROWTH * self.onset

    def _text(self, kinetic):
        return f"the kinetic energy is {kinetic:.3g} J, the work of all forces {self.most:.3g} J: the motion grows by itself"

    def _check_discs(self, gravity):
        """Adds the initial energies of the discs and the work of their weights to `given`; returns their K [J]."""
        height = sum(rim.answer.height for rim in self.rims)
        if self.heights is None:
            self.given += sum(rim.answer.kinetic + rim.answer.stored for rim in self.rims)
        else:
            before, then = self.heights
            self.given -= 0.5 * (gravity + then) * (height - before)
        self.heights = height, gravity
        return sum(rim.answer.kinetic for rim in self.rims)
