"""A block of zones with a square window full of bonded discs, at any angle: a square lattice matched to the zones, or a packing.

Zones of l = 0.4 m, discs of R = l/8 (or l/2 over any whole number) on a lattice of spacing s = 2 R, control discs among them.
Contacts kn = ks in a square lattice are a continuum of plane stiffness C11 = kn, C12 = 0, G = kn/2: K = kn/3. Discs weigh what
zones weigh: rho s^2.
"""

from types import SimpleNamespace

import numpy as np

from coupler_protocol.interface.ring import Ring, build_ring
from dem_server.effects.bond import Bond
from dem_server.effects.spring import Spring
from dem_server.model import build_model
from dem_server.step.contact_pass import contact_forces
from fdm_server.ground.removed_zones import cut_window
from fdm_server.mesh.window_zones import rim_of
from verification.coupling.joined import Joined, glue, keep_gaps, rotation, zones
from verification.discrete.discs import soil_discs

SIDE, R, KN, DENSITY = 0.4, 0.05, 1e8, 2000.0


def block(
    turned=0.5, around=2, across=3, mapping="work-consistent", shift=0.0, kn=KN, per_segment=4, filled=None, moduli=None
):  # fmt: skip
    """Zones with a window of `across` x `across` of them and `around` on each side, joined with the discs; not begun.

    shift: control discs between nodes stand so far outside their segment [m];
    kn: stiffness [N/m]; per_segment: control discs a segment; filled: what fills the window, a function of its rim's gridpoints
    (K,2), its Ring and the table of discs, for a packing with .xy (n,2) and .radius (n,) (None: the lattice); moduli: bulk and
    shear modulus of the zones (None: those of the lattice) [Pa].
    """
    cells, radius = across + 2 * around, 0.5 * SIDE / per_segment
    bulk, shear = moduli or (kn / 3.0, kn / 2.0)
    model, state = zones(cells * SIDE, cells * SIDE, SIDE, bulk, shear, DENSITY, turned)
    grid = model.grid
    mask = np.all([(a >= around) & (a < around + across) for a in (grid.column, grid.row)], axis=0)
    nodes = rim_of(grid, mask)
    model, state, _ = cut_window(model, state, mask)
    ring = build_ring(grid.xy[nodes], radius) if per_segment > 1 else on_nodes(grid.xy[nodes])
    table = soil_discs(
        spring=Spring(normal=kn, shear=kn), friction=None, damping=None, stiffness="contact",
        density=DENSITY * 4.0 / np.pi, bond=Bond(tension=1e30, shear=1e30),
    )  # fmt: skip
    if filled is not None:
        packing = filled(grid.xy[nodes], ring, table)
    else:
        inside = around * SIDE + 2.0 * radius * np.arange(1, round(across * SIDE / (2.0 * radius)))
        xy = np.stack(np.meshgrid(inside, inside), axis=-1).reshape(-1, 2) @ rotation(turned).T
        packing = SimpleNamespace(xy=xy, radius=np.full(len(xy), radius))
    disc_model, discs = build_model(ring.xy, ring.radius, packing, table)
    contact_forces(disc_model, discs)
    glue(discs)
    if shift:
        between = np.flatnonzero(ring.node < 0)
        along = (np.roll(grid.xy[nodes], -1, axis=0) - grid.xy[nodes])[ring.seg0[between]] / SIDE
        discs.x[between] += shift * np.column_stack([along[:, 1], -along[:, 0]])
        discs.origin[:] = discs.x
        keep_gaps(discs)
    contact_forces(disc_model, discs)
    return Joined((model, state), (disc_model, discs), nodes, ring, mapping)


def on_nodes(nodes):
    """A ring with discs on the gridpoints (K,2) of a rim of equal segments only, which the product does not build."""
    own = np.arange(len(nodes))
    half, whole, radius = (np.full(len(nodes), value) for value in (0.5, SIDE, 0.5 * SIDE))
    return Ring(nodes, nodes.copy(), radius, np.roll(own, 1), own, half, own, whole)
