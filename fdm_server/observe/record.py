"""Content of a frame of the grid. Nothing here runs between frames."""

import numpy as np

from coupler_protocol.files.quantities import declare_field
from coupler_protocol.scene.local_origin import in_the_scene
from fdm_server.ground import reactions as at_boundaries
from fdm_server.observe import fields
from fdm_server.step.gridpoint_pass import farthest, kinetic_energy


def frame(model, state, histories=None):
    """Keyword arguments for `Recorder.frame`: reference positions, active zones and their fields.

    histories {name: History}: those of all stages, zero in frames in which their laws do not act; None: those that act.
    """
    acting = model.law.histories
    zones = {
        "stress": fields.stress(model, state),
        "shear_strain": fields.shear_strain(model, state),
        "shear_strain_rate": fields.shear_strain_rate(model, state),
        "group": model.grid.material[model.zone],
    }
    for name, remembered in (acting if histories is None else histories).items():
        if remembered.place == "zone" and remembered.recorded:
            declare_field(remembered.recorded, remembered.unit, remembered.meaning)
            absent = np.zeros(len(model.zone), remembered.dtype)
            zones[remembered.recorded] = fields.history(model, state, name) if name in acting else absent
    return {
        "points": in_the_scene(model.grid.xy, model.grid.origin),
        "cells": model.zones,
        "point_fields": {"displacement": state.displacement, "velocity": state.velocity},
        "cell_fields": zones,
    }


def history(model, state, ratio, factor):
    """Values of one point of the histories."""
    return {
        "unbalanced_ratio": ratio,
        "gravity_factor": factor,
        "kinetic_energy": kinetic_energy(model, state),
        "max_displacement": farthest(state.displacement),
    }


def movements(model, state, holders):
    """Mean displacements of boundaries that move, as values of histories: moved_x:NAME, moved_y:NAME; none where none moves."""
    if state.driven is None:
        return {}
    found = {}
    for label, by_axis in holders.items():
        for axis, points in enumerate(by_axis):
            own = points[model.fixed[points, axis]]
            if state.driven[own, axis].any() or state.displacement[own, axis].any():
                found[f"moved_{'xy'[axis]}:{label}"] = float(np.mean(state.displacement[own, axis]))
    return found


def reactions(model, state, gravity, holders):
    """Forces of boundaries on the ground as values of histories: reaction_x:NAME if x is held, reaction_y:NAME if y is."""
    found = at_boundaries.reactions(model, state, gravity, holders)
    return {f"reaction_{axis}:{label}": force for label, by_axis in found.items() for axis, force in by_axis.items()}
