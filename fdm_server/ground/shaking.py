"""Shaking: the motion of a side over seconds, from a CSV file (coupler_protocol/files/motion_csv.py).

v(t) is linear between the rows of the file, and zero before and after them.

    rigid        v = v(t + dt/2) at the gridpoints of the side in the step from t to t + dt
    compliant    f = 2 C v(t) in addition to the dashpots' f = -C v of a quiet side (quiet_sides.py)

On a compliant side v(t) is the velocity of the wave that arrives from the ground beyond. The force of the wave on the side, as a
stress 2 rho cS v across and 2 rho cP v along the normal, moves ground of the same impedance by exactly v(t); a wave from above
adds its own motion, and the dashpots absorb it.

Source: Joyner, W. B. & Chen, A. T. F. (1975), Bull. Seism. Soc. Am. 65, 1315-1336 (input through a viscous boundary); Lysmer &
Kuhlemeyer (1969).
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from coupler_protocol.compiled.jit import jit
from coupler_protocol.files import motion_csv
from fdm_server.mesh.grid_sides import motion_of, points_in, sides_of

ARRIVING = " arriving"  # added to the name of a place: the arriving wave's part of its forces


@jit
def velocity_at(now, time, velocity, axis):
    """Velocity [m/s] at the time `now` [s]; time (m,) [s], velocity (m,2) [m/s]."""
    if now < time[0] or now > time[-1]:
        return 0.0
    k = max(np.searchsorted(time, now), 1)
    share = (now - time[k - 1]) / (time[k] - time[k - 1])
    return velocity[k - 1, axis] + share * (velocity[k, axis] - velocity[k - 1, axis])


@jit
def carry(component, time, motion, driven, now, velocity):
    """Sets the velocities (N,2) of a rigid side, and `driven` (N,2), to those at the time `now` [s]."""
    v, prescribed = velocity.reshape(velocity.size), driven.reshape(driven.size)
    for i in range(len(component)):
        at = velocity_at(now, time, motion, component[i] % 2)
        v[component[i]] = prescribed[component[i]] = at


@jit
def push(nodes, resistance, time, motion, last, now, applied):
    """Updates the forces of the wave that arrives at a compliant side: `last` (N,2) [N], a part of `applied` (N,2) [N]."""
    vx, vy = velocity_at(now, time, motion, 0), velocity_at(now, time, motion, 1)
    for i in range(len(nodes)):
        n = nodes[i]
        for axis in range(2):
            force = 2.0 * (resistance[i, axis, 0] * vx + resistance[i, axis, 1] * vy)
            applied[n, axis] += force - last[n, axis]
            last[n, axis] = force


@jit
def carry_all(rigid, now, velocity):
    """`carry` for all rigid sides: a tuple of their arguments, or None."""
    if rigid is not None:
        for component, time, motion, driven in rigid:
            carry(component, time, motion, driven, now, velocity)


@jit
def push_all(compliant, now, applied):
    """`push` for all compliant sides: a tuple of their arguments, or None."""
    if compliant is not None:
        for nodes, resistance, time, motion, last in compliant:
            push(nodes, resistance, time, motion, last, now, applied)


@jit
def shake_velocities(shaken, seconds, velocity):
    """Moves rigid sides in a step of some seconds; shaken: of `Shaken.arguments`, with the time at which the step begins."""
    if shaken is not None:
        now, rigid, _ = shaken
        carry_all(rigid, now[0] + 0.5 * seconds, velocity)


@jit
def shake_forces(shaken, seconds, applied):
    """Counts a step of some seconds, and sets the forces of the next one on compliant sides."""
    if shaken is not None:
        now, _, compliant = shaken
        now[0] += seconds
        push_all(compliant, now[0], applied)


class Carried(NamedTuple):
    """A rigid side: n held components, flat positions in (N,2), and its motion at m times."""

    component: NDArray[np.int64]  # (n,)
    time: NDArray[np.float64]  # (m,) [s]
    motion: NDArray[np.float64]  # (m,2) [m/s]


class Pushed(NamedTuple):
    """A compliant side: n gridpoints with dashpots, and the motion that arrives at m times."""

    place: str
    nodes: NDArray[np.int64]  # (n,)
    resistance: NDArray[np.float64]  # (n,2,2) [N s/m]
    time: NDArray[np.float64]  # (m,) [s]
    motion: NDArray[np.float64]  # (m,2) [m/s]


class Shaken(NamedTuple):
    """Sides that shake in a stage."""

    rigid: tuple[Carried, ...]
    compliant: tuple[Pushed, ...]

    def arguments(self, state, now=0.0):
        """Argument of `shake_velocities` and `shake_forces`; now [s]: time since the stage began."""
        rigid = tuple((*side, state.driven) for side in self.rigid) or None
        compliant = tuple((*side[1:], state.loads[side.place + ARRIVING]) for side in self.compliant) or None
        return np.array([now]), rigid, compliant

    def move(self, state, middle):
        """Sets the velocities of rigid sides at the time `middle` [s] of a step."""
        carry_all(self.arguments(state)[1], middle, state.velocity)

    def apply(self, state, now):
        """Sets the forces on compliant sides at the time `now` [s]."""
        push_all(self.arguments(state)[2], now, state.applied)

    def end(self, state):
        """Ends the motion: rigid sides stay where they are, no wave arrives at compliant ones."""
        for side in self.rigid:
            state.driven.reshape(-1)[side.component] = state.velocity.reshape(-1)[side.component] = 0.0
        for side in self.compliant:
            state.applied -= state.loads.pop(side.place + ARRIVING)


def shaken(model, boundaries, dashpots, state=None):
    """The Shaken of a stage in which `boundaries` begin, or None; dashpots: those of its quiet sides; state: where it begins."""
    tables = [b for b in boundaries if b.shaking is not None]
    if not tables:
        return None
    rigid, compliant, sides = [], [], sides_of(model.grid)
    for boundary in tables:
        time, motion = motion_of_file(boundary.shaking)
        if boundary.is_quiet:
            own = next(side for side in reversed(dashpots) if side.place == boundary.place)
            compliant.append(Pushed(own.place, own.nodes, own.resistance, time, motion))
        else:
            points = points_in(model.grid, sides, boundary)
            component = np.concatenate([2 * points + axis for axis, _ in motion_of(boundary)])
            rigid.append(Carried(component[model.fixed.reshape(-1)[component]], time, motion))
    if state is not None:
        for side in compliant:
            state.loads[side.place + ARRIVING] = np.zeros_like(state.applied)
    return Shaken(tuple(rigid), tuple(compliant))


def motion_of_file(table):
    """Times (m,) [s] and velocities (m,2) [m/s] of a table `shaking`, with its factors; a column that is not used is zero."""
    found = motion_csv.read(table.file, "boundary.shaking.file")
    motion = np.zeros((len(found.time), 2))
    for column, factor in table.factors.items():
        motion[:, "xy".index(column)] = factor * found.velocity[column]
    return found.time, motion
