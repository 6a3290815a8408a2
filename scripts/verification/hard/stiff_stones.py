"""Stones ten thousand times as stiff as the soil, also switched on under stress.

`tests/hard/stiff_stones.toml`: the packing is at 100 kPa when its stones become stiff, with reference gaps that keep every
contact force. Then it settles in a box of walls under gravity in static mode, and continues in real time without damping: it
is at rest, so its kinetic energy stays at the level of the last unbalanced forces."""

import numpy as np

from coupler_protocol.interface.ring import build_ring
from coupler_protocol.scene.reader import build_scene
from dem_server.packing import alone_window, packing
from dem_server.pairs import contacts
from dem_server.step.contact_pass import contact_forces
from dem_server.stones import bodies, mesostructure
from verification.hard.watched import computed, scene_of
from verification.verdict_rows import row

NAME = "stiff stones"


def jump():
    """Largest change of a normal force when the stones become stiff, over the mean force."""
    scene = build_scene(scene_of("stiff_stones"))
    nodes = alone_window.rim_of(scene.window[0].polygon, 4.0 * scene.discs.radius)
    found = mesostructure.draw(nodes, scene.stones, np.random.default_rng(11))
    ring = build_ring(nodes, scene.discs.radius)
    discs = packing.pack(nodes, ring.xy, ring.radius, scene.discs, np.random.default_rng(11))
    model, state = alone_window.bare(scene, discs, reference_gap=True)
    contact_forces(model, state)
    bodies.assign_discs(model, state, found.outlines, scene.discs.stone.density)
    before = contacts(state)
    model = bodies.stiffen_stones(model, state)
    contact_forces(model, state)
    after = contacts(state)
    if len(after.slot) != len(before.slot):
        return float("nan")
    return np.abs(after.normal_force - before.normal_force).max() / before.normal_force.mean()


def rows(fast):
    """The scene takes seconds."""
    yield row("switched on: largest change of a contact force over the mean one", jump(), 0.0, 1e-9, "closed form")
    watch, stages = computed(scene_of("stiff_stones", free={"steps": 4000 if fast else 20_000}))
    yield row("settles to the unbalanced ratio", stages[1]["ratio_discrete"][0], 0.0, 1e-3, "as asked for")
    kinetic, stored, _ = watch.of("free")
    yield row("real time: largest kinetic energy over stored energy", kinetic.max() / stored[0], 0.0, 1e-3, "it rests")
    yield row("real time: stored energy at the end over that at the start", stored[-1] / stored[0], 1.0, 1e-2, "it rests")
    yield row("all numbers finite", watch.finite, 1.0, 0.0, "as asked for")
