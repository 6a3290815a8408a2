"""Measures of regions against closed forms on lattices: stress, porosity, contacts, sliding, strain rate; and their errors."""

import numpy as np
import pytest
import shapely

from coupler_protocol.measures.regions import Region
from coupler_protocol.problems import SceneError
from coupler_protocol.scene.tables.measure import Measure
from dem_server.model import Clumps
from dem_server.observe.measuring import Measuring, measured
from tests.physics.disc_cases import KN, KS, MU, displace, loose_discs

R, SIDE = 0.1, 16
TURN = np.array([[np.cos(0.3), -np.sin(0.3)], [np.sin(0.3), np.cos(0.3)]])  # lattices are oblique
HEXAGONAL = np.array([[1.0, 0.0], [0.5, 0.75**0.5]])
SQUARE = np.eye(2)


def lattice(cell, spacing, stretch=None, **changes):
    """Model, State and cell vectors (2, 2) of SIDE x SIDE discs on a lattice; stretch (2, 2): their deformation."""
    vectors = spacing * cell @ TURN.T @ (np.eye(2) if stretch is None else stretch).T
    number = np.stack(np.meshgrid(np.arange(SIDE), np.arange(SIDE), indexing="ij"), axis=-1).reshape(-1, 2)
    return *loose_discs(number @ vectors, np.full(SIDE**2, R), **changes), vectors


def cells(vectors, first=4.3, number=6):
    """A parallelogram of number x number cells that begins anywhere: means over it are those of the lattice."""
    corners = np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) * number + np.array([first, first + 0.4])
    return Region(corners @ vectors)


@pytest.mark.parametrize("strain", [np.diag([1e-3, 1e-3]), np.array([[8e-4, 2e-4], [2e-4, 3e-4]])])
def test_stress_of_a_strained_hexagonal_lattice(strain):
    """sigma = -(1/A cell) sum over three contacts of F l, with F along l: kn times what the strain shortens."""
    model, state, vectors = lattice(HEXAGONAL, 2.0 * R, np.eye(2) - strain)
    lines = np.array([vectors[0], vectors[1], vectors[1] - vectors[0]])
    length = np.hypot(*lines.T)
    expected = -sum(KN * (2.0 * R - d) / d * np.outer(line, line) for line, d in zip(lines, length, strict=True))
    expected /= abs(np.linalg.det(vectors))
    found = measured(model, state, cells(vectors))
    stress = [found[f"stress_{part}"] for part in ("xx", "yy", "xy")]
    np.testing.assert_allclose(stress, [expected[0, 0], expected[1, 1], expected[0, 1]], rtol=1e-9, atol=1e-6)
    assert found["coordination"] == found["mechanical_coordination"] == 6.0
    assert found["coordination_error"] == 0.0
    circle = measured(model, state, Region((*(7.7 * vectors.sum(axis=0)), 8.0 * R)))
    assert circle["stress_xx"] == pytest.approx(expected[0, 0], rel=0.05)  # the circle cuts the lattice anywhere


@pytest.mark.parametrize(("cell", "expected"), [(HEXAGONAL, 1.0 - np.pi / 12.0**0.5), (SQUARE, 1.0 - np.pi / 4.0)])
def test_porosity_of_lattices(cell, expected):
    model, state, vectors = lattice(cell, 2.0 * R)
    assert measured(model, state, cells(vectors))["porosity"] == pytest.approx(expected, abs=1e-12)
    centre, radius = 7.8 * vectors.sum(axis=0), 0.83
    solid = shapely.union_all(shapely.buffer(shapely.points(state.x), R, quad_segs=400))
    circle = shapely.Point(centre).buffer(radius, quad_segs=400)
    found = measured(model, state, Region((*centre, radius)))
    assert found["porosity"] == pytest.approx(1.0 - solid.intersection(circle).area / circle.area, abs=1e-5)
    assert abs(found["porosity"] - expected) < 3.0 * found["porosity_error"]


def test_overlaps_count_once():
    model, state, vectors = lattice(SQUARE, 1.9 * R)
    half = np.arccos(0.95)
    lens = 2.0 * R**2 * (half - np.sin(half) * np.cos(half))
    expected = 1.0 - (np.pi * R**2 - 2.0 * lens) / (1.9 * R) ** 2
    assert measured(model, state, cells(vectors))["porosity"] == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("region", ["circle", "polygon"])
def test_a_velocity_gradient_is_recovered_and_a_rigid_rotation_is_no_strain(region):
    model, state, vectors = lattice(HEXAGONAL, 2.0 * R)
    place = Region((*(7.7 * vectors.sum(axis=0)), 0.9)) if region == "circle" else cells(vectors)
    gradient = np.array([[3e-4, -2e-4], [7e-4, -1e-4]])
    state.v[:] = state.x @ gradient.T + (0.3, -0.2)
    found = measured(model, state, place)
    rate = [found[f"strain_rate_{part}"] for part in ("xx", "yy", "xy")]
    np.testing.assert_allclose(rate, [3e-4, -1e-4, 2.5e-4], rtol=1e-10)
    assert max(found[f"strain_rate_{part}_error"] for part in ("xx", "yy", "xy")) < 1e-12
    state.v[:] = state.x @ np.array([[0.0, -0.02], [0.02, 0.0]]) + (1.0, 2.0)
    found = measured(model, state, place)
    assert max(abs(found[f"strain_rate_{part}"]) for part in ("xx", "yy", "xy")) < 1e-14


def test_the_error_of_a_strain_rate_is_that_of_least_squares():
    """Independent noise s of every velocity: the scatter of L_xx is s / sqrt(sum x^2)."""
    model, state, vectors = lattice(HEXAGONAL, 2.0 * R)
    place = Region((*(7.7 * vectors.sum(axis=0)), 1.3))
    inside = state.x[place.contains(state.x)]
    expected = 1e-3 / np.sqrt(((inside - inside.mean(axis=0)) ** 2).sum(axis=0))
    rng, found = np.random.default_rng(1), []
    for _ in range(40):
        state.v[:] = rng.normal(0.0, 1e-3, state.v.shape)
        values = measured(model, state, place)
        found.append([values[name] for name in ("strain_rate_xx", "strain_rate_yy", "strain_rate_xx_error")])
    scatter = np.std(np.array(found)[:, :2], axis=0)
    np.testing.assert_allclose(scatter, expected, rtol=0.3)
    assert np.sqrt(np.mean(np.array(found)[:, 2] ** 2)) == pytest.approx(expected[0], rel=0.35)


def test_sliding_contacts_and_bodies_without_support():
    """One row of a square lattice slides over the next: of two contacts a disc, one in as many as there are rows."""
    model, state, vectors = lattice(SQUARE, 1.999 * R, bond=None)
    place = cells(vectors)
    assert measured(model, state, place)["sliding"] == 0.0
    row = np.arange(SIDE**2) % SIDE >= 7
    along = vectors[0] / np.hypot(*vectors[0])
    displace(model, state, np.where(row[:, None], 1.02 * MU * KN / KS * 0.001 * R * along, 0.0))  # limit: mu kn overlap
    found = measured(model, state, place)
    assert found["sliding"] == pytest.approx(1.0 / 12.0, rel=1e-12)
    assert found["sliding_error"] > 0.0
    assert (found["coordination"], found["bodies"]) == (4.0, 36.0)
    lost = np.argmin(np.hypot(*(state.x - state.x[place.contains(state.x)].mean(axis=0)).T))
    state.radius[lost] *= 0.9  # four neighbours lose a contact each, it keeps none
    found = measured(model, state, place)
    assert found["coordination"] == pytest.approx((36 * 4 - 8) / 36.0)
    assert found["mechanical_coordination"] == pytest.approx((36 * 4 - 8) / 35.0)


def test_a_clump_counts_as_one_body_and_its_stress_acts_between_centroids():
    """Four discs of a square lattice as one clump: its contacts, and half of the moments from its centroid."""
    model, state, vectors = lattice(SQUARE, 1.999 * R, bond=None)
    loose = measured(model, state, cells(vectors))
    members = np.array([i * SIDE + j for i in (7, 8) for j in (7, 8)])
    body = np.full(SIDE**2, -1, dtype=np.int32)
    body[members] = 0
    centre = state.x[members].mean(axis=0)
    motion = np.zeros((1, 8))
    motion[0, :2] = centre
    state.clumps = Clumps(
        motion, body, np.array([0, 4]), members, state.x[members] - centre, np.array([2.0 * R]), np.array([R**2])
    )
    own = np.isin(state.first, members) & np.isin(state.second, members)
    state.normal[own] = 0.0
    state.radius[members] *= 1.0 - 1e-9  # within a clump nothing is listed: its inner pairs do not touch
    state.reference_gap[own] = -1.0
    found = measured(model, state, cells(vectors))
    assert found["bodies"] == loose["bodies"] - 3.0
    assert found["coordination"] == pytest.approx((32 * 4 + 8) / 33.0)
    for part in ("xx", "yy", "xy"):  # the longer branches carry what the inner contacts carried
        assert found[f"stress_{part}"] == pytest.approx(loose[f"stress_{part}"], rel=1e-6, abs=1e-3)


def test_a_region_without_discs_has_a_porosity_and_nothing_else():
    model, state, _ = lattice(SQUARE, 2.0 * R)
    found = measured(model, state, Region((50.0, 50.0, 1.0)))
    assert (found.pop("porosity"), found.pop("bodies")) == (1.0, 0.0)
    assert np.isnan(list(found.values())).all()


def test_discs_that_do_not_touch_have_no_stress():
    model, state, vectors = lattice(SQUARE, 2.1 * R)
    found = measured(model, state, cells(vectors))
    assert [found[f"stress_{part}"] for part in ("xx", "yy", "xy")] == [0.0, 0.0, 0.0]
    assert (found["coordination"], found["bodies"]) == (0.0, 36.0)
    assert np.isnan([found["mechanical_coordination"], found["sliding"]]).all()


def test_regions_out_of_the_window_or_without_discs_are_refused():
    rim = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]])
    inside = [Measure(name="c", centre=(1.0, 1.0), radius=1.0), Measure(name="p", polygon=[(0, 0), (2, 0), (1, 2)])]
    Measuring(inside, (0.0, 0.0)).refuse_outside(rim)
    for wrong in (Measure(name="c", centre=(1.1, 1.0), radius=1.0), Measure(name="c", polygon=[(0, 0), (2.1, 0), (1, 2)])):
        with pytest.raises(SceneError, match="region 'c' reaches out of its window"):
            Measuring([wrong], (0.0, 0.0)).refuse_outside(rim)
    with pytest.raises(SceneError, match="contains 2 discs"):
        Measuring(inside, (0.0, 0.0)).refuse_empty(np.array([[1.0, 1.0], [1.2, 1.0], [5.0, 5.0]]))
