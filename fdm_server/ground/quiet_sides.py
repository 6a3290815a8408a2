"""Quiet sides (Lysmer & Kuhlemeyer 1969): dashpots absorb arriving waves as if the ground continued beyond the side.

On a part of a side with length l and normal n the forces of the dashpots are

    f = -rho l [cP (v.n) n + cS (v - (v.n) n)]        rho cP = sqrt(rho (K + 4G/3)), rho cS = sqrt(rho G)

half of it at each end, v the velocity half a step earlier; the reflected share of a wave is omega dt/4. These forces are added to
the reaction of the side when it became quiet. Of several quiet tables for a part of a side the last one counts, and a component
of a gridpoint that a later table holds or moves has no dashpot.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from coupler_protocol.compiled.jit import jit
from fdm_server.mesh.grid_sides import edges_of, motion_of, points_in, sides_of

HELD, WAVES = " held", " waves"  # added to the name of a place: the reaction that remains, and the forces of the dashpots


@jit
def absorb(nodes, resistance, last, velocity, applied):
    """Updates the forces of dashpots for the present velocities: `last` (N,2) [N], which are part of `applied` (N,2) [N]."""
    for i in range(len(nodes)):
        n = nodes[i]
        for axis in range(2):
            now = -(resistance[i, axis, 0] * velocity[n, 0] + resistance[i, axis, 1] * velocity[n, 1])
            applied[n, axis] += now - last[n, axis]
            last[n, axis] = now


@jit
def absorb_all(quiet, velocity, applied):
    """`absorb` for all quiet sides: a tuple of their arguments, or None."""
    if quiet is not None:
        for nodes, resistance, last in quiet:
            absorb(nodes, resistance, last, velocity, applied)


class Dashpots(NamedTuple):
    """Dashpots on n gridpoints."""

    place: str
    nodes: NDArray[np.int64]  # (n,)
    resistance: NDArray[np.float64]  # (n,2,2) [N s/m]

    def apply(self, state):
        """Updates the applied forces for the present velocities."""
        absorb(*self.arguments(state), state.velocity, state.applied)

    def arguments(self, state):
        """Arguments `nodes`, `resistance`, `last` of `absorb`."""
        return self.nodes, self.resistance, state.loads[self.place + WAVES]


def keep_reaction(model, state, boundary, gravity):
    """Adds the present reaction of a side to the constant loads, before the side becomes free; gravity [m/s2]."""
    if boundary.place + WAVES in state.loads:
        return
    points = points_in(model.grid, sides_of(model.grid), boundary)
    lacking = -(state.force[points] + state.applied[points])
    lacking[:, 1] += gravity * model.weight_mass[points]
    held = np.zeros_like(state.applied)
    held[points] = np.where(model.fixed[points], lacking, 0.0)
    state.loads[boundary.place + HELD] = held
    state.loads[boundary.place + WAVES] = np.zeros_like(held)
    state.applied += held


def all_dashpots(model, boundaries):
    """Dashpots of the quiet ones of the boundaries that act, in their order."""
    last = {b.place: k for k, b in enumerate(boundaries) if b.is_quiet}
    return tuple(dashpots(model, boundaries[k], boundaries[k + 1 :]) for k in sorted(last.values()))


def dashpots(model, boundary, later=()):
    """Dashpots of a quiet boundary, on all sides of zones with both ends in its range; later: boundaries that replace it."""
    sides = sides_of(model.grid)
    points = points_in(model.grid, sides, boundary)
    edges = edges_of(model.grid, boundary.on)
    edges = edges[np.isin(edges, points).all(axis=1)]
    for other in later:
        if other.is_quiet and other.on == boundary.on:
            edges = edges[~np.isin(edges, points_in(model.grid, sides, other)).all(axis=1)]
    owner = {}
    for zone, corners in enumerate(model.zones.tolist()):
        owner |= {pair: zone for pair in zip(corners, corners[1:] + corners[:1], strict=True)}
    there = [k for k, edge in enumerate(edges.tolist()) if tuple(edge) in owner]
    edges = edges[there]
    zone = np.array([owner[tuple(edge)] for edge in edges.tolist()], dtype=np.int64)
    law = model.material_law.elastic[model.grid.material[model.zone[zone]]]
    density = model.zone_density[zone]
    p, s = np.sqrt(density * (law[:, 0] + law[:, 1])), np.sqrt(density * law[:, 1])
    along = model.grid.xy[edges[:, 1]] - model.grid.xy[edges[:, 0]]
    length = np.hypot(*along.T)
    normal = np.column_stack([along[:, 1], -along[:, 0]]) / length[:, None]
    nn = np.einsum("ei,ej->eij", normal, normal)
    each = 0.5 * length[:, None, None] * (s[:, None, None] * np.eye(2) + (p - s)[:, None, None] * nn)
    total = np.zeros((len(model.grid.xy), 2, 2))
    np.add.at(total, edges[:, 0], each)
    np.add.at(total, edges[:, 1], each)
    for other in later:
        if not other.is_quiet and not other.loads:
            for axis, _ in motion_of(other):
                total[points_in(model.grid, sides, other), axis] = 0.0
    return Dashpots(boundary.place, points, total[points])
