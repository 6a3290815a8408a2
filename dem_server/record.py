"""What a frame of the discs holds. Nothing here runs between frames."""

import numpy as np

from dem_server.fields import contacts


def frame(model, state):
    """Keyword arguments for `Recorder.frame`: positions, contacts and their fields; absent effects leave no field."""
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
    lines = {"disc_a": pairs.disc_a, "disc_b": pairs.disc_b, "normal_force": pairs.normal_force}
    if state.shear is not None:
        lines["shear_force"] = pairs.shear_force
    if state.bond_state is not None:
        lines["bond_state"] = pairs.bond_state
    ends = np.stack([pairs.disc_a, pairs.disc_b], axis=1)
    return {"points": state.x, "cells": ends, "point_fields": points, "cell_fields": lines}
