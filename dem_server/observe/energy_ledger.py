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
    dashpots   of viscous dashpots at contacts, on the changes of gap and slip (pair_work.py)
    masses     change of T with the scaled masses of static mode, sum (M' - M) v-^2 / 2

    error = T - T0 + U - U0 + friction + bonds + dashpots + damping - masses - gravity - ring

Bodies and contacts are booked separately. With linear springs of constant direction the error is round-off, also with damping,
slip and breakage in shear. The error contains what the trapezoidal rule misses when contacts close, open or turn within a step.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from coupler_protocol.compiled.jit import jit
from coupler_protocol.files.kept import Kept, like, value_of
from dem_server.effects.histories import PairHistory, copied, history_of
from dem_server.model import INERTIA, MASS, SPIN, VX, VY, Listed
from dem_server.observe import energy
from dem_server.observe.pair_work import Viscous, dashpot_losses, pair_losses, viscous_of
from dem_server.step.clumps import resultant
from dem_server.step.contact_pass import make_current

GRAVITY, RING, DAMPING = range(3)
KINETIC, STORED, FRICTION, BONDS, MASSES, POWER, OF_RING, BEGIN, KICK, DASHPOTS, SUMS = range(11)  # of Book.sums, and number
NAMES = ("kinetic", "stored", "friction", "bonds", "damping", "masses", "gravity", "ring", "error")


class Book(NamedTuple):
    """What a Ledger keeps, for compiled code. Arrays of c clumps are None without clumps.

    old (n,3), old_body (c,3): velocities and spins before the kick; on_body (c,3): forces and moments on clumps then; before: a
    PairHistory before contact forces change. mass, inertia (n,), body_mass (c,2): masses and inertia in the last step. work (3,)
    [J]: GRAVITY, RING, DAMPING up to half a step ahead of the last whole step; half_old, half_new (3,): of the halves of the last
    step. sums (10,): T, U, friction, bonds, masses [J]; power [W] of the contact forces on the control discs, its sum over time
    [J]; T0 + U0, NaN before the first step; time [s] over which forces act in the step; dashpots [J]. rows (n,14), noted (1,):
    see `note_energies`. viscous: parameters of the dashpots, None without any.
    """

    old: NDArray[np.float64]
    old_body: NDArray[np.float64] | None
    on_body: NDArray[np.float64] | None
    before: PairHistory
    mass: NDArray[np.float64]
    inertia: NDArray[np.float64]
    body_mass: NDArray[np.float64] | None
    work: NDArray[np.float64]
    half_old: NDArray[np.float64]
    half_new: NDArray[np.float64]
    sums: NDArray[np.float64]
    rows: NDArray[np.float64]
    noted: NDArray[np.int64]
    viscous: Viscous | None


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
        if clumps is not None:  # noqa: SIM102 (numba prunes this line only if it stands alone)
            if clumps.body[i] >= 0:
                continue
        half_old[GRAVITY] -= 0.5 * dt * gravity * weight[i] * old[i, 1]
        half_new[GRAVITY] -= 0.5 * dt * gravity * weight[i] * disc[i, VY]
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
            pull = gravity * energy.weight_of_clump(c, clumps, weight)
            half_old[GRAVITY] -= 0.5 * dt * pull * old_body[c, 1]
            half_new[GRAVITY] -= 0.5 * dt * pull * body[c, VY]
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


@jit
def copy_velocities(moved, old):
    """Copies velocities and spins of bodies (b,8)."""
    for i in range(moved.shape[0]):
        for k in range(3):
            old[i, k] = moved[i, VX + k]


@jit
def extrapolate_back(old, moved, ratio):
    """Extrapolates velocities `old` (b,3) to a whole step before those of `moved` (b,8); `ratio`: step over their distance."""
    for i in range(moved.shape[0]):
        for k in range(3):
            now = moved[i, VX + k]
            old[i, k] = now - (now - old[i, k]) * ratio


@jit
def copy_before(disc, load, weight, clumps, gravity, kick, book):
    """Copies velocities, and forces on clumps, whose levers turn with them; kick [s]: time over which forces act."""
    copy_velocities(disc, book.old)
    if clumps is not None:
        copy_velocities(clumps.motion, book.old_body)
        forces_on_clumps(disc, load, weight, clumps, gravity, book.on_body)
    book.sums[KICK] = kick


@jit
def book_bodies(disc, load, weight, clumps, ring, gravity, dt, book):
    """Books the works of forces on bodies, after all discs have moved and before contacts are computed."""
    sums = book.sums
    sums[MASSES] += mass_work(disc, clumps, ring, book.mass, book.inertia, book.body_mass, book.old, book.old_body)
    if sums[KICK] != dt:  # velocities are extrapolated back by a whole step
        extrapolate_back(book.old, disc, dt / sums[KICK])
        if clumps is not None:
            extrapolate_back(book.old_body, clumps.motion, dt / sums[KICK])
    sums[KINETIC] = body_work(
        disc, load, weight, clumps, ring, gravity, dt, book.old, book.old_body, book.on_body, book.half_old, book.half_new
    )
    for name in range(len(book.work)):
        book.work[name] += book.half_old[name] + book.half_new[name]
    sums[POWER] = energy.ring_power(load[:ring], disc)
    sums[OF_RING] += sums[POWER] * dt


@jit
def book_pairs(disc, listed, history, spring, parallel_bond, dt, book):
    """Books the losses of contacts, after contact forces have changed; listed, history: a Listed and a PairHistory."""
    friction, bonds = pair_losses(disc, listed, dt, book.before, history, spring, parallel_bond)
    book.sums[FRICTION] += friction
    book.sums[BONDS] += bonds
    book.sums[DASHPOTS] += dashpot_losses(disc, listed, dt, book.old, book.sums[KICK], book.before, history, book.viscous)


@jit
def note_energies(done, stored, book):
    """Notes the ledger of the last whole step, the `done`-th of the run, with `stored` energy [J], before its contacts change.

    A row of the step, `sums` and the three works.
    """
    book.sums[STORED] = stored
    row = book.rows[book.noted[0]]
    row[0] = done
    for i in range(SUMS):
        row[1 + i] = book.sums[i]
    for i in range(len(book.work)):
        row[1 + SUMS + i] = book.work[i] - book.half_new[i]
    book.noted[0] += 1


class Ledger(Kept):
    """The ledger of one stage: `copy_before_step`, `book_motion`, `book_contacts` in every step, `values` between the last two.

    Its power is that of the contact forces on the control discs in their velocities half a step later, as at the rim's nodes
    in the grid. Plain steps book in compiled code (`copy_before`, `book_bodies`, `book_pairs`), which notes many rows;
    `histories` reads them.
    """

    KEPT = ("mass", "inertia", "body_mass", "work", "half_new", "sums")  # of the Book

    def __init__(self, model, state):
        clumps, sums = state.clumps, np.zeros(SUMS)
        sums[BEGIN] = np.nan
        self.book = Book(
            state.disc[:, VX : SPIN + 1].copy(),
            None if clumps is None else clumps.motion[:, VX : SPIN + 1].copy(),
            None if clumps is None else np.zeros((len(clumps.motion), 3)),
            history_of(state),
            state.mass.copy(),
            state.inertia.copy(),
            None if clumps is None else clumps.motion[:, MASS : INERTIA + 1].copy(),
            np.zeros(3),
            np.zeros(3),
            np.zeros(3),
            sums,
            np.zeros((1, 1 + SUMS + 3)),
            np.zeros(1, dtype=np.int64),
            viscous_of(model.law),
        )

    def saved(self):
        """What changes, for a checkpoint inside of the stage."""
        return {name: getattr(self.book, name) for name in self.KEPT}

    def restore(self, saved):
        """Sets what `saved` gave."""
        of_book = {name: like(f"Ledger.{name}", getattr(self.book, name), value_of(saved, name)) for name in self.KEPT}
        self.book = self.book._replace(**of_book)

    @property
    def power(self):
        """Power [W] of the contact forces on the control discs in the last step."""
        return float(self.book.sums[POWER])

    def book_of_rows(self, state, count):
        """The Book with room for `count` rows, and for the histories of the present list of pairs."""
        rows = np.zeros((count, self.book.rows.shape[1]))
        return self.book._replace(before=copied(state), rows=rows, noted=np.zeros(1, dtype=np.int64))

    def copy_before_step(self, state, gravity):
        """Copies velocities, and forces on clumps, before velocities change in the step State.next_dt."""
        kick = 0.5 * (state.dt + state.next_dt)
        copy_before(state.disc, state.load, state.weight, state.clumps, float(gravity), kick, self.book)

    def book_motion(self, model, state, gravity):
        """Books the motion, after all discs have moved and before contacts are computed."""
        book = self.book
        book_bodies(state.disc, state.load, state.weight, state.clumps, model.ring, float(gravity), state.dt, book)
        if np.isnan(book.sums[BEGIN]):  # the motion before the stage does not count
            book.sums[BEGIN] = book.sums[KINETIC] + energy.stored(model, state)
            book.work[:] = book.half_new
            book.sums[MASSES] = 0.0

    def copy_contacts(self, model, state):
        """Copies contact histories before contact forces change, in the order of the list that `contact_forces` will use."""
        make_current(model, state)
        self.book = self.book._replace(before=copied(state))

    def book_contacts(self, model, state):
        """Books losses of contacts, after contact forces have changed."""
        law = model.law
        book_pairs(state.disc, Listed(*state.listed), history_of(state), law.spring, law.parallel_bond, state.dt, self.book)

    def note(self, done, model, state):
        """Notes the energies of the last whole step, the `done`-th of the run, before its contacts change."""
        self.book.noted[0] = 0  # there is one row
        note_energies(done, energy.stored(model, state), self.book)

    def values(self, model, state):
        """Energies {name: [J]} of the last whole step, before its contacts change: NAMES."""
        self.note(0, model, state)
        return {name: column[0] for name, column in self.columns(self.book.rows).items()}

    def histories(self, book=None):
        """Takes all rows out of a Book; returns their steps, and histories {name: list}."""
        book = self.book if book is None else book
        rows = book.rows[: book.noted[0]].copy()
        book.noted[0] = 0
        found = {f"energy_{name}": column for name, column in self.columns(rows).items()}
        found |= {"interface_power": rows[:, 1 + POWER].tolist(), "interface_work": rows[:, 1 + OF_RING].tolist()}
        return rows[:, 0].astype(int).tolist(), found

    def columns(self, rows):
        """Energies {name: list [J]} of rows (n,14) of a Book: NAMES, and `dashpots` where there are any."""
        sums, work = rows[:, 1 : 1 + SUMS].T, rows[:, 1 + SUMS :].T
        known = sums[FRICTION] + sums[BONDS] - work[DAMPING] - sums[MASSES] - work[GRAVITY] - work[RING]
        error = sums[KINETIC] + sums[STORED] - sums[BEGIN] + known + sums[DASHPOTS]
        values = (
            sums[KINETIC], sums[STORED], sums[FRICTION], sums[BONDS], -work[DAMPING], sums[MASSES], work[GRAVITY], work[RING],
            error,
        )  # fmt: skip
        found = dict(zip(NAMES, values, strict=True)) | ({} if self.book.viscous is None else {"dashpots": sums[DASHPOTS]})
        return {name: column.tolist() for name, column in found.items()}
