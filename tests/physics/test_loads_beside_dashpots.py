"""Loads on sides with dashpots: both act.

A pressure p on a quiet end of a column moves it by v = p/(2 rho cP): ground and dashpots carry half of it each. Reactions that a
quiet side keeps do not depend on loads in the same place.
"""

import numpy as np
import pytest
from run_cases import ROLLERS, column, compute, scene, stage

from coupler_protocol.files import checkpoint
from fdm_server.ground.boundaries_in_time import begin_stage
from fdm_server.mesh.grid import build_grid
from fdm_server.model import build_model, new_state
from fdm_server.step import clock

IMPEDANCE = np.sqrt(2000.0 * (0.5e9 + 4 / 3 * 0.15e9))  # rho cP [Pa s/m]
PRESSURE, RAMP = 1e4, 100
QUIET = {"on": "top", "quiet": True}
SLIDING = [{"on": "left", "fix": "x"}, {"on": "right", "fix": "x"}, {"on": "bottom", "fix": "y"}]
REAL = {"time": "real", "damping": {"local": 0.0}}


def speeds(out, *stages):
    """Downward velocities [m/s] of the top in every step, of a column of 40 zones."""
    seen = []
    with compute(out, column(0.5, 20.0), *stages, boundary=SLIDING, on_step=(1, lambda m: seen.append(m.state.velocity[-1, 1]))):
        return -np.array(seen)


@pytest.mark.parametrize("of_the_stage", ["pressure", "surcharge"])
def test_a_pressure_that_grows_on_a_quiet_end_moves_it_by_half_of_what_a_free_one_moves(tmp_path, of_the_stage):
    """While it grows and afterwards; the load of a boundary, and that of a stage of kind surcharge."""
    if of_the_stage == "pressure":
        load = stage("load", steps=2 * RAMP, boundary=[QUIET, {"on": "top", "pressure": PRESSURE, "over": RAMP}], **REAL)
    else:
        load = stage("load", "surcharge", 2 * RAMP, boundary=[QUIET], **REAL)
        load["surcharge"] = {"pressure": PRESSURE, "x": [0.0, 0.5], "over": RAMP}
    found = speeds(tmp_path, load)
    share = np.minimum(1.0, (np.arange(2 * RAMP) + 1) / RAMP)
    expected = PRESSURE * share / (2.0 * IMPEDANCE)
    np.testing.assert_allclose(found[RAMP // 2 :], expected[RAMP // 2 :], atol=0.02 * expected[-1])


def test_a_pressure_of_the_next_stage_finds_the_dashpots_in_motion(tmp_path):
    """The forces of dashpots when a load begins are not a part of what stays."""
    begin = stage("begin", steps=RAMP, boundary=[QUIET, {"on": "top", "pressure": PRESSURE, "over": RAMP}], **REAL)
    more = stage("more", steps=RAMP, boundary=[{"on": "top", "pressure": 0.0, "over": RAMP}], **REAL)
    found = speeds(tmp_path, begin, more)
    growing = (np.arange(RAMP) + 1) / RAMP
    expected = PRESSURE / (2.0 * IMPEDANCE) * np.concatenate([growing, 1.0 - growing])
    np.testing.assert_allclose(found[10:], expected[10:], atol=0.03 * expected.max())


def test_a_loaded_side_that_becomes_quiet_keeps_its_reaction(tmp_path):
    """It is held across, and has a load of shear, in the same place."""
    boundary = [*ROLLERS, {"on": "bottom", "fix": "xy"}, {"on": "left", "shear": 1e4}]
    rest = stage("rest", "equilibrium", ratio=1e-10, gravity=9.81)
    wait = stage("wait", steps=200, boundary=[{"on": "left", "quiet": True}], **REAL)
    with compute(tmp_path, column(4.0, 4.0), rest, wait, boundary=boundary) as run:
        assert run.history("max_displacement")[1][-1] < 1e-10


def test_of_two_quiet_tables_for_a_part_of_a_side_one_counts(tmp_path):
    """Two that overlap are one: the same bits."""
    push = {"on": "top", "velocity": {"x": 0.0, "y": -0.01}, "over": 20}
    for name, tables in (("one", [{}]), ("two", [{}, {"x": [0.0, 2.0]}, {}])):
        quiet = [{"on": "bottom", "quiet": True} | table for table in tables]
        run = stage("push", steps=200, boundary=[push, *quiet], **REAL)
        compute(tmp_path / name, column(4.0, 4.0), run, boundary=SLIDING).close()
    states = [checkpoint.load(tmp_path / name / "fdm.rank0.push.h5")[0]["grid"]["velocity"] for name in ("one", "two")]
    assert np.abs(states[0]).max() > 0.0
    np.testing.assert_array_equal(*states)


def test_on_an_inclined_side_loads_and_dashpots_add_up():
    """A face at 45 deg that moves as a rigid body while its pressure grows, step by step."""
    face = {"on": "face", "quiet": True}
    press = {"on": "face", "pressure": PRESSURE, "over": 4}
    grid = {"kind": "slope", "length": 8.0, "height": 5.0, "zone_size": 1.0, "profile": [[0, 2], [2, 2], [5, 5], [8, 5]]}
    case = scene(grid, stage("load", steps=10, boundary=[face, press], **REAL)).drawn
    model = build_model(case, build_grid(case))
    state = new_state(model)
    model = clock.begin(model, state, case.damping, 0.5)
    model, sides = begin_stage(case, 0, model, state)
    v, n = np.array([0.3, -0.2]), np.array([-1.0, 1.0]) / np.sqrt(2.0)
    p, s = IMPEDANCE, np.sqrt(2000.0 * 0.15e9)
    own = np.flatnonzero(np.any(sides.dashpots[0].resistance != 0.0, axis=(1, 2)))
    length = face_length(model, sides.dashpots[0].nodes[own])
    for step in range(6):
        sides.push.apply(state)
        state.velocity[:] = (step + 1) * v
        for side in sides.dashpots:
            side.apply(state)
        for load in sides.push.loads:
            load.ramp.step_done()
        moved = (step + 1) * v
        waves = -length * (p * (moved @ n) * n + s * (moved - (moved @ n) * n))
        pressed = -PRESSURE * min(1.0, (step + 1) / 4) * length * n
        np.testing.assert_allclose(state.applied.sum(axis=0), waves + pressed, rtol=1e-12)


def face_length(model, nodes):
    """Length [m] of the face between its ends."""
    xy = model.grid.xy[nodes]
    return float(np.hypot(*(xy.max(axis=0) - xy.min(axis=0))))
