"""Kinetic damping: in every step in which the kinetic energy of the grid has fallen, all velocities begin again from zero.

At its peak the kinetic energy says that the ground passes an equilibrium. Between peaks nothing damps, so that the ground comes
to rest in a quarter to an eighth of the steps that local damping takes (docs/design/0005). Energies are those of the masses of
static mode, in which it acts; discs keep their motion, which their own damping takes.

Sources: Cundall, P. A. (1976), Explicit finite-difference methods in geomechanics; Barnes, M. R. (1999), Int. J. Space
Struct. 14.
"""

import numpy as np

from coupler_protocol.compiled.jit import jit
from coupler_protocol.files.kept import Kept
from fdm_server.step.gridpoint_pass import kinetic_kernel
from fdm_server.step.present_shape import masses


@jit
def take_momentum(mass, added_mass, velocity, before):
    """Stops all gridpoints if their kinetic energy is less than `before` (1,) [J], which becomes the present one."""
    energy = kinetic_kernel(mass, added_mass, velocity)
    if energy < before[0]:
        for n in range(velocity.shape[0]):
            velocity[n, 0] = velocity[n, 1] = 0.0
        energy = 0.0
    before[0] = energy


@jit
def take_momentum_of(mass, added_mass, velocity, before):
    """`take_momentum`, unless `before` is None: a stage with other damping."""
    if before is not None:
        take_momentum(mass, added_mass, velocity, before)


class Momentum(Kept):
    """Kinetic damping of a stage; before (1,): kinetic energy of the step before [J]."""

    KEPT = ("before",)

    def __init__(self):
        self.before = np.zeros(1)

    def take(self, model, state):
        """Stops all gridpoints if the kinetic energy has fallen in this step."""
        take_momentum(masses(model, state), state.added_mass, state.velocity, self.before)
