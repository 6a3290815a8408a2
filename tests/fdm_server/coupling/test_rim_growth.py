"""The watch at a rim: steps too long are told from steps that are not, and a mapping that makes power from one that does not."""

from types import SimpleNamespace

import numpy as np
import pytest
from verification.coupling.block import R, block
from verification.coupling.energy import AMPLITUDE
from verification.hard.coupled_system import at_share, excite, system

from coupler_protocol.wire.messages import Answer
from dem_server.observe import energy
from fdm_server.coupling.rim_growth import GrowthWatch, PowerWatch
from fdm_server.observe.energy_growth import EnergyWatch
from fdm_server.step.safety import Unstable


def rim_of(nodes, xy, **more):
    return SimpleNamespace(nodes=nodes, xy=xy[nodes], window=SimpleNamespace(name="hole"), **more)


class Heard(list):
    """Names of warnings."""

    def __call__(self, name, text):
        self.append(name)
        self.text = text


def watched(share, damping, stiffness, steps):
    """Warnings, reason of the end ("": none), and largest rim velocities from the warning on, of an oblique window.

    The mode that sets the limit is in motion, with steps of `share` of the limit.
    """
    found, mode = at_share(system(stiffness, 0.1, damping, oblique=True), share)
    excite(found, mode, 1e-9, np.random.default_rng(0))
    nodes, heard, since = found.windows[0].nodes, Heard(), []
    watch = GrowthWatch(rim_of(nodes, found.model.grid.xy), heard)
    for _ in range(steps):
        found.step()
        velocity = found.state.velocity[nodes].ravel()
        try:
            watch.check(velocity, 1.0)
        except Unstable as error:
            return heard, str(error), [*since, np.abs(velocity).max()]
        if heard:
            since.append(np.abs(velocity).max())
    return heard, "", since


@pytest.mark.parametrize("damping", [0.0, 0.8])
@pytest.mark.parametrize("stiffness", [1.0, 1000.0])
def test_a_step_one_hundredth_too_long_is_found_before_velocities_grow_tenfold(damping, stiffness):
    heard, reason, since = watched(1.01, damping, stiffness, 500)
    assert heard == ["growth"]
    assert reason.startswith("growth: the rim of window 'hole'")
    assert since[-1] < 10.0 * since[0]


@pytest.mark.parametrize("damping", [0.0, 0.8])
@pytest.mark.parametrize("stiffness", [1.0, 1000.0])
def test_a_step_one_hundredth_below_the_limit_passes(damping, stiffness):
    assert watched(0.99, damping, stiffness, 2000)[:2] == ([], "")


def until_stopped(watch, heard, velocities):
    """Largest velocities from the warning on until the watch stops the run, which it must."""
    since = []
    for v in velocities:
        try:
            watch.check(v, 1.0)
        except Unstable:
            return [*since, np.abs(v).max()]
        since += [np.abs(v).max()] if heard else []
    raise AssertionError("nothing stopped")


@pytest.mark.parametrize("ratio", [1.001, 1.3, 3.0, 20.0])
def test_motion_that_turns_round_and_grows_ends_in_time(ratio):
    """v(n) = (-ratio)^n: the warning at a growth of two and three steps, the end before ten times the motion of the warning."""
    heard, rim = Heard(), rim_of(np.arange(3), np.eye(3, 2))
    watch, v = GrowthWatch(rim, heard), np.array([1e-3, 2e-3, -1e-3, 0.0, 1e-3, 0.0])
    since = until_stopped(watch, heard, (v * (-ratio) ** n for n in range(10_000)))
    assert heard == ["growth"]
    assert since[-1] < 10.0 * since[0]


def test_a_push_that_grows_and_motion_of_round_off_are_no_growth():
    rng, heard = np.random.default_rng(3), Heard()
    watch = GrowthWatch(rim_of(np.arange(3), np.eye(3, 2)), heard)
    way = rng.normal(size=6)
    for n in range(500):
        watch.check(way * 1.1**n, 1.0)  # one direction
    for n in range(30):
        watch.check((-1.5) ** n * 1e-19 * way, 1.0)
    for _ in range(500):
        watch.check(rng.normal(size=6), 1.0)  # turns as it likes
    for n in range(500):
        watch.check((-1.0) ** n * np.cos(0.1 * n) * way, 1.0)  # just below the limit: swells and fades
    assert heard == []


def test_power_is_compared_with_that_of_the_same_step_for_every_spacing_of_looks():
    """The answer to step n comes with the forces two steps later (dem_server/run.py)."""
    for every in (1, 2, 3, 10):
        rng, heard, powers = np.random.default_rng(4), Heard(), [0.0]
        rim = rim_of(np.arange(2), np.eye(2), force=np.zeros((2, 2)), answer=SimpleNamespace(power=0.0))
        watch = PowerWatch(rim, every, heard)
        looked = answer = 0.0
        for step in range(7, 60):
            rim.force, velocity = rng.normal(size=(2, 2)), rng.normal(size=4)
            rim.answer.power = answer
            watch.check(velocity, step)
            answer = looked
            powers.append(float(rim.force.ravel() @ velocity))
            looked = powers[-1] if step % every == 0 else looked
        assert heard == [], every
        rim.answer.power = 2.0 * answer + 1.0
        for step in range(60, 60 + 2 * every):
            watch.check(velocity, step)
        assert heard == 2 * ["mismatch"], every
        with pytest.raises(Unstable, match=r"^mismatch"):
            [watch.check(velocity, step) for step in range(60 + 2 * every, 60 + 3 * every)]


def kept(mapping, steps):
    """A free undamped block, shaken, its control discs 3 R off their segments, watched by its energy.

    Warnings, largest velocities (from the warning on, if there is one), reason of the end ("": none).
    """
    joined = block(around=1, across=2, mapping=mapping, shift=3.0 * R)
    joined.begin(0.5, from_rest=False)
    rng, speed = np.random.default_rng(5), AMPLITUDE * R / joined.grid.dt / 10.0
    joined.grid.velocity[:] = speed * rng.normal(size=joined.grid.velocity.shape)
    joined.discs.v[joined.disc_model.ring :] = speed * rng.normal(size=(joined.disc_model.count - joined.disc_model.ring, 2))
    joined.step()
    heard, speeds, rim = Heard(), [], rim_of(joined.nodes, joined.grid_model.grid.xy, force=joined.rim.force)
    watch = EnergyWatch(joined.grid_model, joined.grid, 0.0, [rim], heard)
    for n in range(steps):
        joined.step()
        speeds.append(np.abs(joined.motion()).max())
        if n % 10:
            continue
        kinetic, stored = energy.kinetic(joined.disc_model, joined.discs), energy.stored(joined.disc_model, joined.discs)
        rim.answer = Answer(1.0, 1.0, kinetic, stored, *[0.0] * 4)
        before = len(heard)
        try:
            watch.check(joined.grid_model, joined.grid, 0.0)
        except Unstable as error:
            return heard, np.array(speeds), str(error)
        if heard and not before:
            speeds = speeds[-1:]
    return heard, np.array(speeds), ""


def test_flutter_of_the_paper_mapping_is_a_drift():
    heard, speeds, reason = kept("paper", 9000)
    assert set(heard) == {"drift"}
    assert reason.startswith("drift: ")
    assert 2.0 * speeds[0] < speeds.max() < 10.0 * speeds[0]


def test_the_work_consistent_mapping_off_its_segments_passes():
    assert kept("work-consistent", 3000)[0] == []
