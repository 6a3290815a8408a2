"""Walls that meet are one surface: a disc notices neither joints nor the order or direction in which walls were drawn."""

import numpy as np
import pytest
from disc_cases import KN, KS, loose_discs
from verification.discrete import scenes

from dem_server.effects.damping import Damping
from dem_server.effects.dashpot import Dashpot
from dem_server.effects.friction import Friction
from dem_server.effects.rolling import Rolling
from dem_server.observe import energy, wall_forces
from dem_server.observe.unbalanced_ratio import unbalanced_ratio
from dem_server.step import walls
from dem_server.step.contact_pass import contact_forces
from dem_server.step.cycle import advance, in_real_time, in_static_mode
from dem_server.step.masses import safety

R, G = 0.03, 9.81
ONE_PIECE = [[-9.0, 0.0, 9.0, 0.0]]
IN_PIECES = {
    "two": [[-9.0, 0.0, 0.0, 0.0], [0.0, 0.0, 9.0, 0.0]],
    "reversed": [[0.0, 0.0, -9.0, 0.0], [9.0, 0.0, 0.0, 0.0]],
    "shuffled, short": [[0.4, 0.0, 9.0, 0.0], [-9.0, 0.0, 0.0, 0.0], [1e-3, 0.0, 0.0, 0.0], [1e-3, 0.0, 0.4, 0.0]],
    "overlapping": [[-9.0, 0.0, 0.01, 0.0], [-0.02, 0.0, 9.0, 0.0]],
    "a T from below": [[-9.0, 0.0, 9.0, 0.0], [0.0, 0.0, 0.3, -1.0]],
    "twice the same": [[-9.0, 0.0, 9.0, 0.0], [9.0, 0.0, -9.0, 0.0]],
}


def with_walls(xy, ends, velocity=None, radius=R, **changes):
    """Model and State of discs and of walls."""
    model, state = loose_discs(xy, np.full(len(xy), radius), bond=None, **changes)
    state.walls = walls.make_walls(ends, np.zeros((len(ends), 2)) if velocity is None else velocity, model)
    contact_forces(model, state)
    return model, state


def turned(ends, angle):
    """Walls turned about the origin."""
    c, s = np.cos(angle), np.sin(angle)
    return (np.asarray(ends).reshape(-1, 2) @ np.array([[c, s], [-s, c]])).reshape(-1, 4)


def touched(state):
    """Number of walls that each disc touches (n,)."""
    return np.count_nonzero(state.walls.normal, axis=1)


# -- straight joints -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("pieces", IN_PIECES.values(), ids=IN_PIECES)
@pytest.mark.parametrize("angle", [0.0, 0.7])
def test_a_disc_on_a_joint_rebounds_as_from_one_wall(pieces, angle):
    """e = exp(-pi beta / sqrt(1 - beta^2)), in the middle of the joint."""
    (up,) = turned([[0.0, 0.0, 0.0, 1.0]], angle)[:, 2:]
    dashpot = Dashpot(normal=0.2, tension=True)
    model, state = with_walls([R * up], turned(pieces, angle), friction=None, damping=None, dashpot=dashpot)
    model = in_real_time(model, state, 1e-3)
    state.v[0] = -up
    advance(model, state, 0.0, round(4.0 * np.sqrt(state.mass[0] / KN) / state.next_dt))
    np.testing.assert_allclose(state.v[0], np.exp(-np.pi * 0.2 / np.sqrt(0.96)) * up, atol=1e-3)


def test_the_scene_of_the_joint():
    """A disc drops with 0.1 m/s on the joint of two pieces of a floor: without tension it leaves with e = 0.57174."""
    soil = {"density": 2000.0, "spring": {"normal": 1e7, "shear": 5e6}, "dashpot": {"normal": 0.2}}
    walls = [{"ends": [[-2.0, 0.0], [0.0, 0.0]]}, {"ends": [[0.0, 0.0], [2.0, 0.0]]}]
    stage = {"name": "hit", "kind": "discs", "time": "real", "step_factor": 1e-3, "until": {"time": 0.02}}
    table = {"radius": 0.1, "stiffness": "contact", "soil": soil, "wall": walls}
    disc = [0.0, 0.1, 0.1, 0.0, -0.1, 0.0]
    with scenes.of_file([disc], "x,y,radius,vx,vy,spin", [stage], table, every=10**9) as run:
        assert run.discs(-1).velocity[0, 1] == pytest.approx(0.057174, rel=2e-4)


@pytest.mark.parametrize("pieces", IN_PIECES.values(), ids=IN_PIECES)
def test_a_disc_on_a_joint_overlaps_by_its_weight_over_one_spring(pieces):
    model, state = with_walls([[0.0, R]], pieces, damping=Damping(local=0.7))
    model = in_static_mode(model, state)
    advance(model, state, G, 500)
    weight = state.weight[0] * G
    assert unbalanced_ratio(model, state, G) < 1e-8
    assert R - state.x[0, 1] == pytest.approx(weight / KN, rel=1e-9)
    assert energy.stored(model, state) == pytest.approx(0.5 * weight**2 / KN, rel=1e-9)
    np.testing.assert_allclose(state.walls.force.sum(axis=0), [0.0, -weight], rtol=1e-9, atol=1e-9 * weight)
    assert touched(state)[0] == 1
    force, virial = wall_forces.on_discs(state)
    np.testing.assert_allclose([force[0, 1], virial[0, 1]], [weight, -weight * state.x[0, 1]], rtol=1e-9)


def driven(ends, speed, angle, steps, **changes):
    """Records (steps, 6) of a disc that comes along an oblique floor without spin: place, velocity, shear force, spin."""
    along, up = turned([[1.0, 0.0, 0.0, 1.0]], angle).reshape(2, 2)
    press = 2000.0 * np.pi * R**2 * G * np.cos(angle) / KN
    model, state = with_walls([(R - press) * up - 0.1 * along], turned(ends, angle), damping=None, **changes)
    model = in_real_time(model, state, 0.1)
    state.v[0] = speed * along
    found = []
    for _ in range(steps):
        advance(model, state, G, 1)
        found.append([*state.disc[0, :4], state.walls.shear.sum(), state.spin[0]])
        assert touched(state)[0] <= 1
    return np.array(found)


LAWS = {"slides": (0.1, None), "rolls": (0.9, None), "turns hardly": (0.9, 0.4)}


@pytest.mark.parametrize("pieces", IN_PIECES.values(), ids=IN_PIECES)
@pytest.mark.parametrize(("friction", "rolling"), LAWS.values(), ids=LAWS)
@pytest.mark.parametrize(("speed", "angle"), [(2.0, -0.3), (30.0, 0.2)])
def test_a_disc_that_slides_or_rolls_over_joints_does_not_notice(pieces, friction, rolling, speed, angle):
    """Place, velocity, spin, shear force and rolling moment are in every step those on one wall, however far the steps reach."""
    changes = {"friction": Friction(coefficient=friction), "rolling": rolling and Rolling(coefficient=rolling)}
    changes["dashpot"] = Dashpot(normal=0.2, shear=0.2)
    steps = round(0.3 / speed / 1.7e-5)
    one, several = (driven(ends, speed, angle, steps, **changes) for ends in (ONE_PIECE, pieces))
    assert one[0, 0] < 0.0 < one[-1, 0]
    assert np.abs(one[:, 4]).max() > 0.0
    scale = np.abs(one).max(axis=0)
    np.testing.assert_allclose(several / scale, one / scale, atol=1e-9)


def test_a_sliding_disc_keeps_its_friction():
    """Over a joint: Fn = w and Fs = mu w to 1e-9, once the contact has come to rest."""
    press = 2000.0 * np.pi * R**2 * G / KN
    model, state = with_walls([[-0.01, R - press]], IN_PIECES["two"], friction=Friction(coefficient=0.2), damping=None)
    model = in_real_time(model, state, 0.1)
    state.v[0, 0], weight = 1.0, state.weight[0] * G
    advance(model, state, G, 100)
    for _ in range(1500):
        advance(model, state, G, 1)
        np.testing.assert_allclose(state.force[0], [-0.2 * weight, weight], rtol=1e-9)
    assert state.x[0, 0] > 0.01


@pytest.mark.parametrize("shift", [-0.12 * R, 0.01 * R, 0.12 * R])
def test_a_disc_at_rest_keeps_its_history_where_the_joint_moves(shift):
    """On a slope, held by friction and rolling resistance: the joint moves from one side of the contact to the other."""
    along, up = turned([[1.0, 0.0, 0.0, 1.0]], -0.2).reshape(2, 2)
    friction, rolling = Friction(coefficient=0.5), Rolling(coefficient=0.4)
    ends = turned(IN_PIECES["two"], -0.2)
    ends[[0, 1], [2, 0]], ends[[0, 1], [3, 1]] = -shift * along
    model, state = with_walls([R * up], ends, friction=friction, rolling=rolling, damping=Damping(local=0.7))
    model = in_static_mode(model, state)
    advance(model, state, G, 4000)
    assert unbalanced_ratio(model, state, G) < 1e-9
    old = int(shift > 0.0)
    before, rolled = state.walls.shear[0].copy(), state.walls.rolled[0].copy()
    assert abs(before[old]) == pytest.approx(state.weight[0] * G * np.sin(0.2), rel=1e-6)
    assert rolled[old] != 0.0
    state.walls.ends[[0, 1], [2, 0]], state.walls.ends[[0, 1], [3, 1]] = shift * along
    contact_forces(model, state)
    np.testing.assert_allclose(state.walls.shear[0], before[::-1], atol=1e-9 * abs(before[old]))
    np.testing.assert_allclose(state.walls.rolled[0], rolled[::-1], atol=1e-9 * abs(rolled[old]))
    assert unbalanced_ratio(model, state, G) < 1e-8


@pytest.mark.parametrize("pieces", IN_PIECES.values(), ids=IN_PIECES)
def test_walls_that_move_together_stay_one_surface(pieces):
    """A floor of pieces that rises and moves along carries a disc as one wall does."""
    found = []
    for ends in (ONE_PIECE, pieces):
        velocity = np.tile([0.7, 0.1], (len(ends), 1))
        model, state = with_walls([[0.01, R]], ends, velocity, damping=None, dashpot=Dashpot(normal=0.2, shear=0.2))
        model = in_real_time(model, state, 0.1)
        advance(model, state, G, 3000)
        found.append(np.concatenate([state.disc[0, :5], [state.walls.shear.sum()]]))
    np.testing.assert_allclose(found[1], found[0], rtol=1e-9, atol=1e-9)


def test_pieces_that_part_are_two_walls():
    """The right half of a floor sinks by 0.2 R: what lies on the step touches the edge of one and the face of the other."""
    model, state = with_walls([[0.3 * R, R]], IN_PIECES["two"], friction=None, damping=None)
    contact_forces(model, state)
    assert touched(state)[0] == 0
    state.walls.ends[1, [1, 3]] = -0.1 * R
    state.x[0] = [0.3 * R, 0.89 * R]
    contact_forces(model, state)
    edge = np.array([0.3, 0.89]) / np.hypot(0.3, 0.89)
    expected = KN * R * ((1.0 - np.hypot(0.3, 0.89)) * edge + 0.01 * np.array([0.0, 1.0]))
    np.testing.assert_allclose(state.force[0], expected, rtol=1e-9)


# -- edges and corners -----------------------------------------------------------------------------------------------

EDGE = [[-1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.4, -1.0]]


@pytest.mark.parametrize("backwards", [False, True])
def test_around_an_edge_the_normal_turns(backwards):
    """Places around an edge of 248 degrees: one force kn u, from the nearest point of the surface."""
    ends = np.array(EDGE)[::-1, [2, 3, 0, 1]] if backwards else np.array(EDGE)
    model, state = with_walls([[0.0, 3.0 * R]], ends, friction=None)
    along = np.array([0.4, -1.0]) / np.hypot(0.4, 1.0)
    out = np.array([-along[1], along[0]])
    for where in np.linspace(-1.0, 2.2, 65):
        if where < 0.0:
            nearest, away = np.array([where * R, 0.0]), np.array([0.0, 1.0])
        elif where > np.arctan2(out[0], out[1]):
            nearest, away = (where - np.arctan2(out[0], out[1])) * R * along, out
        else:
            nearest, away = np.zeros(2), np.array([np.sin(where), np.cos(where)])
        state.x[0] = nearest + 0.97 * R * away
        contact_forces(model, state)
        np.testing.assert_allclose(state.force[0], 0.03 * R * KN * away, atol=1e-9 * R * KN)
        assert energy.stored(model, state) == pytest.approx(0.5 * KN * (0.03 * R) ** 2, rel=1e-9)


@pytest.mark.parametrize("friction", [None, 50.0])
def test_a_disc_that_rolls_over_an_edge_keeps_its_energy(friction):
    """Slow enough to stay on the edge, without damping: kinetic, elastic and potential energy together stay, smooth or rough."""
    press = 2000.0 * np.pi * R**2 * G / KN
    edge = [[-1.0, 0.0, 0.0, 0.0], [0.0, 0.0, np.cos(0.5), -np.sin(0.5)]]
    friction = friction and Friction(coefficient=friction)
    model, state = with_walls([[-0.05, R - press]], edge, friction=friction, damping=None)
    model = in_real_time(model, state, 0.05)
    state.v[0, 0] = 0.3
    if friction:
        state.spin[0] = -0.3 / (R - 0.5 * press)
    total, numbers = [], []
    for _ in range(2500):
        advance(model, state, G, 5)
        total.append(energy.kinetic(model, state) + energy.stored(model, state) + energy.potential(state, G))
        numbers += np.flatnonzero(state.walls.normal[0]).tolist()
    assert len(numbers) == 2500  # one contact at any time
    assert set(numbers) == {0, 1}
    assert state.x[0, 0] > R
    np.testing.assert_allclose(total, total[0], rtol=5e-4)


def test_a_disc_that_bounces_in_a_chain_of_walls_keeps_its_energy():
    """A valley of 40 pieces, some longer and some shorter than the disc, smooth and without damping."""
    angle = np.pi * np.sort(np.concatenate([np.linspace(1.0, 2.0, 21), 1.0 + np.random.default_rng(5).uniform(0.0, 1.0, 20)]))
    points = 0.3 * np.column_stack([np.cos(angle), np.sin(angle)])
    ends = np.hstack([points[:-1], points[1:]])
    model, state = with_walls([[0.17, 0.0]], ends, friction=None, damping=None)
    model = in_real_time(model, state, 0.02)
    total, several = [], 0
    for _ in range(1000):
        advance(model, state, G, 100)
        several += touched(state)[0] > 1
        if energy.stored(model, state) == 0.0:  # in flight
            total.append(energy.kinetic(model, state) + energy.potential(state, G))
    assert len(total) > 100
    assert several > 0
    np.testing.assert_allclose(total, total[0], atol=5e-3 * state.weight[0] * G * 0.27)


def about_the_edge(state):
    (x, y), (u, v) = state.x[0], state.v[0]
    return x * v - y * u


def test_off_an_edge_angular_momentum_is_kept():
    """Smooth: the force of an edge passes through it, so x times v about the edge and the spin stay, in any order of walls."""
    for ends in (EDGE, EDGE[::-1]):
        model, state = with_walls([[0.3 * R, 1.2 * R]], ends, friction=None, damping=None)
        model = in_real_time(model, state, 1e-3)
        state.v[0], state.spin[0] = [0.0, -1.0], 7.0
        momentum = about_the_edge(state)
        advance(model, state, 0.0, round(0.6 * R / state.next_dt))
        assert np.hypot(*state.v[0]) == pytest.approx(1.0, abs=1e-3)
        assert state.v[0, 0] > 0.1
        assert about_the_edge(state) == pytest.approx(momentum, rel=1e-6)
        assert state.spin[0] == 7.0


@pytest.mark.parametrize("ends", [[[0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]], [[-1.0, 0.0, 1.0, 0.0], [0.0, -1.0, 0.0, 1.0]]])
def test_a_corner_has_two_contacts(ends):
    """Ends that meet, or walls that cross, at 90 degrees: both springs act, both count in the static mass."""
    model, state = with_walls([[0.99 * R, 0.98 * R]], ends, friction=None, damping=None)
    np.testing.assert_allclose(state.force[0], [0.01 * R * KN, 0.02 * R * KN], rtol=1e-9)
    assert touched(state)[0] == 2
    in_static_mode(model, state)
    assert state.mass[0] == pytest.approx((KN + KS) / safety(None) ** 2, rel=1e-9)
    assert state.walls.force.sum(axis=0) == pytest.approx(-state.force[0])


@pytest.mark.parametrize("bend", [1e-9, 1e-6, 1e-3, 0.02, -1e-9, -1e-3, -0.02])
def test_a_bend_that_vanishes_is_a_joint(bend):
    """Two pieces at an angle of 180 degrees -+ bend: a disc that falls on it rebounds as from a plane, but for the bend."""
    ends = [[-1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, np.tan(bend)]]
    dashpot = Dashpot(normal=0.2, tension=True)
    model, state = with_walls([[0.0, R]], ends, friction=None, damping=None, dashpot=dashpot)
    model = in_real_time(model, state, 1e-3)
    state.v[0] = [0.0, -3.0]  # the overlap, R / 10, is much larger than R bend^2 / 8, the depth of the corner
    advance(model, state, 0.0, round(4.0 * np.sqrt(state.mass[0] / KN) / state.next_dt))
    assert state.v[0, 1] / 3.0 == pytest.approx(np.exp(-np.pi * 0.2 / np.sqrt(0.96)), abs=2e-3)
    assert abs(state.v[0, 0]) < 6.0 * abs(bend) + 1e-9


def chains():
    """Walls that meet in every way: bends in and out, a T, crossings, three at a point, pieces that overlap."""
    bends = np.cumsum([0.0, 0.02, -0.6, 0.3, 0.09, 0.001, -1.2, 1.5, 0.2])
    steps = np.column_stack([np.cos(bends), np.sin(bends)]) * (2.0 + np.arange(9.0)[:, None] % 3) * 0.5 * R
    points = np.vstack([[0.0, 0.0], np.cumsum(steps, axis=0)])
    line = np.hstack([points[:-1], points[1:]])
    star = [[0.0, 0.0, np.cos(a), np.sin(a)] for a in (0.3, 0.6, 2.0, 4.0)]
    cross = [[-1.0, 0.0, 1.0, 0.0], [-1.0, -0.1, 1.0, 0.1], [0.0, 0.0, -0.2, 1.0]]
    laid = [[-1.0, 0.0, 0.2 * R, 0.0], [-0.3 * R, 0.0, 1.0, 0.0], [0.0, 0.0, 1.0, 1.0]]
    return {"line": line, "star": star, "crossing": cross, "laid over each other": laid}


@pytest.mark.parametrize("ends", chains().values(), ids=chains())
def test_the_force_is_the_gradient_of_the_energy(ends):
    """Eq (2) of wall_surface.py at 300 places, some deep: nothing jumps, so nothing gains energy."""
    ends = np.array(ends)
    model, state = with_walls([[0.0, 5.0]], ends, friction=None)
    rng, tried, several = np.random.default_rng(4), 0, 0
    low, high = np.minimum(ends[:, :2], ends[:, 2:]).min(axis=0), np.maximum(ends[:, :2], ends[:, 2:]).max(axis=0)
    low, high = np.maximum(low, -1.5 * R) - R, high + R if len(ends) > 5 else np.minimum(high, 1.5 * R) + R

    def at(place):
        state.x[0] = place
        contact_forces(model, state)
        return energy.stored(model, state)

    while tried < 300:
        place, h = rng.uniform(low, high), 1e-6 * R
        at(place)
        force, overlap = state.force[0].copy(), np.max(R - walls.near(state, 0.0)[3], initial=0.0)
        if not 0.0 < overlap < 0.5 * R:
            continue
        tried, several = tried + 1, several + (touched(state)[0] > 1)
        gradient = [(at(place + h * unit) - at(place - h * unit)) / (2.0 * h) for unit in np.eye(2)]
        np.testing.assert_allclose(-np.array(gradient), force, atol=2e-5 * KN * R)
    assert several > 10


def test_a_ring_of_many_walls_is_a_circle():
    """A disc of half the ring's radius, pressed against it by a tenth of its own: kn u towards the middle, wherever it is."""
    angle = np.linspace(0.0, 2.0 * np.pi, 65)
    corners = np.column_stack([np.cos(angle), np.sin(angle)])
    ends = np.hstack([corners[:-1], corners[1:]])[np.random.default_rng(2).permutation(64)]
    model, state = with_walls([[0.0, 0.0]], ends, radius=0.5, friction=None)
    for turn in np.linspace(0.0, 0.2, 41):
        out = np.array([np.cos(turn), np.sin(turn)])
        state.x[0] = 0.55 * out
        contact_forces(model, state)
        np.testing.assert_allclose(state.force[0], -0.05 * KN * out, atol=0.05 * 0.05 * KN)
    from_outside = 1.46 * out
    state.x[0] = from_outside
    contact_forces(model, state)
    np.testing.assert_allclose(state.force[0], 0.04 * KN * out, atol=0.05 * 0.04 * KN)


# -- masses and steps ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("pieces", [*IN_PIECES.values(), EDGE], ids=[*IN_PIECES, "edge"])
def test_a_joint_counts_once_in_masses_and_steps(pieces):
    model, state = with_walls([[0.0, 1.1 * R]], pieces)
    real = in_real_time(model, state, 0.5)
    one, alone = with_walls([[0.0, 1.1 * R]], ONE_PIECE)
    in_real_time(one, alone, 0.5)
    assert state.next_dt == pytest.approx(alone.next_dt, rel=1e-12)
    in_static_mode(real, state)
    in_static_mode(one, alone)
    assert state.mass[0] == pytest.approx(alone.mass[0], rel=1e-12)
    assert state.inertia[0] == pytest.approx(alone.inertia[0], rel=1e-12)


def test_a_flat_corner_counts_twice_before_it_is_touched():
    """Bent by 1 degree towards the disc: both walls may be touched before masses are set again."""
    model, state = with_walls([[0.0, 1.1 * R]], [[-1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, np.tan(np.pi / 180.0)]])
    in_static_mode(model, state)
    assert state.mass[0] > 1.99 * KN / safety(model.law.damping) ** 2
