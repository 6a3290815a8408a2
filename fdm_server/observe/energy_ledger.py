"""Energy ledger of the grid in a stage: energies and works. It exists only if the scene has `record.energy`.

At whole steps n, with velocities v- and v+ half a step before and after, masses M and u the displacements:

    kinetic    T = v- . M v+ / 2
    strain     U: elastic energy of the stresses (fdm_server/observe/energy.py)

All other terms are works since the stage began, of forces X over the displacements du between whole steps, by the trapezoidal
rule, (X_n + X_n+1)/2 . du:

    gravity    of the weights
    external   of applied forces, and of the reactions at held or driven gridpoints
    dashpots   of quiet sides: minus that of the dashpots' forces (ground/quiet_sides.py)
    arriving   of the forces of waves that arrive at compliant sides (ground/shaking.py)
    damping    of damping: - (M (v+ - v-)/dt - zones - applied - weight) on free components
    masses     change of T with variable masses (scaled masses in large strain, masses that discs add to a rim):
               sum (M' - M) v-^2 / 2
    plastic    of stresses on plastic strain, for each zone and triangle; plastic strain: strain increment minus the elastic
               strain of the stress increment
    shape      in large strain: of the change of areas A, u dA, with u the elastic energy per area; the law relates rates of
               stress to strains, so that ground that swells under stress stores more
    averaging  with nodal mixed discretisation: of sm on the difference between a zone's volumetric strain, on which forces do
               work, and the averaged one, to which laws apply (effects/nodal_mixing.py); a stored energy in elastic ground

The discrete leap-frog conserves T + U exactly without damping (T is the kinetic energy for which it does), so

    error = T - T0 + U - U0 + plastic + averaging + damping + dashpots - masses - gravity - external - arriving - shape

is round-off in small strain, also with yield: gridpoints and zones are booked separately. In large strain it is of second order
in the step, of first where steps in real time become shorter: strains and areas are those of mid-step, stresses are turned there
(effects/large_strain.py). The stiffness part of Rayleigh damping is the difference of both, so there the error detects less.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from coupler_protocol.compiled.jit import jit
from coupler_protocol.files.kept import Kept, like, value_of
from fdm_server.ground.quiet_sides import WAVES
from fdm_server.ground.shaking import ARRIVING
from fdm_server.observe.energy import strain_energy
from fdm_server.step import present_shape as shape
from fdm_server.step.blocks import LANES
from fdm_server.step.clock import seconds
from fdm_server.step.large_strain import (
    COSINE,
    SINE,
    TURN_ROWS,
    double_areas,
    half_turns,
    middle_shape,
    present_shape,
    turned,
)
from fdm_server.step.nodal_pass import NodalPass
from fdm_server.step.present_shape import masses
from fdm_server.step.strain import DIFFERENCE, DILATION, GAMMA, STRAIN_ROWS, T0, T1, T2, T3, gather_increments, strain_increments
from fdm_server.step.stress import SD, SM, XY, ZZ

GRAVITY, EXTERNAL, DAMPING, ZONES, OF_DASHPOTS, OF_WAVES, WORKS = range(7)  # work on gridpoints; ZONES: of the zones' forces
KINETIC, STRAIN, PLASTIC, OF_ZONES, AVERAGING, MASSES, POWER, OF_DISCS, BEGIN, SHAPE, SUMS = range(11)  # of Book.sums
NAMES = ("kinetic", "strain", "plastic", "damping", "external", "gravity", "masses", "error")


class Book(NamedTuple):
    """What a Ledger keeps, for compiled code.

    old (N,2), stress (B,R): velocities and stresses before a step; mass (N,) [kg] in the last step; work (6,) [J]: GRAVITY,
    EXTERNAL, DAMPING, ZONES, OF_DASHPOTS, OF_WAVES up to half a step ahead of the last whole step; half_old, half_new (6,): of
    the halves of the last step. sums (10,): T, U, plastic work, work of the zones' stresses, averaging, masses [J]; power [W] of
    the discs' forces on the rims, their work [J]; T0 + U0, NaN before the first step; shape. rows (n,17), noted (1,): see
    `note_energies`.
    dashpots, arriving: tuples of the forces (N,2) [N] of quiet sides and of waves that arrive, or None.
    """

    old: NDArray[np.float64]
    stress: NDArray[np.float64]
    mass: NDArray[np.float64]
    work: NDArray[np.float64]
    half_old: NDArray[np.float64]
    half_new: NDArray[np.float64]
    sums: NDArray[np.float64]
    rows: NDArray[np.float64]
    noted: NDArray[np.int64]
    dashpots: tuple[NDArray[np.float64], ...] | None
    arriving: tuple[NDArray[np.float64], ...] | None


@jit
def copy_before(velocity, stress, book):
    """Copies velocities and stresses before velocities change."""
    old, before = book.old, book.stress
    for n in range(velocity.shape[0]):
        old[n, 0], old[n, 1] = velocity[n, 0], velocity[n, 1]
    for b in range(stress.shape[0]):
        for k in range(stress.shape[1]):
            before[b, k] = stress[b, k]


@jit
def book_points(force, applied, weight_mass, mass, added_mass, fixed, gravity, dt, velocity, kick, nodes, push, book):
    """Books the works of forces on gridpoints, after velocities have changed; dt [s], 1 in static mode.

    kick [s]: see `Ledger.book_motion`, None: the step. push (K,2) [N]: forces of the discs on the gridpoints `nodes` (K,).
    """
    old, sums = book.old, book.sums
    changed = 0.0
    for n in range(velocity.shape[0]):
        now = mass[n] + added_mass[n]
        changed += (now - book.mass[n]) * (old[n, 0] ** 2 + old[n, 1] ** 2)
        book.mass[n] = now
    sums[MASSES] += 0.5 * changed
    if kick is not None:
        for n in range(velocity.shape[0]):
            for k in range(2):
                old[n, k] = velocity[n, k] - (velocity[n, k] - old[n, k]) * (dt / kick)
    sums[KINETIC] = point_work(
        force, applied, weight_mass, mass, added_mass, fixed, gravity, dt, old, velocity, book.half_old, book.half_new
    )
    wave_work(book.dashpots, OF_DASHPOTS, dt, old, velocity, book.half_old, book.half_new)
    wave_work(book.arriving, OF_WAVES, dt, old, velocity, book.half_old, book.half_new)
    for name in range(len(book.work)):
        book.work[name] += book.half_old[name] + book.half_new[name]
    power = 0.0
    for i in range(len(nodes)):
        power += push[i, 0] * velocity[nodes[i], 0] + push[i, 1] * velocity[nodes[i], 1]
    sums[POWER] = power
    sums[OF_DISCS] += power * dt


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
def wave_work(parts, name, dt, old, new, half_old, half_new):
    """Books the works of parts (N,2) of the applied forces, a tuple or None, under a name of their own instead of EXTERNAL."""
    if parts is not None:
        for forces in parts:
            for n in range(new.shape[0]):
                for k in range(2):
                    before, after = 0.5 * dt * old[n, k] * forces[n, k], 0.5 * dt * new[n, k] * forces[n, k]
                    half_old[name] += before
                    half_new[name] += after
                    half_old[EXTERNAL] -= before
                    half_new[EXTERNAL] -= after


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
        found = block_work(b, pattern[b], b, inverse_double_area, share, elastic, strain, before, stress, excess)
        whole, plastic, averaging = whole + found[0], plastic + found[1], averaging + found[2]
    return whole, plastic, averaging


@jit
def block_work(b, m, s, inverse_double_area, share, elastic, strain, before, stress, excess):
    """`zone_work` of block b of pattern m; `inverse_double_area`, `share`, `before` and `stress` have it as block s."""
    whole = plastic = averaging = 0.0
    for i in range(LANES):
        inverse = inverse_double_area[s, 4 * LANES + i]
        area = 0.5 / inverse if inverse > 0.0 else 0.0
        G, lame = elastic[m, LANES + i], elastic[m, 2 * LANES + i]
        K = elastic[m, i] - G / 3.0
        e = strain[DILATION + i]
        sm, zz = 0.5 * (before[s, SM + i] + stress[s, SM + i]), 0.5 * (before[s, ZZ + i] + stress[s, ZZ + i])
        whole += area * sm * e
        if excess is not None:
            averaging -= area * sm * excess[b, i]
            e += excess[b, i]
        d_sm = elastic[m, i] * e - (stress[s, SM + i] - before[s, SM + i])
        d_zz = lame * e - (stress[s, ZZ + i] - before[s, ZZ + i])
        plastic += area * ((2.0 * sm + zz) * (2.0 * d_sm + d_zz) / (9.0 * K) + (sm - zz) * (d_sm - d_zz) / (3.0 * G))
        for o in (T0, T1, T2, T3):
            part = 0.5 * share[s, o + i] * area
            difference, gamma = strain[DIFFERENCE + o + i], strain[GAMMA + o + i]
            sd = 0.5 * (before[s, SD + o + i] + stress[s, SD + o + i])
            xy = 0.5 * (before[s, XY + o + i] + stress[s, XY + o + i])
            d_sd = G * difference - (stress[s, SD + o + i] - before[s, SD + o + i])
            d_xy = G * gamma - (stress[s, XY + o + i] - before[s, XY + o + i])
            whole += part * (sd * difference + xy * gamma)
            plastic += part * (sd * d_sd + xy * d_xy) / G
    return whole, plastic, averaging


@jit
def moving_zone_work(corner, grid_share, pattern, elastic, velocity, dt, before, stress, excess, xy, displacement):
    """`zone_work` in large strain, and u dA [J]; xy (N,2): positions at zero displacement; displacement: at the step's end."""
    u, strain, turn = np.empty(8 * LANES), np.empty(STRAIN_ROWS * LANES), np.empty(TURN_ROWS * LANES)
    end_x, end_y, share = np.empty((1, 4 * LANES)), np.empty((1, 4 * LANES)), np.empty((1, 4 * LANES))
    mid_x, mid_y, inverse = np.empty((1, 4 * LANES)), np.empty((1, 4 * LANES)), np.empty((1, 5 * LANES))
    first, last = np.empty((1, stress.shape[1])), np.empty((1, stress.shape[1]))
    whole = plastic = averaging = of_shape = 0.0
    alone = np.int64(0)
    for b in range(corner.shape[0]):
        gather_increments(b, corner, velocity, dt, u)
        present_shape(b, corner, grid_share, xy, displacement, end_x, end_y, share)
        middle_shape(end_x, end_y, u, mid_x, mid_y, inverse)
        strain_increments(alone, mid_x, mid_y, inverse, u, strain)
        half_turns(mid_x, mid_y, inverse, u, turn)
        for k in range(stress.shape[1]):
            first[0, k], last[0, k] = before[b, k], stress[b, k]
        for i in range(LANES):
            for t in (T0, T1, T2, T3):
                c, s = turn[COSINE + t + i], turn[SINE + t + i]
                first[0, SD + t + i], first[0, XY + t + i] = turned(before[b, SD + t + i], before[b, XY + t + i], c, s)
                last[0, SD + t + i], last[0, XY + t + i] = turned(stress[b, SD + t + i], stress[b, XY + t + i], c, -s)
            if grid_share[b, T0 + i] + grid_share[b, T1 + i] <= 0.0:
                inverse[0, 4 * LANES + i] = 0.0  # a lane without a zone
            else:
                of_shape += shape_work(i, pattern[b], end_x, end_y, u, elastic, first, last)
        found = block_work(b, pattern[b], alone, inverse, share, elastic, strain, first, last, excess)
        whole, plastic, averaging = whole + found[0], plastic + found[1], averaging + found[2]
    return whole, plastic, averaging, of_shape


@jit
def shape_work(i, m, x, y, u, elastic, before, stress):
    """u dA [J] of the zone in lane i, in a step with the displacements u that ends at corners x, y; stresses of both ends."""
    begin_x, begin_y = np.empty((1, 4 * LANES)), np.empty((1, 4 * LANES))
    for k in range(i, 4 * LANES, LANES):
        begin_x[0, k], begin_y[0, k] = x[0, k] - u[k], y[0, k] - u[4 * LANES + k]
    old, new = double_areas(begin_x, begin_y, i), double_areas(x, y, i)
    G = elastic[m, LANES + i]
    K = elastic[m, i] - G / 3.0
    total = 0.0
    for at in (before, stress):
        sm, zz = at[0, SM + i], at[0, ZZ + i]
        of_zone = (2.0 * sm + zz) ** 2 / (18.0 * K) + (sm - zz) ** 2 / (6.0 * G)
        total += 0.25 * (new[0] + new[1] - old[0] - old[1]) * of_zone
        for t in range(4):
            sd, xy = at[0, SD + t * LANES + i], at[0, XY + t * LANES + i]
            total += 0.125 * (new[t] - old[t]) * (sd * sd + xy * xy) / (2.0 * G)
    return total


@jit
def book_zones(geometry, stiffness, velocity, dt, stress, excess, xy, displacement, book):
    """Books the works of stresses, after stresses have changed; excess: of `zone_work`; xy: None in small strain."""
    corner, x, y, inverse_double_area, share = geometry
    pattern, elastic = stiffness
    if xy is None:
        whole, plastic, averaging = zone_work(
            corner, x, y, inverse_double_area, share, pattern, elastic, velocity, dt, book.stress, stress, excess
        )
    else:
        whole, plastic, averaging, of_shape = moving_zone_work(
            corner, share, pattern, elastic, velocity, dt, book.stress, stress, excess, xy, displacement
        )
        book.sums[SHAPE] += of_shape
    book.sums[OF_ZONES] += whole
    book.sums[PLASTIC] += plastic
    book.sums[AVERAGING] += averaging


@jit
def note_energies(done, strain, book):
    """Notes the ledger of the last whole step, the `done`-th of the run, with `strain` energy [J].

    A row of the step, `sums` and the works.
    """
    book.sums[STRAIN] = strain
    row = book.rows[book.noted[0]]
    row[0] = done
    for i in range(SUMS):
        row[1 + i] = book.sums[i]
    for i in range(len(book.work)):
        row[1 + SUMS + i] = book.work[i] - book.half_new[i]
    book.noted[0] += 1


class Ledger(Kept):
    """The ledger of one stage: `copy_before_step`, `book_motion`, `book_strain` in every step, `values` between the last two.

    Plain steps book in compiled code (`copy_before`, `book_points`, `book_zones`), which notes many rows; `histories` reads them.
    """

    KEPT = ("mass", "work", "half_new", "sums")  # of the Book

    def __init__(self, model, state):
        rayleigh = model.law.rayleigh
        self.with_zones = rayleigh is not None and rayleigh.stiffness is not None  # a part of damping is in the zones' work
        self.averages, self.moves = model.nodal is not None, shape.moving(model, state) is not None
        sums = np.zeros(SUMS)
        sums[BEGIN] = np.nan
        self.book = Book(
            state.velocity.copy(), np.empty_like(state.stress), masses(model, state) + state.added_mass, np.zeros(WORKS),
            np.zeros(WORKS), np.zeros(WORKS), sums, np.zeros((1, 1 + SUMS + WORKS)), np.zeros(1, dtype=np.int64),
            *(tuple(f for place, f in state.loads.items() if place.endswith(end)) or None for end in (WAVES, ARRIVING)),
        )  # fmt: skip

    def saved(self):
        """What changes, for a checkpoint inside of the stage."""
        return {name: getattr(self.book, name) for name in self.KEPT}

    def restore(self, saved):
        """Sets what `saved` gave."""
        of_book = {name: like(f"Ledger.{name}", getattr(self.book, name), value_of(saved, name)) for name in self.KEPT}
        self.book = self.book._replace(**of_book)

    @property
    def power(self):
        """Power [W] of the discs' forces on the rims in the last step."""
        return float(self.book.sums[POWER])

    @property
    def begun(self):
        """Whether the first step of the stage is booked."""
        return not np.isnan(self.book.sums[BEGIN])

    def book_of_rows(self, count):
        """The Book with room for `count` rows."""
        return self.book._replace(rows=np.zeros((count, self.book.rows.shape[1])), noted=np.zeros(1, dtype=np.int64))

    def copy_before_step(self, state):
        """Copies velocities and stresses before velocities change."""
        copy_before(state.velocity, state.stress, self.book)

    def book_motion(self, model, state, gravity, kick=None, rims=()):
        """Books the works of forces, after velocities have changed.

        kick [s]: time over which forces acted if it is less than a step; velocities are extrapolated back by a whole step.
        rims: of open windows; the forces of their discs have the power POWER in these velocities, and the work OF_DISCS.
        """
        nodes = np.concatenate([rim.nodes for rim in rims]) if rims else np.zeros(0, dtype=np.int64)
        push = np.concatenate([rim.force for rim in rims]) if rims else np.zeros((0, 2))
        book = self.book
        book_points(
            state.force, state.applied, model.weight_mass, masses(model, state), state.added_mass, model.fixed,
            float(gravity), seconds(state), state.velocity, kick, nodes, push, book,
        )  # fmt: skip
        if not self.begun:  # the motion before the stage does not count
            book.sums[BEGIN] = book.sums[KINETIC] + strain_energy(model, state)
            book.work[:] = book.half_new
            book.sums[MASSES] = 0.0

    def book_strain(self, model, state):
        """Books the works of stresses, after stresses have changed."""
        excess = None
        if model.nodal is not None:
            nodal = NodalPass(model, state)
            nodal.strains()
            excess = nodal.excess
        stiffness = model.pattern, model.law.elastic
        xy = shape.moving(model, state)
        book_zones(
            tuple(model.geometry),
            stiffness,
            state.velocity,
            seconds(state),
            state.stress,
            excess,
            xy,
            state.displacement,
            self.book,
        )

    def note(self, done, model, state):
        """Notes the energies of the last whole step, the `done`-th of the run."""
        self.book.noted[0] = 0  # there is one row
        note_energies(done, strain_energy(model, state), self.book)

    def values(self, model, state):
        """Energies {name: [J]} of the last whole step: NAMES; `averaging`, `dashpots`, `arriving` where there are such."""
        self.note(0, model, state)
        return {name: column[0] for name, column in self.columns(self.book.rows).items()}

    def histories(self, book, coupled, below=np.inf):
        """Takes the rows of steps `below` a number out of a Book; returns these steps and histories {name: list}.

        coupled: also power and work of the discs' forces on the rims.
        """
        noted = book.rows[: book.noted[0]].copy()
        taken, left = noted[noted[:, 0] < below], noted[noted[:, 0] >= below]
        book.rows[: len(left)], book.noted[0] = left, len(left)
        found = {f"energy_{name}": column for name, column in self.columns(taken).items()}
        if coupled:
            found |= {"interface_power": taken[:, 1 + POWER].tolist(), "interface_work": taken[:, 1 + OF_DISCS].tolist()}
        return taken[:, 0].astype(int).tolist(), found

    def columns(self, rows):
        """Energies {name: list [J]} of rows (n,17) of a Book."""
        sums, work = rows[:, 1 : 1 + SUMS].T, rows[:, 1 + SUMS :].T
        damping = -work[DAMPING]
        if self.with_zones:
            damping = damping + (-work[ZONES] - sums[OF_ZONES])
        gained = sums[KINETIC] + sums[STRAIN] - sums[BEGIN]
        error = gained + sums[PLASTIC] + sums[AVERAGING] + damping - sums[MASSES] - work[GRAVITY] - work[EXTERNAL]
        error = error - work[OF_DASHPOTS] - work[OF_WAVES] - sums[SHAPE]
        values = sums[KINETIC], sums[STRAIN], sums[PLASTIC], damping, work[EXTERNAL], work[GRAVITY], sums[MASSES], error
        found = dict(zip(NAMES, values, strict=True)) | ({"averaging": sums[AVERAGING]} if self.averages else {})
        if self.moves:
            found["shape"] = sums[SHAPE]
        if self.book.dashpots is not None:
            found["dashpots"] = -work[OF_DASHPOTS]
        if self.book.arriving is not None:
            found["arriving"] = work[OF_WAVES]
        return {name: column.tolist() for name, column in found.items()}
