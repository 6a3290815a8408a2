"""Stress averaged over the contacts is the stress on the walls.

A scene: discs of a mean radius of .04 m fill a rectangle of 1 m by .8 m, smooth, and four walls .05 m inside its edges hold them
under about .8 MPa until the unbalanced force ratio is 1e-8, with local damping. The force of the discs on a wall over the wall's
length against the average over all contacts, those with walls included, of force times branch (Weber 1966):

    sigma = -(1/A) sum sym(F (x) l)

Nothing turns, so walls opposite each other carry the same force.
"""

from types import SimpleNamespace

import numpy as np

from dem_server.fields import contacts
from dem_server.stress import contact_moments
from dem_server.walls import near
from verification.discrete import scenes
from verification.rows import row

NAME = "box"
WIDTH, HEIGHT, INSIDE = 1.0, 0.8, 0.05  # of the window, and of the walls inside it [m]


def pressed():
    """State of the box at rest, and its last unbalanced force ratio."""
    left, right, low, high = INSIDE, WIDTH - INSIDE, INSIDE, HEIGHT - INSIDE
    corners = [[left, low], [right, low], [right, high], [left, high]]
    walls = [{"ends": [corners[i], corners[(i + 1) % 4]]} for i in range(4)]
    soil = {key: table for key, table in scenes.SOIL.items() if key != "friction"}
    discs = {"radius": 0.04, "confinement": 1e5, "soil": soil, "wall": walls, "damping": {"local": 0.7}}
    rest = {"name": "rest", "kind": "discs", "until": {"ratio": 1e-8, "steps": 100_000}}
    outline = [[0.0, 0.0], [WIDTH, 0.0], [WIDTH, HEIGHT], [0.0, HEIGHT]]
    scene = scenes.tables([rest], discs, every=10**9, window=[{"name": "box", "polygon": outline}])
    _, state, _, results = scenes.computed(scene)
    return state, results[1]["ratio_discrete"][0]


def averaged(state):
    """Stress xx, yy, xy [Pa] from all contacts, in the area between the walls."""
    return stress_between(state, (WIDTH - 2.0 * INSIDE) * (HEIGHT - 2.0 * INSIDE))


def stress_between(state, area):
    """Stress xx, yy, xy [Pa] from all contacts of discs that walls enclose, in the `area` [m2] between the walls."""
    disc, wall, normal, distance = near(state, 0.0)
    along = np.column_stack([-normal[:, 1], normal[:, 0]])
    force = state.walls.normal[disc, wall][:, None] * normal + state.walls.shear[disc, wall][:, None] * along
    at_walls = SimpleNamespace(force=force, span=distance[:, None] * normal)
    return (contact_moments(contacts(state)).sum(axis=0) + contact_moments(at_walls).sum(axis=0)) / area


def rows(fast):
    """One scene, in seconds."""
    state, ratio = pressed()
    yield row("unbalanced force ratio", ratio, 0.0, 1e-8, "as asked for")
    xx, yy, _ = averaged(state)
    bottom, right, top, left = state.walls.force
    width, height = WIDTH - 2.0 * INSIDE, HEIGHT - 2.0 * INSIDE
    source = "Weber (1966), Bull. Liaison Ponts et Chaussees 20"
    yield row("averaged stress xx against the right wall [Pa]", xx, -right[0] / height, 1e-6, source)
    yield row("averaged stress xx against the left wall [Pa]", xx, left[0] / height, 1e-6, source)
    yield row("averaged stress yy against the top wall [Pa]", yy, -top[1] / width, 1e-6, source)
    yield row("averaged stress yy against the bottom wall [Pa]", yy, bottom[1] / width, 1e-6, source)
