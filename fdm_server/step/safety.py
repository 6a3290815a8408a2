"""Failures that would otherwise go unnoticed: inverted zones, velocities that are NaN or infinite."""

import numpy as np

from coupler_protocol.geometry import NOWHERE, spot
from fdm_server.step.blocks import triangle_double_areas
from fdm_server.step.gridpoint_pass import fastest_component


class Unstable(ArithmeticError):  # noqa: N818
    """The computation is unstable: its results after this step have no meaning."""


def check_zones(xy, zones, number, origin=NOWHERE):
    """Raises Unstable if a zone (A,4) with gridpoints xy (N,2) [m] is inverted or has no area, or a position is not finite.

    number (A,), origin (2,) [m] of the scene from which xy counts: for the message.
    """
    broken = np.flatnonzero(~np.isfinite(xy).all(axis=1))
    if len(broken):
        raise Unstable(_positions_as_text(xy, zones, number, origin, broken))
    double = triangle_double_areas(xy, zones)
    present = np.ones(double.shape, dtype=np.bool_)
    present[zones[:, 2] == zones[:, 3], 1::2] = False  # (0,2,3) and (1,2,3) of a triangular zone
    bad = np.flatnonzero(np.any(present & ~(double > 0.0), axis=1))
    if len(bad):
        where = spot(xy[zones[bad[0]]].mean(axis=0), origin)
        raise Unstable(f"{len(bad)} zones are inverted or without area, the first is zone {number[bad[0]]} at {where}")


def _positions_as_text(xy, zones, number, origin, broken):
    """Text for gridpoints `broken` without a position, with the first of their zones that has a corner with one."""
    finite = np.isfinite(xy).all(axis=1)
    beside = np.flatnonzero(np.isin(zones, broken).any(axis=1) & finite[zones].any(axis=1))
    where = ""
    if len(beside):
        corners = zones[beside[0]]
        near = spot(xy[corners[finite[corners]]].mean(axis=0), origin)
        where = f", one is number {corners[~finite[corners]][0]}, a corner of zone {number[beside[0]]} near {near}"
    return (
        f"positions of {len(broken)} gridpoints are NaN or infinite{where}: the step is too long for something stiffer than the "
        "zones, or a law failed"
    )


def check_motion(model, state):
    """Raises Unstable if a velocity is not finite or moves a gridpoint across the grid in one step; takes a few microseconds."""
    speed = fastest_component(state.velocity) * (state.dt if state.in_real_time else 1.0)
    if not np.isfinite(speed):
        bad = np.flatnonzero(~np.isfinite(state.velocity).all(axis=1))
        raise Unstable(
            f"velocities of {len(bad)} gridpoints are NaN or infinite, one {_at(model, bad[0])}, number {bad[0]}: the step is "
            f"too long for something stiffer than the zones, or a law failed"
        )
    if speed > model.extent:
        fastest = np.abs(state.velocity).max(axis=1).argmax()
        raise Unstable(
            f"gridpoint {fastest} {_at(model, fastest)} moves {speed:.3g} m in a step, more than the size of the grid: "
            f"forces have grown without bounds"
        )


def _at(model, point):
    return f"at {spot(model.grid.xy[point], model.grid.origin, 6)}"
