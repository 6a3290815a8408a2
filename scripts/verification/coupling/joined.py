"""Grid and discs in one process, joined by the product's own kernels, in the order of fdm_server/run.py and dem_server/run.py.

For cases that no scene can say: bars, chains, lattices. A rim may be open: a bar has one end of two gridpoints, whose loop of
two segments carries discs on the first only.
"""

from types import SimpleNamespace

import numpy as np

from colluvium import Scene
from dem_server.coupling.rim import Rim
from dem_server.effects.bond import BONDED
from dem_server.observe.energy import stored
from dem_server.step import clock as disc_clock
from dem_server.step.contact_pass import contact_forces
from dem_server.step.motion import move_free
from fdm_server.coupling import common_step
from fdm_server.effects.damping import Damping
from fdm_server.mesh.grid import build_grid
from fdm_server.model import build_model, new_state
from fdm_server.observe.energy import strain_energy
from fdm_server.step import clock as grid_clock
from fdm_server.step.gridpoint_pass import update_velocities
from fdm_server.step.zone_pass import advance
from verification import as_a_run


class Joined:
    """A grid and the discs on its rim. Velocities stand half a step before positions and forces.

    grid, discs: (Model, State) of either code; nodes (K,): gridpoints of the rim; ring: the coupler_protocol.interface.ring.Ring
    upon them; half_mass: whether they carry the inner shares of the control discs, as in the product.
    """

    def __init__(self, grid, discs, nodes, ring, mapping="work-consistent", half_mass=True):
        (self.grid_model, self.grid), (self.disc_model, self.discs) = grid, discs
        self.nodes, self.rim, self.kick, self.substeps = nodes, Rim(ring, mapping), None, 1
        self.inner = self.rim.inner_mass(self.discs) if half_mass else np.zeros(len(nodes))

    def begin(self, share, from_rest=True, substeps=1):
        """Real time without damping, steps of `share` of the grid's, the rim's and the discs' stable ones.

        substeps: of the discs in one of the grid.

        from_rest: velocities are those of now and zero; otherwise they are set afterwards, half a step before now.
        """
        self.grid_model = grid_clock.begin(self.grid_model, self.grid, Damping(local=0.0), share)
        self.disc_model = disc_clock.begin(self.disc_model, self.discs, None, share)
        self.grid.added_mass[self.nodes] = self.inner
        rim = SimpleNamespace(nodes=self.nodes, sums=self.rim.stiffness_sums(self.disc_model, self.discs))
        rim.answer = SimpleNamespace(dt_limit=disc_clock.longest_step(self.disc_model, self.discs, substeps))
        self.grid_model = common_step.set_common_step(self.grid_model, self.grid, [rim])
        self.take(self.grid.dt, from_rest, substeps)

    def begin_static(self, local=0.7):
        """Static mode: steps of 1, scaled masses with those of the interface's mass rule, local damping of both codes."""
        damping = Damping(local=local)
        self.grid_model = grid_clock.begin(self.grid_model, self.grid, damping)
        self.disc_model = disc_clock.begin(self.disc_model, self.discs, damping)
        self.grid.added_mass[self.nodes] = self.rim.stiffness_sums(self.disc_model, self.discs)
        self.kick = None

    def take(self, dt, from_rest=True, substeps=1):
        """Steps of `dt` [s], of the discs' as many times shorter as there are substeps; the whole stable step is their limit."""
        self.grid.dt, self.substeps = dt, substeps
        self.disc_model = disc_clock.divided(self.disc_model, self.discs, dt, substeps)
        self.discs.dt = 0.0 if from_rest else dt / substeps
        self.kick = 0.5 * dt if from_rest else None

    def step(self, gravity=0.0):
        """One step; returns velocities and spins half a step (of each side) after its beginning, as `motion` has them."""
        grid, discs = self.grid, self.discs
        self.hang(gravity)
        update_velocities(self.grid_model, grid, gravity, self.kick)
        self.kick = None
        move_free(self.disc_model, discs, gravity)
        after = self.motion()
        self._complete()
        for _ in range(self.substeps - 1):
            move_free(self.disc_model, discs, gravity)
            self._complete()
        advance(self.grid_model, grid)
        return after

    def strain(self, gradient):
        """A step of 1 in which everything moves by a uniform displacement gradient (2,2)."""
        grid, discs, free = self.grid, self.discs, slice(self.disc_model.ring, None)
        grid.velocity[:] = self.grid_model.grid.xy @ gradient.T
        discs.v[free] = discs.x[free] @ gradient.T
        discs.x[free] += discs.v[free]
        self._complete()
        advance(self.grid_model, grid)

    def _complete(self):
        discs = self.discs
        self.rim.move(discs, self.grid.velocity[self.nodes])
        contact_forces(self.disc_model, discs)
        if discs.next_dt < discs.dt:
            raise ArithmeticError(f"new contacts ask for steps of {discs.next_dt:.4g} s, {discs.dt:.4g} s were agreed")

    def step_with_energy(self):
        """One step; returns the energy [J] at its beginning: v- . M v+ / 2 (half a step before and after), and what is stored."""
        stored, before = self.stored(), self.motion()
        return stored + 0.5 * float(np.sum(self.masses() * before * self.step()))

    def kinetic(self):
        """Kinetic energy [J] of the velocities as they are."""
        return 0.5 * float(np.sum(self.masses() * self.motion() ** 2))

    def motion(self):
        """Velocities and spins of all that moves freely, flat."""
        return np.concatenate([self.grid.velocity.ravel(), self.discs.disc[self.disc_model.ring :, 2:5].ravel()])

    def masses(self):
        """Masses and inertia that go with `motion`."""
        grid = np.repeat(self.grid_model.weight_mass + self.grid.added_mass, 2)
        return np.concatenate([grid, self.discs.disc[self.disc_model.ring :][:, [6, 6, 7]].ravel()])

    def hang(self, gravity=0.0):
        """The discs' forces (K,2) [N] on the rim; they are applied there."""
        force = self.rim.nodal_forces(self.discs)
        self.grid.applied[self.nodes] = force
        self.grid.applied[self.nodes, 1] -= gravity * self.inner
        return force

    def stored(self):
        """Elastic energy of zones and contacts [J]."""
        return strain_energy(self.grid_model, self.grid) + stored(self.disc_model, self.discs)

    def momentum(self):
        """Momentum (2,) [N s] of everything that moves, and the sum of its parts' sizes."""
        mass, free = self.grid_model.weight_mass + self.grid.added_mass, slice(self.disc_model.ring, None)
        parts = np.vstack([mass[:, None] * self.grid.velocity, self.discs.mass[free, None] * self.discs.v[free]])
        return parts.sum(axis=0), np.abs(parts).sum()


def zones(length, height, size, bulk, shear, density, turned=0.0, boundary=None):
    """Model and State of a box of elastic zones at rest, turned about the origin."""
    ground = as_a_run.material(bulk, shear, density)
    mesh = {"kind": "box", "length": length, "height": height, "zone_size": size}
    scene = Scene(**as_a_run.tables(mesh, ground, as_a_run.IDLE, boundary))
    grid = build_grid(scene)
    model = build_model(scene, grid._replace(xy=grid.xy @ rotation(turned).T))
    return model, new_state(model)


def rotation(angle):
    """Matrix (2,2) that turns by an angle [rad]."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s], [s, c]])


def glue(state, near=1e-9):
    """Bond all pairs closer than `near` [m], without force where there are reference gaps."""
    state.bond_state[gaps(state) < near] = BONDED
    if state.reference_gap is not None:
        keep_gaps(state)


def keep_gaps(state):
    """Bonds carry no normal force at the gaps they have."""
    state.reference_gap[:] = np.where(state.bond_state == BONDED, gaps(state), 0.0)


def gaps(state):
    """Gaps (m,) [m] of all listed pairs."""
    a, b = state.first.astype(int), state.second.astype(int)
    return np.hypot(*(state.x[b] - state.x[a]).T) - state.radius[a] - state.radius[b]
