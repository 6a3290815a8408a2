"""Walls with servos hold their pressure: boxes at any angle, few contacts, real time; the sample answers as its springs say."""

import numpy as np
import pytest
from disc_cases import KN, loose_discs
from verification.discrete.scenes import SOIL, computed, tables

from coupler_protocol.problems import SceneError
from coupler_protocol.scene.reader import build_scene
from dem_server.effects.damping import Damping
from dem_server.effects.dashpot import Dashpot
from dem_server.insitu.contact_stress import contact_moments
from dem_server.observe import wall_forces
from dem_server.pairs import contacts
from dem_server.step import servo
from dem_server.step.contact_pass import contact_forces
from dem_server.step.cycle import advance, in_real_time, in_static_mode
from dem_server.step.masses import safety
from dem_server.step.walls import make_walls

R = 0.03
REST = {"name": "press", "kind": "discs", "until": {"ratio": 1e-7, "steps": 50000}}


def box(turn, pressures, inside=0.04, beyond=0.2):
    """Polygon of a square of 1 m turned by `turn` degrees, and four walls that cross beyond its corners, with servos."""
    c, s = np.cos(np.radians(turn)), np.sin(np.radians(turn))
    turned = np.array([[c, s], [-s, c]])
    low, high, first, last = inside, 1.0 - inside, -beyond, 1.0 + beyond
    across = [[[first, low], [last, low]], [[last, high], [first, high]]]
    upwards = [[[high, first], [high, last]], [[low, last], [low, first]]]
    lines = [across[0], upwards[0], across[1], upwards[1]]
    steer = [{"pressure": p, "fastest": 1e-3} for p in (pressures[1], pressures[0]) * 2]
    walls = [{"ends": (np.array(line) @ turned).tolist(), "servo": table} for line, table in zip(lines, steer, strict=True)]
    return (np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]) @ turned).tolist(), walls


def stress_between(state, area):
    """Stress xx, yy, xy [Pa] from all contacts of discs that walls enclose, in the `area` [m2] between the walls."""
    virial = wall_forces.on_discs(state)[1].sum(axis=0)[[0, 1, 3]]
    return (contact_moments(contacts(state)).sum(axis=0) + virial) / area


@pytest.mark.parametrize("turn", [0.0, 30.0])
def test_a_box_holds_its_pressures(turn):
    """100 kPa one way, 160 kPa the other: on the walls, and normal to them in the stress averaged over all contacts."""
    polygon, walls = box(turn, (160e3, 100e3))
    discs = {"radius": 0.05, "confinement": 2e4, "wall": walls, "damping": {"local": 0.7}}
    smooth = {"ring": {"spring": SOIL["spring"]}}
    _, state, _, results = computed(tables([REST], discs, every=10**9, window=[{"name": "box", "polygon": polygon}], **smooth))
    assert results[1]["ended_by"].startswith("ratio")
    np.testing.assert_allclose(servo.pressures(state.walls), [100e3, 160e3, 100e3, 160e3], rtol=1e-6)
    width, height = (-(state.walls.force[w] @ state.walls.servo.inward[w]) / p for w, p in ((0, 100e3), (1, 160e3)))
    xx, yy, xy = stress_between(state, width * height)
    stress = np.array([[xx, xy], [xy, yy]])
    for w, pressure in ((0, 100e3), (1, 160e3)):
        normal = state.walls.servo.inward[w]
        assert normal @ stress @ normal == pytest.approx(-pressure, rel=1e-6)
    assert 0.8 < width < 0.95


def between_walls(xy, top, velocity=(0.0, 0.0), pressure=None, average=1.0, fastest=1.0, **changes):
    """Discs of radius R on a wall below them and under one that is 1 m long, comes down with `velocity` or holds a pressure."""
    model, state = loose_discs(xy, np.full(len(xy), R), bond=None, **changes)
    ends = np.array([[-0.5, -R, 0.5, -R], [-0.5, top, 0.5, top]])
    walls = make_walls(ends, [[0.0, 0.0], velocity], model, None if pressure is None else servo.make_servo(ends, state.x))
    if pressure is not None:
        walls.servo.pressure[1], walls.servo.fastest[1], walls.servo.average[1] = pressure, fastest, average
    state.walls = walls
    contact_forces(model, state)
    return model, state


@pytest.mark.parametrize("average", [1.0, 10.0])
@pytest.mark.parametrize("beta", [0.0, 0.2])
def test_one_disc_in_real_time(beta, average):
    """The wall comes at its fastest, meets the disc, and stands where two springs in series carry 100 kN."""
    dashpot = Dashpot(normal=beta, shear=beta) if beta else None
    model, state = between_walls([[0.0, 0.0]], 4.0 * R, pressure=1e5, average=average, dashpot=dashpot, damping=None)
    model = in_real_time(model, state, 0.1)
    time = advance(model, state, 0.0, 100)
    assert state.walls.ends[1, 1] == pytest.approx(4.0 * R - time, abs=1e-12)
    highest = 0.0
    for _ in range(1500):
        advance(model, state, 0.0, 10)
        highest = max(highest, -float(state.walls.force[1] @ state.walls.servo.inward[1]))
    assert -state.walls.force[1] @ state.walls.servo.inward[1] == pytest.approx(1e5, rel=1e-3)
    assert state.walls.ends[1, 1] == pytest.approx(R - 2.0 * 1e5 / KN, abs=1e-5 * R)
    assert highest < 1.1e5


def test_a_wall_that_loses_its_discs_follows_them():
    """In static mode the wall touches two discs; one is taken away, then the other goes on alone under the whole force."""
    model, state = between_walls([[-0.2, 0.0], [0.2, 0.0]], R, pressure=5e4, fastest=1e-4, damping=Damping(local=0.7))
    model = in_static_mode(model, state)
    advance(model, state, 0.0, 2000)
    assert state.walls.ends[1, 1] == pytest.approx(R - 5e4 / KN, rel=1e-6)
    state.x[1] = [0.2, 2.0]
    advance(model, state, 0.0, 2000)
    assert state.walls.ends[1, 1] == pytest.approx(R - 2.0 * 5e4 / KN, rel=1e-6)


def test_stiffness_of_a_square_array_under_side_pressure():
    """n columns of m discs on top of each other: dF / dy = n / ((m - 1) / kn + 2 / kn), and the sides keep their pressure."""
    columns, rows = 5, 6
    side = 2.0 * R * np.arange(max(columns, rows))
    xy = np.stack(np.meshgrid(side[:columns], side[:rows]), axis=-1).reshape(-1, 2)
    model, state = loose_discs(xy, np.full(len(xy), R), bond=None, friction=None, damping=Damping(local=0.7))
    right, top = side[columns - 1] + R, side[rows - 1] + R
    ends = np.array([[-1.0, -R, 1.0, -R], [-1.0, top, 1.0, top], [-R, -1.0, -R, 1.0], [right, -1.0, right, 1.0]])
    state.walls = make_walls(ends, np.zeros((4, 2)), model, servo.make_servo(ends, state.x))
    state.walls.servo.pressure[1:], state.walls.servo.fastest[:] = 20e3, 1e-4
    contact_forces(model, state)
    model = in_static_mode(model, state)
    advance(model, state, 0.0, 4000)
    np.testing.assert_allclose(servo.pressures(state.walls), 20e3, rtol=1e-6)
    before, length = state.walls.force[1, 1], side[columns - 1] + 2.0 * R
    assert before == pytest.approx(20e3 * length, rel=0.02)  # the box is a little narrower by now
    state.walls.servo.pressure[1] = 0.0
    state.walls.velocity[1] = [0.0, -1e-9]
    advance(model, state, 0.0, 2000)
    state.walls.velocity[1] = 0.0
    advance(model, state, 0.0, 4000)
    stiffness = (state.walls.force[1, 1] - before) / 2e-6
    assert stiffness == pytest.approx(columns * KN / (rows + 1), rel=1e-4)
    np.testing.assert_allclose(servo.pressures(state.walls)[2:], 20e3, rtol=1e-6)


PIECES = [[-0.5, 0.0], [0.5, 0.0]], [[0.2, 0.5], [0.2, -0.1], [-0.5, -0.1]]  # first and last x


@pytest.mark.parametrize("pieces", PIECES)
@pytest.mark.parametrize(("real", "average"), [(None, 1.0), (0.1, 1.0), (0.1, 5.0)])
def test_pieces_of_a_servo_wall_are_one_wall(pieces, real, average):
    """Discs under the middle, under joints and beside them, on one side only: place, force and pressure as of one wall."""
    xy, found = np.array([[-0.1, 0.0], [0.0, 0.0], [0.2, 1e-4], [0.2, 2.0 * R]]), []
    dashpot, damping = Dashpot(normal=0.2, shear=0.2), None if real else Damping(local=0.7)
    for top in ([[-0.5, 0.5]], pieces):
        model, state = loose_discs(xy, np.full(len(xy), R), bond=None, dashpot=dashpot, damping=damping)
        ends = np.array([[-0.5, -R, 0.5, -R], *([first, 3.01 * R, last, 3.01 * R] for first, last in top)])
        state.walls = make_walls(ends, np.zeros((len(ends), 2)), model, servo.make_servo(ends, state.x))
        table = state.walls.servo
        table.pressure[1:], table.fastest[1:], table.average[1:] = 4e4, 0.3 if real else 1e-5, average
        contact_forces(model, state)
        model = in_static_mode(model, state) if real is None else in_real_time(model, state, real)
        advance(model, state, 9.81, 1500)
        pressures = servo.pressures(state.walls)[1:]
        assert (pressures == pressures[0]).all()
        assert (state.walls.ends[1:, 1] == state.walls.ends[1, 1]).all()
        found.append([state.walls.ends[1, 1], *state.x.ravel(), 1e-5 * pressures[0], 1e-5 * state.walls.force[1:, 1].sum()])
    assert found[0][-1] > 0.0
    np.testing.assert_allclose(found[1], found[0], atol=1e-9)


def test_servo_walls_beside_each_other_move_by_themselves():
    """Two pistons with a gap between them, or with different pressures: each holds its own."""
    for gap, second in ((0.02, 5e4), (0.0, 8e4)):
        xy = np.array([[-0.2, 0.0], [0.2, 0.0], [0.3, 0.0]])
        model, state = loose_discs(xy, np.full(3, R), bond=None, damping=Damping(local=0.7))
        ends = np.array([[-0.5, -R, 0.5, -R], [-0.5, R, 0.0, R], [gap, R, 0.5, R]])
        state.walls = make_walls(ends, np.zeros((3, 2)), model, servo.make_servo(ends, state.x))
        state.walls.servo.pressure[1:], state.walls.servo.fastest[1:] = [5e4, second], 1e-4
        contact_forces(model, state)
        model = in_static_mode(model, state)
        advance(model, state, 0.0, 3000)
        np.testing.assert_allclose(servo.pressures(state.walls)[1:], [5e4, second], rtol=1e-6)


def test_a_piece_around_an_edge_does_not_shorten_a_servo_wall():
    """Walls that meet at their ends, but for rounding, cut nothing off: both stay as long as they are."""
    x, y = 0.1 + 0.2, 0.3
    for offset in (0.0, 1e-16, -1e-16, 1e-13, -1e-13):
        ends = np.array([[0.0, 0.0, x, y], [x + offset, y - offset, 0.9, 0.1]])
        found = np.empty(2)
        for xy in ([[0.3, 1.0]], [[0.3, -1.0]]):
            servo.measure(ends, servo.make_servo(ends, np.array(xy)).inward, found)
            np.testing.assert_allclose(found, np.hypot(*(ends[:, 2:] - ends[:, :2]).T), rtol=1e-9)


@pytest.mark.parametrize(("real", "average", "speed"), [(None, 1.0, 1e-5), (0.1, 1.0, 0.2), (0.1, 2.0, 0.05)])
def test_a_wall_keeps_its_pressure_while_another_one_moves(real, average, speed):
    """The floor of a column of six discs sinks steadily and the servo wall follows: its pressure lags by nothing but rounding."""
    column = np.column_stack([np.zeros(6), 2.0 * R * np.arange(6.0)])
    dashpot, damping = Dashpot(normal=0.2), None if real else Damping(local=0.7)
    changes = {"pressure": 5e4, "fastest": 1.0, "average": average, "dashpot": dashpot, "friction": None, "damping": damping}
    model, state = between_walls(column, 11.0 * R, **changes)
    model = in_static_mode(model, state) if real is None else in_real_time(model, state, real)
    advance(model, state, 0.0, round(4000 * average**2))
    np.testing.assert_allclose(servo.pressures(state.walls)[1], 5e4, rtol=1e-6)
    assert state.walls.servo.drift[1] == 0.0
    state.walls.velocity[0, 1] = -speed
    advance(model, state, 0.0, round(16000 * average**2))
    assert servo.pressures(state.walls)[1] == pytest.approx(5e4, rel=1e-5)
    assert state.walls.velocity[1, 1] == pytest.approx(-speed, rel=1e-4)


def test_walls_from_afar_are_felt_in_the_masses():
    """A wall comes to a disc that rests: when it touches, the static mass counts both walls, m = 2 kn / sf^2."""
    model, state = between_walls([[0.0, 0.0]], 3.0 * R, velocity=(0.0, -1e-3), friction=None, damping=Damping(local=0.7))
    model = in_static_mode(model, state)
    assert state.mass[0] == pytest.approx(KN / safety(model.law.damping) ** 2, rel=1e-12)
    advance(model, state, 0.0, 61)
    assert state.walls.force[1, 1] > 0.0
    assert state.mass[0] == pytest.approx(2.0 * KN / safety(model.law.damping) ** 2, rel=1e-12)


def test_the_length_that_counts():
    """Walls that cross count between the crossings, on the discs' side; ends that stand apart count whole; oblique ones too."""
    ends = np.array([[-1.0, 0.0, 3.0, 0.0], [0.0, -1.0, 0.0, 3.0], [2.0, -1.0, 1.0, 3.0], [-1.0, 2.5, -0.5, 2.5]])
    found = np.empty(4)
    servo.measure(ends, servo.make_servo(ends, np.array([[0.8, 0.5]])).inward, found)
    np.testing.assert_allclose(found, [1.75, 3.0, np.hypot(0.75, 3.0), 0.5], rtol=1e-12)


GROUND = {"name": "ground", "ends": [[-1.0, 0.0], [2.0, 0.0]]}
STOP = {"kind": "discs", "until": {"steps": 5}}
STEER = {"pressure": 1e5, "fastest": 1e-4}


@pytest.mark.parametrize(
    ("walls", "stage", "why"),
    [
        ([GROUND | {"servo": STEER, "velocity": [0.0, 1.0]}], {}, "a velocity or a servo, not both"),
        ([GROUND, GROUND], {}, "two walls are named 'ground'"),
        ([GROUND | {"servo": {"pressure": -1.0, "fastest": 1.0}}], {}, "greater than 0"),
        ([GROUND], {"wall": [{"name": "roof"}]}, "no wall is named 'roof'"),
        ([GROUND | {"servo": STEER}], {"time": "real"}, "m/s in some stages"),
    ],
)
def test_walls_that_are_refused(walls, stage, why):
    window = [{"name": "w", "polygon": [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]]}]
    stages = [STOP | {"name": "a"}, STOP | {"name": "b"} | stage]
    with pytest.raises(SceneError, match=why):
        build_scene(tables(stages, {"wall": walls}, window=window))


def test_the_same_wall_may_change_with_the_time():
    window = [{"name": "w", "polygon": [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]]}]
    anew = {"time": "real", "wall": [{"name": "ground", "velocity": [0.0, 0.1]}]}
    stages = [STOP | {"name": "a"}, STOP | {"name": "b"} | anew]
    assert build_scene(tables(stages, {"wall": [GROUND | {"servo": STEER}]}, window=window)).stage[2].wall[0].moves


def test_a_wall_too_fast_for_its_discs_is_refused():
    wall = GROUND | {"servo": {"pressure": 1e5, "fastest": 0.1}}
    stage = STOP | {"name": "a"}
    with pytest.raises(SceneError, match="pass through discs"):
        computed(tables([stage], {"wall": [wall]}, window=[{"name": "w", "polygon": [[0.0, 0.1], [1.0, 0.1], [1.0, 1.1]]}]))
