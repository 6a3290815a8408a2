"""A dense box as another engine needs it, and what our own discs do in it: the work that must be the same.

A box is judged twice. In the *trial* all discs start from the same places with the same velocities, contacts without shear
force, and move undamped in real time for `TRIAL_STEPS` steps: velocities must come out the same. After the *timed* steps, at
rest, the energy stored in the normal springs,

    E = sum kn g^2 / 2   over all g < 0,                                         (1)

must be the same; it needs positions only.
"""

from copy import deepcopy
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from bench.dem import SIZES, Case
from bench.dense_box import BOND, FRICTION, dense_box
from dem_server.effects.bond import BONDED
from dem_server.pairs import contacts
from dem_server.step.contact_pass import contact_forces
from dem_server.step.cycle import advance, in_real_time

TRIAL_STEPS, TRIAL_FRACTION = 100, 0.1  # steps, and their share of the stable one
AMPLITUDE = {False: 2e-4, True: 3e-4}  # of the trial's displacements [m], without and with bonds: about half an overlap


@dataclass(frozen=True)
class Box:
    """Discs at rest, the `held` ones first.

    xy (n, 2), radius (n,) [m]; held: number of discs that never move; mass (n,) [kg/m]; normal, shear: contact stiffnesses
    [N/m]; friction [-]; bonds (m, 2): bonded pairs, or None; strength [N] of a bond; dt: time step [s]; velocity (n, 2) [m/s]
    at the start of the trial.
    """

    xy: np.ndarray
    radius: np.ndarray
    held: int
    mass: np.ndarray
    normal: float
    shear: float
    friction: float
    bonds: np.ndarray | None
    strength: float
    dt: float
    velocity: np.ndarray

    @property
    def free(self):
        """Number of discs that move."""
        return len(self.radius) - self.held

    def viscosity(self, ratio=0.2):
        """Dashpot [N s/m] of a mean contact with `ratio` of critical damping."""
        return 2.0 * ratio * np.sqrt(0.5 * self.mass[self.held :].mean() * self.normal)


def case_of(size, bonded):
    """Our own settled box of `size` discs."""
    return Case(*dense_box(*SIZES[size], friction=FRICTION, bond=BOND if bonded else None))


def box_of(case):
    """The box of a case, as it is timed."""
    return as_box(case, *start_of_trial(case))


def trial_of(case, stress_free=False, equal_radii=False, behind=False):
    """The box of a trial, and the velocities (n, 2) [m/s] of our discs half a step before its end."""
    model, state = start_of_trial(case, stress_free, equal_radii, behind)
    box = as_box(case, model, state)
    advance(model, state, 0.0, TRIAL_STEPS)
    return box, state.v.copy()


def as_box(case, model, state):
    """The box of a state at the start of its trial; bonds are those of the case."""
    pairs, law = contacts(case.state), model.law
    bonds, kind = None, pairs.kind[0]
    if law.bond is not None:
        held = pairs.bond_state == BONDED
        bonds = np.column_stack([pairs.disc_a[held], pairs.disc_b[held]])
    return Box(
        xy=state.x.copy(), radius=state.radius.copy(), held=model.ring, mass=state.mass.copy(),
        normal=float(law.spring.normal[kind]), shear=float(law.spring.shear[kind]), friction=FRICTION.coefficient,
        bonds=bonds, strength=BOND.tension, dt=state.next_dt, velocity=state.v.copy(),
    )  # fmt: skip


def start_of_trial(case, stress_free=False, equal_radii=False, behind=False):
    """Model and State (copies) at the start of the trial.

    stress_free: contacts get reference gaps that leave no force, as
    bonds of some engines do; equal_radii: all discs as small as the smallest, so that both levers of a contact are half the
    distance of its centres, as bonds of some engines take them; behind: the velocities are those of half a step before, and
    the way of that step has been slip, as in engines that compute forces before they move anything.
    """
    model = replace(case.model, law=case.model.law._replace(damping=None))
    state, bonded = deepcopy(case.state), model.law.bond is not None
    if equal_radii:
        state.radius[:] = model.smallest_radius
    state.weight[:] = model.density * np.pi * state.radius**2
    if stress_free:
        pairs = contacts(state)
        state.reference_gap = np.zeros_like(state.normal)
        state.reference_gap.ravel()[pairs.slot] = pairs.gap
    model = in_real_time(model, state, TRIAL_FRACTION)
    state.shear[:] = 0.0
    contact_forces(model, state)
    speed = AMPLITUDE[bonded] * np.sqrt(model.law.spring.normal[0] / state.mass[model.ring :].mean())
    state.v[model.ring :] = speed * np.random.default_rng(3).standard_normal((case.free, 2))
    if behind:
        state.dt = state.next_dt
        contact_forces(model, state)
    return model, state


def stored_energy(box, xy):
    """Eq (1) [J/m] of discs at `xy` (n, 2)."""
    a, b = cKDTree(xy).query_pairs(2.0 * box.radius.max(), output_type="ndarray").T
    moves = (a >= box.held) | (b >= box.held)
    a, b = a[moves], b[moves]
    gap = np.hypot(*(xy[b] - xy[a]).T) - box.radius[a] - box.radius[b]
    return 0.5 * box.normal * float((np.minimum(gap, 0.0) ** 2).sum())
