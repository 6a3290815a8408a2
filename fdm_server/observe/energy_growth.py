"""Blow-up found by energy, long before a number overflows.

Whatever yields, slides or is damped only takes energy out. Since a moment with strain energy U0 and kinetic energy K0,

    K <= U0 + K0 + W

with W the work of weights and applied forces, and of those that drive prescribed gridpoints. A slope that fails obeys this,
however fast it goes; in static mode too, with scaled masses on both sides. A step that is too long for something stiff does
not: velocities grow from step to step and nobody has done the work. Looks are some steps apart, so W is known by the
trapezoidal rule only, and K, of a half step, can be twice the energy at omega^2 = 2: hence MARGIN. Sudden forces between two
looks are seen too late: hence K must also have grown GROWTH times since it went beyond the margin.

With windows all this holds for zones and discs together. What the discs' forces P do to the rim, they get back from the ring, so
P is no external force; a mapping that loses or makes power does not keep to it. K, U0, K0 and the work of weights then include
those of the discs as they were at their last look, and what is stored, U, counts too:

    K <= U0 + K0 + W - U,

or a share FLOOR of U0 + K0 + W, where U takes nearly all and hides what is left. K may grow by less then (COUPLED_GROWTH), as far
as the look to come: the forces that come late are inside.
"""

import numpy as np

from coupler_protocol.compiled.jit import jit
from fdm_server.observe.energy import strain_energy
from fdm_server.step.gridpoint_pass import kinetic_energy
from fdm_server.step.present_shape import masses
from fdm_server.step.safety import Unstable

MARGIN, GROWTH, COUPLED_GROWTH, FLOOR = 5.0, 100.0, 25.0, 0.01


@jit
def external_force(n, k, force, applied, weight_mass, fixed, gravity):
    """Component k of what acts on gridpoint n from outside [N]; on a held or driven one the reaction, inertia left out."""
    if fixed[n, k]:
        return -force[n, k]
    return applied[n, k] - (gravity * weight_mass[n] if k == 1 else 0.0)


@jit
def work_kernel(force, applied, weight_mass, mass, added_mass, fixed, gravity, velocity, displacement, last, before):
    """Work [J] since the last look, kinetic energy [J] of what is free, and the gridpoint with most of it.

    last (N,2) [m], before (N,2) [N]: displacements and external forces at the last look, replaced by those of now.
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


class EnergyWatch:
    """The balance above since this was made, at the beginning of a stage; rims: of the windows, if they are coupled.

    warn(name, text) then hears of motion that is beyond the margin at more than one look: work and discs may be seen late.
    """

    def __init__(self, model, state, gravity, rims=(), warn=None):
        self.rims, self.warn = rims, warn
        self.heights = None  # of the discs at the last look, and its gravity
        self.last = state.displacement.copy()
        self.before = np.zeros_like(self.last)
        self._kernel(model, state, gravity)
        self.given = strain_energy(model, state) + kinetic_energy(model, state)  # U0 + K0 + W [J]
        self.most = self.given
        self.onset = None  # K when it went beyond the margin
        self.kinetic, self.looks = 0.0, 0  # K at the last look

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
        """Bring the balance up to date, between the kernels of a step. Raises Unstable."""
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
            x, y = model.grid.xy[fastest]
            zone = model.zone[np.flatnonzero((model.zones == fastest).any(axis=1))]
            raise Unstable(
                f"{'drift: ' if self.rims else ''}{self._text(kinetic)}. "
                f"The fastest gridpoint is at ({x:g}, {y:g}), in zone {zone[0] if len(zone) else '-'}: "
                f"is it attached to something stiffer than its zones, or was a velocity set by hand?"
            )

    def _bound(self, model, state, kinetic):
        """Most that K can be [J]; U is computed only where it matters."""
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
        """Energies that discs had at the first look and the work of their weights since go to `given`; returns their K [J]."""
        height = sum(rim.answer.height for rim in self.rims)
        if self.heights is None:
            self.given += sum(rim.answer.kinetic + rim.answer.stored for rim in self.rims)
        else:
            before, then = self.heights
            self.given -= 0.5 * (gravity + then) * (height - before)
        self.heights = height, gravity
        return sum(rim.answer.kinetic for rim in self.rims)
