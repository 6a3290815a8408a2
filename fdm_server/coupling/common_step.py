"""Common step of both codes in a coupled stage in real time: agreed after the first forces of the discs, then constant.

No mass may be added in real time, so the mass rule of the interface (dem_server/coupling/rim.py, sums S_I) limits the step. With
static masses m_I of zones (fdm_server/step/masses.py) u.K u of the zones is at most 2 sum m_I u_I^2, that of the contacts at most
2 sum S_I u_I^2 and the discs' part. With a reserve of 2 for the contacts, a step is stable if at rim nodes of real mass M_I (of
zones and inner shares of control discs)

    dt^2 (m_I / 2 + S_I) <= M_I.                                                 (1)

The step keeps the same factor 2 in omega^2 in reserve as steps of the grid alone keep for damping,

    q_I = sqrt(M_I / (m_I + 2 S_I)),    dt = min(step_factor q, step_factor min q_I, limits of the discs),      (2)

which without contacts is the q of the grid. Steps change only between stages: if (1), the zones or the discs later need a shorter
step, the run ends.
"""

from dataclasses import replace
from math import inf

import numpy as np

from coupler_protocol.exits import PhysicsFailed
from coupler_protocol.geometry import spot
from fdm_server.step.present_shape import masses

REMEDY = "give the stage a smaller step_factor"


def rim_step(model, state, rim):
    """Smallest q_I of Eq (2) over the gridpoints of a rim [s]."""
    mass, zones = _masses(model, state, rim.nodes)
    return float(np.sqrt((mass / (zones + 2.0 * rim.sums)).min(initial=inf)))


def set_common_step(model, state, rims):
    """Sets the step of Eq (2) for a stage; returns the model, whose zones may use the whole stable step from then on."""
    state.dt = min(state.dt, *(min(model.step_factor * rim_step(model, state, rim), rim.answer.dt_limit) for rim in rims))
    return replace(model, step_factor=1.0)


def check_common_step(model, state, rims, dt):
    """Raises PhysicsFailed if the agreed step `dt` [s] has become too long."""
    if state.dt < dt:
        raise PhysicsFailed(f"zones have become so thin that the step of {dt:.4g} s agreed for this stage is too long: {REMEDY}")
    for rim in rims:
        mass, zones = _masses(model, state, rim.nodes)
        bad = np.flatnonzero(dt * dt * (0.5 * zones + rim.sums) > mass)
        if len(bad):
            where = spot(model.grid.xy[rim.nodes[bad[0]]], model.grid.origin)
            raise PhysicsFailed(
                f"contacts on the rim of {rim.window.name!r} have become so stiff, at {where}, that the step of "
                f"{dt:.4g} s agreed for this stage is too long: {REMEDY}"
            )


def _masses(model, state, nodes):
    """M_I and m_I of Eq (1) (K,) [kg]."""
    static = model.mass if state.mass is None else state.mass
    return masses(model, state)[nodes] + state.added_mass[nodes], static[nodes]
