"""The energy ledger closes: to round-off in undamped elastic motion, and with damping and yield, small strain."""

import numpy as np
import pytest
from zone_cases import DENSITY, GRAVITY, box, sides, slope, soil

from fdm_server.effects.damping import Damping
from fdm_server.effects.elastic import Elastic
from fdm_server.effects.mohr_coulomb import MohrCoulomb
from fdm_server.effects.rayleigh import RayleighTable
from fdm_server.effects.softening import Softening
from fdm_server.effects.tension import Tension
from fdm_server.mesh.grid import build_grid
from fdm_server.model import build_model, new_state
from fdm_server.observe.energy_ledger import Ledger
from fdm_server.step import clock
from fdm_server.step.gridpoint_pass import update_velocities
from fdm_server.step.zone_pass import advance

UNDAMPED = Damping(local=0.0)


def kept(scene, gravity, steps, damping=UNDAMPED, factor=None, drive=None, start=None):
    """Rows of the ledger over so many steps: a dictionary of arrays."""
    model = build_model(scene, build_grid(scene))
    state = new_state(model)
    model = clock.begin(model, state, damping, factor)
    if start:
        start(model, state)
    ledger, rows = Ledger(model, state), []
    for n in range(steps):
        ledger.copy_before_step(state)
        update_velocities(model, state, gravity)
        if drive:
            drive(model, state, n)
        ledger.book_motion(model, state, gravity)
        rows.append(ledger.values(model, state))
        advance(model, state)
        ledger.book_strain(model, state)
    return {name: np.array([row[name] for row in rows]) for name in rows[0]}, model, state


@pytest.mark.parametrize("factor", [None, 0.5, 1.0])
def test_undamped_elastic_motion_closes_to_round_off(factor):
    """Static steps with scaled masses and real ones; weight put on at once."""
    rows, _, _ = kept(slope(0.5, soil()), GRAVITY, 3000, factor=factor)
    scale = rows["gravity"].max()
    assert rows["kinetic"].max() > 0.1 * scale
    assert rows["strain"].max() > 0.3 * scale
    assert np.abs(rows["error"]).max() < 1e-12 * scale
    assert np.abs(rows["damping"]).max() < 1e-12 * scale
    assert np.abs(rows["plastic"]).max() < 1e-12 * scale


def test_a_body_that_starts_in_motion_keeps_its_energy():
    """T + U alone, from the discrete energy of the first step on."""

    def start(model, state):
        state.velocity[:] = 1e-3 * np.random.default_rng(2).normal(size=state.velocity.shape) * ~model.fixed

    rows, _, _ = kept(box(4.0, 3.0, 0.5, soil(), boundary=sides(bottom="xy")), 0.0, 3000, factor=0.9, start=start)
    total = rows["kinetic"] + rows["strain"]
    assert np.abs(total / total[0] - 1).max() < 1e-12


@pytest.mark.parametrize("damping", [Damping(local=0.8), Damping(combined=0.8)])
def test_damping_takes_half_of_what_sudden_weight_does(damping):
    """A slope that comes to rest stores half of the work of its weight: U = W/2 for elastic soil."""
    rows, _, _ = kept(slope(0.5, soil()), GRAVITY, 4000, damping)
    assert rows["strain"][-1] == pytest.approx(0.5 * rows["gravity"][-1], rel=1e-6)
    assert rows["damping"][-1] == pytest.approx(0.5 * rows["gravity"][-1], rel=1e-6)
    assert np.abs(rows["error"]).max() < 1e-12 * rows["gravity"].max()


@pytest.mark.parametrize("part", ["mass", "stiffness", "both"])
def test_rayleigh_damping_is_booked(part):
    table = RayleighTable(fraction=0.2, frequency=20.0, part=part)
    rows, _, _ = kept(slope(1.0, soil()), GRAVITY, 4000, Damping(rayleigh=table), 0.5)
    assert rows["damping"][-1] > 0.2 * rows["gravity"][-1]
    assert np.all(np.diff(rows["damping"])[1:] > -1e-9 * rows["damping"][-1])
    assert np.abs(rows["error"]).max() < 1e-10 * rows["gravity"].max()


def footing(law, softening=None):
    """A rough strip footing, half of it: driven gridpoints on clay, four zones wide."""
    clay = soil(Elastic(bulk=0.2e9, shear=0.1e9), law, Tension(strength=1e6), softening)
    return box(4.0, 2.0, 0.125, clay, boundary=sides(left="x", right="x", bottom="xy"))


@pytest.mark.parametrize("law", [MohrCoulomb(friction=0, cohesion=0.1e6), MohrCoulomb(friction=20, cohesion=0.05e6, dilation=5)])
@pytest.mark.parametrize("softens", [False, True])
def test_a_plastic_footing_closes(law, softens):
    """The work of the driven gridpoints is bearing force times settlement, and goes into plastic flow; asked for: 1 %."""
    under, pushed = [], []

    def drive(model, state, n):
        if not under:
            x, y = model.grid.xy.T
            under.extend(np.flatnonzero((y == 2.0) & (x <= 0.5)))
            model.fixed[under] = True
        state.velocity[under] = [0.0, -1e-6]
        pushed.append(state.force[under, 1].sum() * 1e-6)

    softening = Softening(strain=[0.01, 0.05], cohesion=[0.03e6, 0.01e6]) if softens else None
    rows, _, _ = kept(footing(law, softening), 0.0, 6000, Damping(local=0.8), drive=drive)
    scale = rows["external"].max()
    assert rows["external"][-1] == pytest.approx(sum(pushed), rel=5e-3)
    assert rows["plastic"][-1] > 0.5 * scale
    assert np.all(np.diff(rows["plastic"]) > -1e-9 * scale)
    assert np.abs(rows["error"]).max() < 1e-10 * scale


def test_free_fall_turns_weight_into_motion():
    rows, model, state = kept(box(2.0, 2.0, 0.5, soil()), GRAVITY, 100, factor=0.5)
    t = 99 * state.dt
    assert rows["gravity"][-1] == pytest.approx(model.weight_mass.sum() * GRAVITY * 0.5 * GRAVITY * t * (t + state.dt), rel=1e-9)
    np.testing.assert_allclose(rows["kinetic"], rows["gravity"], rtol=1e-9)
    assert model.weight_mass.sum() == pytest.approx(4 * DENSITY, rel=1e-12)
