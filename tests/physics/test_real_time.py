"""Real time: waves at their speeds by the leap-frog's own dispersion law, vibrations without drift, damping by closed forms.

A plane wave along rows of zones of length h is that of a chain: sin(w dt/2) = (c dt/h) sin(k h/2).
"""

from math import log, pi, sqrt

import numpy as np
import pytest
from zone_cases import DENSITY, PAPER, box, soil

from fdm_server.effects.damping import Damping
from fdm_server.effects.rayleigh import RayleighTable
from fdm_server.mesh.grid import build_grid
from fdm_server.model import build_model, new_state
from fdm_server.step import clock
from fdm_server.step.gridpoint_pass import update_velocities
from fdm_server.step.present_shape import begin_large_strain
from fdm_server.step.zone_pass import advance

M = PAPER.bulk + 4 * PAPER.shear / 3
CP, CS = sqrt(M / DENSITY), sqrt(PAPER.shear / DENSITY)
UNDAMPED = Damping(local=0.0)


def row(zones, h, axis, held=(), damping=UNDAMPED, factor=0.5, large=False):
    """A row of square zones in x whose gridpoints move in one axis only; gridpoints at x in `held` stay."""
    scene = box(zones * h, h, h, soil())
    model = build_model(scene, build_grid(scene))
    model.fixed[:, 1 - axis] = True
    model.fixed[np.isin(model.grid.xy[:, 0], held), axis] = True
    state = new_state(model)
    if large:
        begin_large_strain(model, state)
    return clock.begin(model, state, damping, factor), state


def displace(model, state, u):
    """Put displacements (N,) along the row's axis and the stresses that go with them."""
    axis = 0 if model.fixed[0, 1] else 1
    state.velocity[:, axis] = u / state.dt
    advance(model, state)
    state.velocity[:] = 0.0


def step(model, state):
    update_velocities(model, state, 0.0)
    advance(model, state)


def test_speeds_of_the_paper_material():
    assert pytest.approx(509.2, abs=0.05) == CP
    assert pytest.approx(235.7, abs=0.05) == CS


@pytest.mark.parametrize("large", [False, True])
@pytest.mark.parametrize(("axis", "c"), [(0, CP), (1, CS)])
def test_pulses_run_at_their_speed(axis, c, large):
    h, zones = 0.25, 512
    model, state = row(zones, h, axis, large=large)
    upper = model.grid.xy[:, 1] > 0
    x = model.grid.xy[~upper, 0][:-1]
    k = 2 * pi * np.fft.rfftfreq(zones, h)
    law = 2 / state.dt * np.arcsin(c * state.dt / h * np.sin(k * h / 2))
    pulse = 1e-6 * np.exp(-(((x - 40.0) / 2.0) ** 2))
    spectrum = np.fft.rfft(pulse)
    before = np.fft.irfft(spectrum * np.exp(1j * law * state.dt), zones)  # a step earlier, running to the right

    def everywhere(values):
        at = np.append(values, 0.0)
        full = np.empty(len(upper))
        full[~upper], full[upper] = at, at
        return full

    displace(model, state, everywhere(pulse))
    state.velocity[:, axis] = everywhere((pulse - before) / state.dt)
    steps = int(40.0 / c / state.dt)
    for _ in range(steps):
        step(model, state)
    now = np.fft.rfft(state.displacement[~upper, axis][:-1])
    waves = (k > 0) & (k < 1.5)
    phase = -np.unwrap(np.angle(now[waves] / spectrum[waves])) if not large else -np.angle(now[waves] / spectrum[waves])
    phase = phase + 2 * pi * np.rint((law[waves] * steps * state.dt - phase) / (2 * pi))
    np.testing.assert_allclose(phase / (k[waves] * steps * state.dt), law[waves] / k[waves], rtol=1e-4)
    peak = x[np.argmax(state.displacement[~upper, axis][:-1])]
    assert (peak - 40.0) / (steps * state.dt) == pytest.approx(c, rel=1e-2)
    assert phase[0] / (k[1] * steps * state.dt) == pytest.approx(c, rel=1e-3)


def tip_motion(zones, periods, damping=UNDAMPED, factor=0.5, large=False):
    """Times and displacements of the free end of a bar of 10 m, drawn out in its first mode and let go."""
    h = 10.0 / zones
    model, state = row(zones, h, 0, held=[0.0], damping=damping, factor=factor, large=large)
    displace(model, state, 1e-5 * np.sin(0.05 * pi * model.grid.xy[:, 0]))
    tip = np.argmax(model.grid.xy[:, 0])
    motion = [state.displacement[tip, 0]]
    count = int(periods * 40.0 / CP / state.dt * 1.02) + 2
    for _ in range(count):
        step(model, state)
        motion.append(state.displacement[tip, 0])
    return np.arange(count + 1) * state.dt, np.array(motion)


def crossings(t, u):
    i = np.flatnonzero(u[:-1] * u[1:] < 0)
    return t[i] - u[i] * (t[i + 1] - t[i]) / (u[i + 1] - u[i])


def test_period_of_a_bar_converges_with_the_square_of_the_zones():
    """Fixed at one end: 4 L/c. Errors +.0997, +.025, +.0062, +.0016 % with 10 .. 80 zones."""
    errors = []
    for zones in (10, 20, 40, 80):
        zero = crossings(*tip_motion(zones, 6))
        errors.append(2 * (zero[-1] - zero[0]) / (len(zero) - 1) / (40.0 / CP) - 1)
    assert errors[0] == pytest.approx(0.000997, rel=0.01)
    assert errors[3] == pytest.approx(0.000016, rel=0.05)
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    np.testing.assert_allclose(orders, 2.0, atol=0.05)


def test_an_undamped_bar_keeps_its_amplitude():
    t, u = tip_motion(10, 100)
    period = 40.0 / CP
    first, last = (np.abs(u[(t > a) & (t < a + 4 * period)]).max() for a in (0.0, 96 * period))
    assert last == pytest.approx(first, rel=1e-4)


def amplitudes(t, u):
    """Largest displacements of the half periods, by the parabola through three points."""
    i = np.flatnonzero((np.abs(u[1:-1]) >= np.abs(u[:-2])) & (np.abs(u[1:-1]) > np.abs(u[2:]))) + 1
    a, b, c = np.abs(u[i - 1]), np.abs(u[i]), np.abs(u[i + 1])
    return b - (c - a) ** 2 / (8 * (a - 2 * b + c))


@pytest.mark.parametrize("kind", ["local", "combined"])
def test_local_damping_takes_the_same_share_of_every_half_period(kind):
    """One gridpoint pair on one zone: with (1 - alpha) F on the way to the middle and (1 + alpha) F on the way out, amplitudes
    fall by sqrt((1 - alpha)/(1 + alpha)). Combined damping of a vibration about rest does the same."""
    alpha = 0.2
    t, u = tip_motion(1, 5, Damping(**{kind: alpha}), factor=0.01)
    peaks = amplitudes(t, u)
    np.testing.assert_allclose(peaks[1:6] / peaks[:5], sqrt((1 - alpha) / (1 + alpha)), rtol=5e-3)


@pytest.mark.parametrize("large", [False, True])
@pytest.mark.parametrize("part", ["mass", "stiffness", "both"])
def test_rayleigh_damping_has_its_fraction_at_its_frequency(part, large):
    """Logarithmic decrement 2 pi xi/sqrt(1 - xi^2); one zone: w^2 = 2 M/(rho h^2)."""
    xi, w = 0.05, sqrt(2 * M / DENSITY) / 10.0
    table = RayleighTable(fraction=xi, frequency=w / (2 * pi), part=part)
    t, u = tip_motion(1, 5, Damping(rayleigh=table), factor=0.02, large=large)
    peaks = amplitudes(t, u)
    decrement = 2 * log(peaks[0] / peaks[6]) / 6
    assert decrement == pytest.approx(2 * pi * xi / sqrt(1 - xi**2), rel=1e-2)


def test_rayleigh_damping_follows_its_two_branches():
    """xi = (a/w + b w)/2: at twice the frequency of least damping, 5/4 of it."""
    w = sqrt(2 * M / DENSITY) / 10.0
    table = RayleighTable(fraction=0.04, frequency=0.5 * w / (2 * pi))
    peaks = amplitudes(*tip_motion(1, 5, Damping(rayleigh=table), factor=0.02))
    assert 2 * log(peaks[0] / peaks[6]) / 6 == pytest.approx(2 * pi * 0.05 / sqrt(1 - 0.05**2), rel=1e-2)


def test_stiffness_damping_shortens_the_step_and_it_stays_stable():
    """At the whole stable step, far beyond critical damping of the highest mode."""
    table = RayleighTable(fraction=0.5, frequency=2.0, part="stiffness")
    model, state = row(8, 1.0, 0, held=[0.0], damping=Damping(rayleigh=table), factor=1.0)
    whole = row(8, 1.0, 0, factor=1.0)[1].dt
    assert state.dt < 0.1 * whole
    rng = np.random.default_rng(4)
    state.velocity[:] = 1e-6 * rng.normal(size=state.velocity.shape) * ~model.fixed
    first = np.abs(state.velocity).max()
    for _ in range(2000):
        step(model, state)
    assert np.abs(state.velocity).max() < first


@pytest.mark.parametrize("angle", [0.0, 27.0, 45.0])
def test_a_zone_breathes_at_its_frequency_in_any_direction(angle):
    """A free square zone of side h, a quarter of rho h^2 at each corner, corners displaced by a (+-1, +-1): it stores
    (K + G/3)(4 a/h)^2 h^2/2, rho h^2 a'^2 moves, so w^2 = 8 (K + G/3)/(rho h^2); leap-frog: sin(w' dt/2) = w dt/2."""
    a = np.radians(angle)
    R = np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]])
    scene = box(2.0, 2.0, 2.0, soil())
    grid = build_grid(scene)
    model = build_model(scene, grid._replace(xy=(grid.xy - 1.0) @ R.T))
    state = new_state(model)
    model = clock.begin(model, state, UNDAMPED, 0.5)
    state.velocity[:] = 1e-6 * model.grid.xy / state.dt
    advance(model, state)
    state.velocity[:] = 0.0
    start, motion = state.displacement.copy(), [1.0]
    for _ in range(2000):
        step(model, state)
        motion.append(np.sum(state.displacement * start) / np.sum(start**2))
    shape = state.displacement - motion[-1] * start
    assert np.abs(shape).max() < 1e-9 * np.abs(start).max()
    zero = crossings(np.arange(2001) * state.dt, np.array(motion))
    w = sqrt(8 * (PAPER.bulk + PAPER.shear / 3) / DENSITY) / 2.0
    law = 2 / state.dt * np.arcsin(w * state.dt / 2)
    assert pi * (len(zero) - 1) / (zero[-1] - zero[0]) == pytest.approx(law, rel=1e-5)


def test_free_fall_is_that_of_a_stone():
    scene = box(2.0, 2.0, 1.0, soil())
    model = build_model(scene, build_grid(scene))
    state = new_state(model)
    model = clock.begin(model, state, UNDAMPED, 0.5)
    for _ in range(400):
        update_velocities(model, state, 9.81)
        advance(model, state)
    t = 400 * state.dt
    np.testing.assert_allclose(state.velocity[:, 1], -9.81 * t, rtol=1e-12)
    np.testing.assert_allclose(state.displacement[:, 1], -0.5 * 9.81 * t * (t + state.dt), rtol=1e-10)
    assert np.abs(state.stress).max() < 1e-6


def driven(damping, steps=4000):
    """A row of zones whose ends both move at the same speed, with a vibration: its energy after static steps over that before."""
    model, state = row(8, 1.0, 0, held=[0.0, 8.0])
    model = clock.begin(model, state, damping)
    rng = np.random.default_rng(1)
    ends = model.fixed[:, 0].copy()
    state.velocity[:, 0] = 1e-3 + 1e-5 * rng.normal(size=len(ends)) * ~ends

    def vibration():
        return np.sum((model.mass * (state.velocity[:, 0] - 1e-3) ** 2)[~ends])

    first, last = vibration(), []
    for _ in range(steps):
        update_velocities(model, state, 0.0)
        state.velocity[ends, 0] = 1e-3
        advance(model, state)
        last.append(vibration())
    return max(last[-200:]) / first


def test_combined_damping_stills_a_body_in_steady_motion_where_local_damping_cannot():
    assert driven(Damping(combined=0.8)) < 1e-12
    assert driven(Damping(local=0.8)) > 1e-2


def test_velocities_do_not_pass_between_static_and_real_time():
    model, state = row(4, 1.0, 0)
    state.velocity[:] = 1.0
    clock.begin(model, state, UNDAMPED, 0.25)
    assert state.velocity.all()
    clock.begin(model, state, UNDAMPED)
    assert state.dt is None
    assert not state.velocity.any()


def test_large_strain_shortens_the_step_with_the_zones():
    model, state = row(4, 1.0, 0, large=True)
    start = state.dt
    for _ in range(400):
        state.velocity[:, 0] = -0.5 * model.grid.xy[:, 0] / (400 * start)
        advance(model, state)
    length = 1 + state.displacement[-1, 0] / 4
    expected = start * length / sqrt((1 + length**2) / 2)  # A/L of half a rectangle
    assert state.dt == pytest.approx(expected, rel=0.05)
