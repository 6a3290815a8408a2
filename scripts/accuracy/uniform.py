"""A uniform stress in zones with a window of discs, brought to rest, and what the interface makes of it.

A block of 7 x 7 zones at 29 degrees, 3 x 3 of them a window (scripts/verification/coupling/block.py), filled with a square
lattice as stiff as the zones, or with a packing at random around which zones have the moduli that the packing has on the mean.
The outer sides are moved by a uniform strain, everything inside follows in the first step and comes to rest in static mode.
"""

from functools import lru_cache
from types import SimpleNamespace

import numpy as np
from verification.coupling.block import KN, SIDE, block
from verification.coupling.joined import rotation

from coupler_protocol.geometry import polygon_area
from coupler_protocol.interface.mapping import forces_to_nodes, velocities_to_discs
from dem_server.insitu.contact_stress import mean_stress
from dem_server.observe.unbalanced_ratio import unbalanced_ratio as ratio_of_discs
from dem_server.packing.packing import pack
from dem_server.pairs import contacts
from dem_server.step.contact_pass import contact_forces
from dem_server.step.motion import move_free
from fdm_server.coupling.rim_traction import traction_difference, zones_behind
from fdm_server.mesh.zone_sides import boundary_edges
from fdm_server.observe import fields
from fdm_server.step.gridpoint_pass import unbalanced_ratio as ratio_of_grid

TURNED, STRAIN, RATIO, LOOK, LIMIT = 0.5, 5e-6, 1e-6, 50, 50_000
COMPRESSION, SHEAR = np.diag([0.0, -1.0]), np.array([[0.0, 1.0], [1.0, 0.0]])
STRAINS = [rotation(a) @ e @ rotation(a).T for a in (0.0, 0.5) for e in (COMPRESSION, SHEAR)]  # along the segments
LATTICE = (KN / 3.0, KN / 2.0)  # bulk and shear modulus [Pa]


def errors(seed, per_segment, offset, mapping):
    """Errors (4,) of zones, P/l, moment and power: root mean squares over STRAINS; steps, discs.

    seed: of the packing (None: the lattice); offset: of control discs from their segments in radii of them.
    """
    packing, moduli = (None, LATTICE) if seed is None else packed(seed, per_segment)
    squares, steps = np.zeros(4), 0
    for strain in STRAINS:
        joined = block(
            TURNED, mapping=mapping, shift=0.5 * offset * SIDE / per_segment, per_segment=per_segment,
            filled=packing and (lambda *_: packing), moduli=moduli,
        )  # fmt: skip
        joined.grid_model.fixed[np.unique(boundary_edges(joined.grid_model.grid.zones))] = True
        strain = rotation(TURNED) @ strain @ rotation(TURNED).T
        begin(joined, STRAIN * strain)
        steps += rest(joined)
        squares += np.square([*of_stress(joined, stress_of(STRAIN * strain, *moduli)), *lost(joined, strain)])
    return np.sqrt(squares / len(STRAINS)), steps, len(joined.discs.x)


@lru_cache
def packed(seed, per_segment):
    """A packing of mean radius l / 2 per_segment and its bulk and shear modulus [Pa], isotropic ones as near as can be."""

    def filled(nodes, ring, table):
        size = {"radius": 0.5 * SIDE / per_segment, "spread": 0.25, "porosity": 0.16}
        table = SimpleNamespace(**vars(table), **size, packing="relaxed", confinement=1e-3 * KN)
        return pack(nodes, ring.xy, ring.radius, table, np.random.default_rng(seed))

    joined = block(TURNED, per_segment=per_segment, filled=filled)
    ring, radius = joined.disc_model.ring, joined.discs.radius
    found = SimpleNamespace(xy=joined.discs.x[ring:].copy(), radius=radius[ring:].copy())
    stress = []
    for strain in (np.diag([1.0, 0.0]), np.diag([0.0, 1.0]), SHEAR):
        joined = block(TURNED, per_segment=per_segment, filled=lambda *_: found)
        begin(joined, STRAIN * strain)
        rest(joined, grid_held=True)
        stress.append(mean_stress(contacts(joined.discs), polygon_area(joined.rim.nodes)) / STRAIN)
    (xxxx, yyxx, _), (xxyy, yyyy, _), (_, _, xyxy) = stress
    # C11 = K + 4G/3 and C12 = K - 2G/3 of the plane; 2G = sigma_xy / eps_xy, and along the axes C11 - C12
    sum_, difference = 0.5 * (xxxx + yyxx + xxyy + yyyy), 0.5 * (xxxx - yyxx - xxyy + yyyy)
    shear = 0.25 * (difference + xyxy)
    return found, (0.5 * sum_ - shear / 3.0, shear)


def begin(joined, strain):
    """Static mode, and a uniform strain (2,2) of everything, at rest."""
    joined.begin_static()
    joined.strain(strain)
    joined.grid.velocity[:] = 0.0
    joined.discs.v[:] = 0.0
    joined.discs.spin[:] = 0.0


def rest(joined, grid_held=False):
    """Steps until both codes' ratios are below RATIO; grid_held: the discs alone move."""
    for steps in range(LOOK, LIMIT, LOOK):
        for _ in range(LOOK):
            if grid_held:
                move_free(joined.disc_model, joined.discs, 0.0)
                contact_forces(joined.disc_model, joined.discs)
            else:
                joined.step()
        joined.hang()
        ratio = ratio_of_discs(joined.disc_model, joined.discs, 0.0)
        if ratio < RATIO and (grid_held or ratio_of_grid(joined.grid_model, joined.grid, 0.0) < RATIO):
            return steps
    raise ArithmeticError(f"not at rest after {LIMIT} steps: ratio of the discs {ratio:.1e}")


def stress_of(strain, bulk, shear):
    """Stress (4,) [Pa] xx, yy, zz, xy of a plane strain (2,2) for these moduli [Pa]."""
    mean = (bulk - 2.0 / 3.0 * shear) * np.trace(strain)
    return np.array([mean + 2.0 * shear * strain[0, 0], mean + 2.0 * shear * strain[1, 1], mean, 2.0 * shear * strain[0, 1]])


def of_stress(joined, wanted):
    """Errors of the stress of the zones beside the rim, over it, and of P/l over sigma n (rms)."""
    rim = SimpleNamespace(surface=None, nodes=joined.nodes, force=joined.rim.nodal_forces(joined.discs))
    found = fields.stress(joined.grid_model, joined.grid)[zones_behind(joined.grid_model, rim)]
    weight = np.array([1.0, 1.0, 0.0, 2.0])  # components of the tensor in the plane
    zones = np.sqrt(np.mean((found - wanted) ** 2 @ weight) / (wanted**2 @ weight))
    everywhere = np.tile(wanted, (len(joined.grid_model.zones), 1))
    return zones, traction_difference(joined.grid_model, joined.grid, rim, everywhere)


def lost(joined, gradient):
    """Moment and power that discs give and gridpoints do not get in a motion by `gradient`, sums over segments.

    Over sum |P| l, P: forces on the discs, and over the sum of the discs' powers without their signs.
    """
    rim, ring, discs = joined.rim, joined.rim.ring, joined.discs
    R, where = rim.discs, (ring.seg0, ring.seg1, ring.w0, ring.node)
    x, P, M = discs.x[:R], discs.force[:R], discs.moment[:R]
    v, spin, V = np.empty((R, 2)), np.empty(R), (rim.nodes - rim.nodes.mean(axis=0)) @ gradient.T
    velocities_to_discs(rim.nodes, V, *where, x, v, spin, rim.paper)
    power, moment = (P * v).sum(axis=1) + M * spin, _cross(x, P) + M
    without, F = np.zeros(2), np.empty_like(V)
    for segment in range(len(V)):
        own = ring.seg1 == segment
        forces_to_nodes(rim.nodes, *where, x, P * own[:, None], M * own, F, rim.paper)
        without += np.abs([_cross(rim.nodes, F).sum() - moment[own].sum(), (F * V).sum() - power[own].sum()])
    return without / [SIDE * np.hypot(*P.T).sum(), np.abs(power).sum()]


def _cross(a, b):
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
