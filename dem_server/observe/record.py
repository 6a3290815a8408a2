"""Content of a frame of the discs. Nothing here runs between frames."""

import numpy as np

from coupler_protocol.scene.local_origin import in_the_scene
from dem_server.effects.histories import recorded
from dem_server.observe import wall_forces
from dem_server.pairs import body_centres, contacts


def stones(outlines, origin=(0.0, 0.0)):
    """Constants for the `Recorder`: corners of all stones, one stone after the other, and the first row of each.

    origin [m]: the local origin of the outlines.
    """
    start = np.concatenate([[0], np.cumsum([len(outline) for outline in outlines])])
    return {"stone_corners": in_the_scene(np.concatenate(outlines), origin), "stone_start": start}


def frame(model, state, origin=(0.0, 0.0), also=None):
    """Keyword arguments for `Recorder.frame`: positions, contacts and their fields; absent effects have no field.

    origin [m]: the local origin of the State; also: fields of contacts {name: type} that are zero where their effect is absent.
    """
    pairs = contacts(state)
    ring = np.arange(model.count) < model.ring
    points = {
        "id": np.arange(model.count),
        "radius": state.radius,
        "displacement": state.displacement,
        "velocity": state.v,
        "spin": state.spin,
        "material": model.material,
        "control": ring.astype(np.int32),
    }
    if state.stone is not None:
        points["stone"] = state.stone
    if state.clumps is not None:
        points["centroid"] = in_the_scene(body_centres(state), origin)
    if state.walls is not None:
        points["wall_force"], points["wall_virial"] = wall_forces.on_discs(state)
    lines = {"disc_a": pairs.disc_a, "disc_b": pairs.disc_b, "normal_force": pairs.normal_force}
    if state.shear is not None:
        lines["shear_force"] = pairs.shear_force
    for name, remembered in recorded(state).items():
        lines[name] = remembered[pairs.slot]
    for name, kind in (also or {}).items():
        lines.setdefault(name, np.zeros(len(pairs.slot), kind))
    ends = np.stack([pairs.disc_a, pairs.disc_b], axis=1)
    return {"points": in_the_scene(state.x, origin), "cells": ends, "point_fields": points, "cell_fields": lines}
