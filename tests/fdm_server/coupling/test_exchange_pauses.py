"""When both sides may take several steps between exchanges: contact/zone stiffness, growth of the rim's motion, and when not."""

import tomllib
from types import SimpleNamespace

import numpy as np
import pytest

from coupler_protocol.problems import SceneError
from coupler_protocol.scene.reader import build_scene
from fdm_server.coupling.exchange_pauses import Pace, stiffness_ratio
from fdm_server.coupling.rim import Rim
from fdm_server.effects.damping import damped
from fdm_server.step.masses import static_masses


class Node:
    """A rim of one gridpoint, which is the first of the grid's, with a contact of stiffness k on it [N/m]."""

    speed, note_velocities = Rim.speed, Rim.note_velocities

    def __init__(self, k):
        self.nodes, self.sums = np.array([0]), np.array([0.5 * k])  # mass rule: M += k / 2
        self.path, self.before = np.zeros((1, 2)), np.zeros((1, 2))


def spring(pace, k, K=1.0, alpha=0.7, steps=4000, push=lambda n: 0.0, v0=0.0, along=(0.6, 0.8)):
    """The end of a bar (static mass and stiffness K of its last zone) with a contact k, the other end of which is held.

    Held forces of the contact as in fdm_server/run.py; push(n): force along the bar in step n. Returns speeds (steps,) [m/step],
    and the lengths of the pauses.
    """
    rim, state = Node(k), SimpleNamespace(velocity=np.array([v0 * np.array(along)]))
    u, P, speeds, pauses = np.zeros(2), np.zeros(2), [], []
    for n in range(steps):
        if pace.begins:
            P = -k * u
            pace.note_forces([rim], np.array([K]))
        for axis in range(2):
            force = damped(P[axis] - K * u[axis] + push(n) * along[axis], state.velocity[0, axis], alpha)
            state.velocity[0, axis] += force / (K + rim.sums[0])
        u += state.velocity[0]
        rim.note_velocities(state, pace.taken == 0)
        pace.note_velocities([rim], state.velocity)
        taken = pace.due(n + 1)
        if taken:
            rim.before[:] = rim.path / taken
            pauses.append(taken)
        speeds.append(rim.speed(state.velocity)[0])
    return np.array(speeds), pauses


@pytest.mark.parametrize("angle", [0.0, 29.0])
def test_the_ratio_of_a_zone_with_a_spring_is_half_that_of_their_stiffnesses(angle):
    """A square zone of constrained modulus M has static masses 2 M on every corner; M / 2 holds each end of a bar of it."""
    turn = np.radians(angle)
    c, s = np.cos(turn), np.sin(turn)
    xy = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]) @ [[c, s], [-s, c]]
    mass = static_masses(xy, np.array([[0, 1, 2, 3]]), np.array([7e8]))
    np.testing.assert_allclose(mass, 2.0 * 7e8, rtol=1e-12)
    spring, held = 1e8, 0.5 * 7e8
    assert stiffness_ratio(mass, np.full(4, spring)) == pytest.approx(0.5 * spring / held, rel=1e-12)


def test_pauses_double_up_to_the_interval_and_end_on_its_multiples():
    _, pauses = spring(Pace(50), k=0.1, v0=1e-6)
    assert max(pauses) == 50
    assert pauses[:4] == [1, 1, 1, 1]
    assert sum(pauses) <= 4000
    assert pauses[-60:] == [50] * 60
    assert len(pauses) < 120


def test_an_interval_of_one_exchanges_in_every_step():
    speeds, pauses = spring(Pace(1), k=100.0, v0=1e-6)
    assert pauses == [1] * 4000
    assert speeds.max() < 3e-6


@pytest.mark.parametrize("every", [2, 5, 50])
def test_a_contact_stiffer_than_the_zones_falls_back_before_the_first_pause(every):
    pace = Pace(every)
    _, pauses = spring(pace, k=1.01, steps=300, v0=1e-6)
    assert pauses == [1] * 300
    assert "1.01 times as stiff" in pace.report()["fell_back"]
    below = Pace(every)
    _, pauses = spring(below, k=0.99, steps=300, v0=1e-6)
    assert "as stiff" not in below.report()["fell_back"]
    assert max(pauses) > 1


@pytest.mark.parametrize("every", [2, 3, 5, 50])
@pytest.mark.parametrize("alpha", [0.0, 0.7])
@pytest.mark.parametrize("k", [1.5, 3.0, 30.0, 1000.0])
def test_growth_is_seen_before_the_motion_is_ten_times_as_fast(monkeypatch, every, alpha, k):
    """Stiffer than the limit allows: held forces make the motion grow, an exchange in every step does not."""
    monkeypatch.setattr("fdm_server.coupling.exchange_pauses.STIFFEST", np.inf)
    pace = Pace(every)
    speeds, pauses = spring(pace, k, alpha=alpha, v0=1e-6)
    assert speeds.max() < 10.0 * 1e-6
    assert pace.report()["fell_back"] == "the motion of the rim grew by itself"
    assert pauses[-100:] == [1] * 100


@pytest.mark.parametrize("every", [2, 20, 50])
def test_without_the_monitor_that_motion_grows_without_bound(monkeypatch, every):
    """det = 1 + a n (n - 1) / 2 above 1: what the monitor is for."""
    monkeypatch.setattr("fdm_server.coupling.exchange_pauses.STIFFEST", np.inf)
    monkeypatch.setattr("fdm_server.coupling.exchange_pauses.GROWTH", np.inf)
    speeds, _ = spring(Pace(every), 30.0, alpha=0.0, v0=1e-6, steps=200)
    assert speeds.max() > 1e-3


@pytest.mark.parametrize("k", [0.02, 0.05])
@pytest.mark.parametrize("over", [1, 30, 1000])
def test_loads_that_come_suddenly_or_gradually_are_no_growth(k, over):
    """From rest, a thousand times faster than the motion before. From k = .15 on it may be taken for growth."""
    pace = Pace(20)
    speeds, _ = spring(pace, k, push=lambda n: 1e-9 if n < 1000 else 1e-3 * min(1.0, (n - 1000) / over))
    assert speeds[1000:].max() > 1e3 * speeds[900:1000].max()
    assert pace.report()["fell_back"] == ""


def test_a_run_that_fell_back_stays_there():
    pace = Pace(50, fell_back="the motion of the rim grew by itself")
    _, pauses = spring(pace, k=0.1, steps=300, v0=1e-6)
    assert pauses == [1] * 300
    assert pace.report()["fell_back"] == "the motion of the rim grew by itself"


def problems(**changes):
    with pytest.raises(SceneError) as caught:
        build_scene(changes)
    return {problem.key: str(problem) for problem in caught.value.problems}


def test_real_time_and_scenes_without_windows_refuse_an_interval(configs):
    data = tomllib.loads((configs / "quick_slope.toml").read_text(encoding="utf-8")) | {"coupling": {"exchange_every": 5}}
    build_scene(data)
    data["stage"][0]["time"] = "real"  # the grid alone
    build_scene(data)
    data["stage"][3]["time"] = "real"
    assert "in real time" in problems(**data)["coupling.exchange_every"]
    assert "coupling.exchange_every" in problems(**data | {"coupling": {"exchange_every": 51}})
    alone = {key: value for key, value in data.items() if key not in ("window", "discs")}
    alone["stage"] = data["stage"][:1]
    assert "no window" in problems(**alone)["coupling.exchange_every"]
