"""The energy ledger closes in large strain, better with shorter steps, for ground that swings, turns and yields."""

import numpy as np
from zone_cases import GRAVITY, box, sides, slope, soil

from fdm_server.effects.damping import Damping
from fdm_server.effects.elastic import Elastic
from fdm_server.effects.mohr_coulomb import MohrCoulomb
from fdm_server.mesh.grid import build_grid
from fdm_server.model import build_model, new_state
from fdm_server.observe.energy_ledger import Ledger
from fdm_server.step import clock
from fdm_server.step.gridpoint_pass import update_velocities
from fdm_server.step.present_shape import begin_large_strain, count_steps
from fdm_server.step.zone_pass import advance

UNDAMPED = Damping(local=0.0)
SOFT = Elastic(bulk=2e6, shear=1e6)


def booked(scene, gravity, seconds, factor, damping=UNDAMPED, start=None):
    """Rows of the ledger over so many seconds, or steps of static mode (factor None): a dictionary of arrays, and the State."""
    model = build_model(scene, build_grid(scene))
    state = new_state(model)
    model = clock.begin(model, state, damping, factor)
    begin_large_strain(model, state)
    if start:
        start(model, state)
    ledger, rows, time = Ledger(model, state), [], 0.0
    while time < seconds:
        ledger.copy_before_step(state)
        update_velocities(model, state, gravity)
        ledger.book_motion(model, state, gravity)
        rows.append(ledger.values(model, state))
        advance(model, state)
        ledger.book_strain(model, state)
        count_steps(model, state)
        time += clock.seconds(state)
    return {name: np.array([row[name] for row in rows]) for name in rows[0]}, model, state


def errors(scene, gravity, seconds, **more):
    """Largest error over the largest kinetic energy, for steps of .4 and .2 of the stable one."""
    found = []
    for factor in (0.4, 0.2):
        rows, _, state = booked(scene, gravity, seconds, factor, **more)
        found.append(np.abs(rows["error"]).max() / rows["kinetic"].max())
    return found, rows, state


def test_a_beam_that_bends_far_under_its_weight():
    """Held at its left end; it swings by a fifth of its length, so that zones turn and change their areas."""
    found, rows, state = errors(box(4.0, 1.0, 0.5, soil(SOFT), boundary=sides(left="xy")), 2.0, 1.0)
    assert np.abs(state.displacement).max() > 0.4
    assert np.abs(rows["shape"]).max() > 5e-4 * rows["strain"].max()
    assert found[1] < 2e-4
    assert found[1] < 0.6 * found[0]  # of first order, because steps become shorter as zones do


def test_a_free_body_that_turns_and_swings_keeps_its_energy():
    """It turns by a radian and more, stretched by its own turning."""

    def start(model, state):
        xy = model.grid.xy - model.grid.xy.mean(axis=0)
        state.velocity[:] = 4.0 * np.column_stack([-xy[:, 1], xy[:, 0]])

    found, rows, _ = errors(box(2.0, 2.0, 0.5, soil(SOFT)), 0.0, 0.3, start=start)
    total = rows["kinetic"] + rows["strain"]
    assert rows["strain"].max() > 0.01 * total[0]
    assert found[1] < 2e-4
    assert found[1] < 0.4 * found[0]


def test_ground_that_yields_and_slides():
    """A slope without strength to stand: plastic work takes what its weight gives."""
    weak = soil(mohr_coulomb=MohrCoulomb(friction=15.0, cohesion=4e3, dilation=0.0))
    rows, _, state = booked(slope(0.5, weak), GRAVITY, 3000, None, Damping(local=0.8))
    print({name: row[-1] for name, row in rows.items()}, np.abs(rows["error"]).max(), np.abs(state.displacement).max())
    assert np.abs(state.displacement).max() > 0.02
    assert rows["plastic"][-1] > 0.1 * rows["gravity"][-1]
    assert np.abs(rows["error"]).max() < 1e-4 * rows["gravity"][-1]
