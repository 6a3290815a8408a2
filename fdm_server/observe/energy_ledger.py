"""Energy ledger of the grid in a stage: energies and works. It exists only if the scene has `record.energy`.

At whole steps n, with velocities v- and v+ half a step before and after, masses M and u the displacements:

    kinetic    T = v- . M v+ / 2
    strain     U: elastic energy of the stresses (fdm_server/observe/energy.py)

All other terms are works since the stage began, of forces X over the displacements du between whole steps, by the trapezoidal
rule, (X_n + X_n+1)/2 . du:

    gravity    of the weights
    external   of applied forces, and of the reactions at held or driven gridpoints
    damping    of damping: - (M (v+ - v-)/dt - zones - applied - weight) on free components
    masses     change of T with variable masses (scaled masses in large strain, masses that discs add to a rim):
               sum (M' - M) v-^2 / 2
    plastic    of stresses on plastic strain, for each zone and triangle; plastic strain: strain increment minus the elastic
               strain of the stress increment
    averaging  with nodal mixed discretisation: of sm on the difference between a zone's volumetric strain, on which forces do
               work, and the averaged one, to which laws apply (effects/nodal_mixing.py); a stored energy in elastic ground

The discrete leap-frog conserves T + U exactly without damping (T is the kinetic energy for which it does), so

    error = T - T0 + U - U0 + plastic + averaging + damping - masses - gravity - external

is round-off in small strain, also with yield: gridpoints and zones are booked separately. The stiffness part of Rayleigh damping
is the difference of both, so there the error detects less.
"""

import numpy as np

from coupler_protocol.compiled.jit import jit
from coupler_protocol.files.kept import Kept
from fdm_server.observe.energy import strain_energy
from fdm_server.step.blocks import LANES
from fdm_server.step.clock import seconds
from fdm_server.step.nodal_pass import NodalPass
from fdm_server.step.present_shape import masses
from fdm_server.step.strain import DIFFERENCE, DILATION, GAMMA, STRAIN_ROWS, T0, T1, T2, T3, gather_increments, strain_increments
from fdm_server.step.stress import SD, SM, XY, ZZ

GRAVITY, EXTERNAL, DAMPING, ZONES = range(4)  # work on gridpoints; ZONES: that of the zones' forces
NAMES = ("kinetic", "strain", "plastic", "damping", "external", "gravity", "masses", "error")


@jit
def point_work(force, applied, weight_mass, mass, added_mass, fixed, gravity, dt, old, new, half_old, half_new):
    """Works [J] of a step's forces over half the displacements before (v-, `old`) and after it (`new`); returns T [J]."""
    kinetic = 0.0
    half_old[:] = 0.0
    half_new[:] = 0.0
    for n in range(new.shape[0]):
        m = mass[n] + added_mass[n]
        for k in range(2):
            before, after = 0.5 * dt * old[n, k], 0.5 * dt * new[n, k]
            weight = -gravity * weight_mass[n] if k == 1 else 0.0
            rest = m * (new[n, k] - old[n, k]) / dt - (force[n, k] + applied[n, k] + weight)
            kinetic += 0.5 * m * old[n, k] * new[n, k]
            outside = applied[n, k] + (rest if fixed[n, k] else 0.0)
            damping = 0.0 if fixed[n, k] else rest
            half_old[GRAVITY] += weight * before
            half_new[GRAVITY] += weight * after
            half_old[EXTERNAL] += outside * before
            half_new[EXTERNAL] += outside * after
            half_old[DAMPING] += damping * before
            half_new[DAMPING] += damping * after
            half_old[ZONES] += force[n, k] * before
            half_new[ZONES] += force[n, k] * after
    return kinetic


@jit
def zone_work(corner, x, y, inverse_double_area, share, pattern, elastic, velocity, dt, before, stress, excess):
    """Work [J] of the stresses in a step, from `before` to `stress`, the part of it on plastic strain, and that of averaging.

    excess (B,16): averaged volumetric strains minus those of the zones; None without nodal mixed discretisation.
    """
    u = np.empty(8 * LANES)
    strain = np.empty(STRAIN_ROWS * LANES)
    whole = plastic = averaging = 0.0
    for b in range(corner.shape[0]):
        gather_increments(b, corner, velocity, dt, u)
        strain_increments(b, x, y, inverse_double_area, u, strain)
        m = pattern[b]
        for i in range(LANES):
            inverse = inverse_double_area[b, 4 * LANES + i]
            area = 0.5 / inverse if inverse > 0.0 else 0.0
            G, lame = elastic[m, LANES + i], elastic[m, 2 * LANES + i]
            K = elastic[m, i] - G / 3.0
            e = strain[DILATION + i]
            sm, zz = 0.5 * (before[b, SM + i] + stress[b, SM + i]), 0.5 * (before[b, ZZ + i] + stress[b, ZZ + i])
            whole += area * sm * e
            if excess is not None:
                averaging -= area * sm * excess[b, i]
                e += excess[b, i]
            d_sm = elastic[m, i] * e - (stress[b, SM + i] - before[b, SM + i])
            d_zz = lame * e - (stress[b, ZZ + i] - before[b, ZZ + i])
            plastic += area * ((2.0 * sm + zz) * (2.0 * d_sm + d_zz) / (9.0 * K) + (sm - zz) * (d_sm - d_zz) / (3.0 * G))
            for o in (T0, T1, T2, T3):
                part = 0.5 * share[b, o + i] * area
                difference, gamma = strain[DIFFERENCE + o + i], strain[GAMMA + o + i]
                sd = 0.5 * (before[b, SD + o + i] + stress[b, SD + o + i])
                xy = 0.5 * (before[b, XY + o + i] + stress[b, XY + o + i])
                d_sd = G * difference - (stress[b, SD + o + i] - before[b, SD + o + i])
                d_xy = G * gamma - (stress[b, XY + o + i] - before[b, XY + o + i])
                whole += part * (sd * difference + xy * gamma)
                plastic += part * (sd * d_sd + xy * d_xy) / G
    return whole, plastic, averaging


class Ledger(Kept):
    """The ledger of one stage: `copy_before_step`, `book_motion`, `book_strain` in every step, `values` between the last two."""

    KEPT = ("work", "half_new", "plastic", "zones", "averaging", "begin", "power", "work_of_discs", "mass", "masses")

    def __init__(self, model, state):
        self.old = state.velocity.copy()
        self.stress = np.empty_like(state.stress)
        self.work = np.zeros(4)  # up to half a step ahead of the last whole step
        self.half_old, self.half_new = np.zeros(4), np.zeros(4)
        self.plastic = self.zones = 0.0
        self.averaging = None if model.nodal is None else 0.0
        self.begin = None  # T0 + U0
        self.power = self.work_of_discs = 0.0  # of the discs' forces on the rims, in coupled stages
        self.mass = masses(model, state) + state.added_mass
        self.masses = 0.0

    def copy_before_step(self, state):
        """Copies velocities and stresses before velocities change."""
        self.old[:] = state.velocity
        self.stress[:] = state.stress

    def book_motion(self, model, state, gravity, kick=None, rims=()):
        """Books the works of forces, after velocities have changed.

        kick [s]: time over which forces acted if it is less than a step; velocities are extrapolated back by a whole step.
        rims: of open windows; the forces of their discs have the `power` [W] in these velocities, and the `work_of_discs` [J].
        """
        mass = masses(model, state) + state.added_mass
        self.masses += 0.5 * float((mass - self.mass) @ np.sum(self.old**2, axis=1))
        self.mass = mass
        if kick is not None:
            self.old[:] = state.velocity - (state.velocity - self.old) * (state.dt / kick)
        self.kinetic = point_work(
            state.force, state.applied, model.weight_mass, masses(model, state), state.added_mass, model.fixed,
            float(gravity), seconds(state), self.old, state.velocity, self.half_old, self.half_new,
        )  # fmt: skip
        if self.begin is None:  # the motion before the stage does not count
            self.begin = self.kinetic + strain_energy(model, state)
            self.half_old[:] = 0.0
            self.masses = 0.0
        self.work += self.half_old + self.half_new
        self.power = float(sum(np.sum(rim.force * state.velocity[rim.nodes]) for rim in rims))
        self.work_of_discs += self.power * seconds(state)

    def book_strain(self, model, state):
        """Books the works of stresses, after stresses have changed."""
        g, excess = model.geometry, None
        if model.nodal is not None:
            nodal = NodalPass(model, state)
            nodal.strains()
            excess = nodal.excess
        whole, plastic, averaging = zone_work(
            g.corner, g.x, g.y, g.inverse_double_area, g.share, model.pattern, model.law.elastic,
            state.velocity, seconds(state), self.stress, state.stress, excess,
        )  # fmt: skip
        self.zones += whole
        self.plastic += plastic
        if self.averaging is not None:
            self.averaging += averaging

    def values(self, model, state):
        """Energies {name: [J]} of the last whole step: NAMES."""
        work = self.work - self.half_new
        damping = -work[DAMPING]
        if model.law.rayleigh is not None and model.law.rayleigh.stiffness is not None:
            damping += -work[ZONES] - self.zones
        strain = strain_energy(model, state)
        gained = self.kinetic + strain - self.begin
        averaging = self.averaging or 0.0
        error = gained + self.plastic + averaging + damping - self.masses - work[GRAVITY] - work[EXTERNAL]
        values = self.kinetic, strain, self.plastic, damping, work[EXTERNAL], work[GRAVITY], self.masses, error
        found = dict(zip(NAMES, map(float, values), strict=True))
        return found if self.averaging is None else found | {"averaging": self.averaging}
