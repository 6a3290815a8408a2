"""A packed window for tests: any corner polygon, its ring and the paper's soil."""

from types import SimpleNamespace

import numpy as np

from coupler_protocol.interface.ring import build_ring
from dem_server.effects.bond import Bond
from dem_server.effects.damping import Damping
from dem_server.effects.friction import Friction
from dem_server.effects.spring import Spring
from dem_server.model import build_model
from dem_server.packing.packing import pack
from dem_server.step.contact_pass import contact_forces
from dem_server.stones.bodies import assign_discs
from dem_server.stones.mesostructure import draw

SQUARE = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
OBLIQUE = np.array([[0.0, 0.0], [1.2, 0.4], [0.9, 1.5], [-0.3, 1.1]])
ANGLE = np.array([[0.0, 0.0], [1.5, 0.0], [1.5, 0.75], [0.75, 0.75], [0.75, 1.5], [0.0, 1.5]])
SEGMENT = 0.25  # length of the ring's segments [m], about


def soil_discs(radius=0.03, shear=0.4, friction=0.55, bond=True, **changes):
    """The scene's `discs` table for the paper's soil; shear: ks / kn."""
    soil = SimpleNamespace(
        density=2000.0,
        spring=Spring(normal=5.0e7, shear=shear * 5.0e7),
        friction=Friction(coefficient=friction) if friction else None,
        bond=Bond(tension=1.5e3, shear=3.5e3) if bond else None,
    )
    table = {
        "radius": radius,
        "spread": 0.25,
        "packing": "relaxed",
        "porosity": 0.16,
        "confinement": 100e3,
        "stiffness": "disc",
        "damping": Damping(local=0.7),
        "stone": None,
    }
    return SimpleNamespace(soil=soil, **(table | changes))


def stone_grain():
    """The paper's stone, ten to twenty times as stiff as its soil."""
    return SimpleNamespace(
        density=2700.0,
        spring=Spring(normal=5.0e8, shear=5.0e8),
        friction=Friction(coefficient=1.0),
        bond=Bond(tension=1.0e6, shear=1.0e6),
    )


def stones_table(**changes):
    """The scene's `stones` table of the paper's slope."""
    size = SimpleNamespace(mean=0.25, sigma=0.35, min=0.12, max=0.6)
    table = {"content": 0.45, "body": "clump", "size": size, "vertices": (6, 12), "flatness": (1.0, 1.8), "gap": 0.03}
    table |= {"azimuth": None, "shapes": None, "file": None, "scale": 1.0, "origin": (0.0, 0.0), "flip_y": False}
    table |= {"outside": "clip"}
    return SimpleNamespace(**(table | changes))


def rim(corners):
    """Nodes along the polygon, about SEGMENT apart (K, 2)."""
    nodes = []
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        pieces = max(1, round(np.hypot(*(b - a)) / SEGMENT))
        nodes += [a + (b - a) * q / pieces for q in range(pieces)]
    return np.array(nodes)


def packing_of(corners, discs, seed=0, insitu=False):
    """The `packing` of a window, its `model` and `state` with contacts found, and the `nodes` of its rim."""
    nodes = rim(corners)
    ring = build_ring(nodes, discs.radius)
    packing = pack(nodes, ring.xy, ring.radius, discs, np.random.default_rng(seed))
    model, state = build_model(ring.xy, ring.radius, packing, discs, insitu=insitu)
    contact_forces(model, state)
    return SimpleNamespace(packing=packing, model=model, state=state, nodes=nodes)


def packed(corners, discs, seed=0, insitu=True):
    """Model and State of a packed window, contacts found."""
    found = packing_of(corners, discs, seed, insitu)
    return found.model, found.state


def packed_with_stones(corners, seed=0, **changes):
    """Model and State of a packed window whose discs are marked as stones, and its mesostructure."""
    model, state = packed(corners, soil_discs(stone=stone_grain()), seed)
    found = draw(rim(corners), stones_table(**changes), np.random.default_rng(seed))
    assign_discs(model, state, found.outlines, stone_grain().density)
    return model, state, found


def two_discs(**changes):
    """Model and State of two free discs of soil that just touch."""
    packing = SimpleNamespace(xy=np.array([[0.0, 0.0], [0.06, 0.0]]), radius=np.array([0.03, 0.03]))
    model, state = build_model(np.empty((0, 2)), np.empty(0), packing, soil_discs(**changes))
    contact_forces(model, state)
    return model, state
