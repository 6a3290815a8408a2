"""A window before its takeover of stress: stones, ring and packing."""

import numpy as np

from coupler_protocol.interface.ring import build_ring
from coupler_protocol.scene.used_materials import discs_used
from dem_server.coupling.rim import Rim
from dem_server.model import build_model
from dem_server.packing import packing, packing_from_file
from dem_server.step.contact_pass import contact_forces
from dem_server.stones import bodies
from dem_server.stones.mapped import stones_of


def drawn_stones(scene, rank, nodes, note=None):
    """Mesostructure of the window of `rank`, None without stones; nodes (K, 2) [m]: its rim; note(text, fraction): progress."""
    if scene.stones is None:
        return None
    return stones_of(nodes, scene.stones, np.random.default_rng([scene.seed, rank, *b"stones"]), note, scene.origin)


def packed_window(scene, rank, nodes, mesostructure=None, note=None, surface=None):
    """Model, State, Rim and packing of the window of `rank` with its rim at `nodes` (K, 2) [m]; discs are assigned to stones.

    surface (S, 2) [m]: of a window that reaches the ground surface, as of coupler_protocol.interface.ring.Ring. A wall of control
    discs confines the packing there; the window is left without it.
    """
    discs = discs_used(scene)
    ring = build_ring(nodes, discs.radius, surface)
    closed = ring if surface is None else build_ring(ring.outline, discs.radius)
    if discs.file is not None:
        found = packing_from_file.of_window(scene, closed)
    else:
        found = packing.pack(ring.outline, closed.xy, closed.radius, discs, np.random.default_rng([scene.seed, rank]), note)
    model, state = build_model(ring.xy, ring.radius, found, discs, scene.ring, surface=ring.surface)
    contact_forces(model, state)
    if mesostructure is not None:
        bodies.assign_discs(model, state, mesostructure.outlines, discs.stone.density)
    return model, state, Rim(ring, scene.coupling.mapping), found
