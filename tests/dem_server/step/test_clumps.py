"""Clumps: rigid, driven by the forces on all their discs, stable; what is averaged over bodies counts them as one."""

from copy import deepcopy
from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse
import scipy.sparse.linalg
from copied_state import gone_on_twice
from numba import types
from window_case import OBLIQUE, SQUARE, packed_with_stones

from coupler_protocol.geometry import polygon_area
from dem_server.insitu import virtual_strain
from dem_server.insitu.contact_stress import mean_stress
from dem_server.observe import energy
from dem_server.observe.unbalanced_ratio import unbalanced_ratio
from dem_server.pairs import body_centres, contacts, listed_pairs
from dem_server.step import cells, neighbours
from dem_server.step.contact_pass import contact_forces
from dem_server.step.masses import safety
from dem_server.step.motion import SPEED_CAP, move_free
from dem_server.stones import bodies


def with_clumps(corners=OBLIQUE, seed=0):
    model, state, found = packed_with_stones(corners, seed)
    model = bodies.form_stones(model, state, found.outlines, "clump")
    return model, state


@pytest.fixture(scope="module")
def made():
    return with_clumps()


def turned(angle):
    """Rotation matrices (2, 2, c)."""
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


def test_discs_stay_where_they_are_in_their_clump(made):
    model, state = deepcopy(made)
    clumps = state.clumps
    state.load[:, :3] = np.random.default_rng(0).normal(0.0, 1.0, (model.count, 3)) * [3e3, 3e3, 30.0]
    for _ in range(1000):
        before = state.x.copy()
        move_free(model, state, 9.81)
        np.testing.assert_allclose(state.v[clumps.member], (state.x - before)[clumps.member], rtol=0, atol=4e-15)
    body = clumps.body[clumps.member]
    assert np.abs(clumps.motion[:, 5]).max() > 0.3
    R = turned(clumps.motion[body, 5])
    expected = clumps.motion[body, :2] + np.einsum("ijm,mj->mi", R, clumps.offset)
    np.testing.assert_allclose(state.x[clumps.member], expected, rtol=0, atol=1e-15)
    assert (state.spin[clumps.member] == clumps.motion[body, 4]).all()


def test_free_fall_and_spin(made):
    """Forces on the discs move the centroid by their sum and turn the clump by their moment about it."""
    model, state = deepcopy(made)
    model = replace(model, law=model.law._replace(damping=None))
    clumps = state.clumps
    state.disc[:, 2:5] = clumps.motion[:, 2:6] = 0.0
    state.load[:] = 0.0
    state.load[clumps.member[0], :3] = [300.0, -200.0, 7.0]
    start = clumps.motion.copy()
    lever = clumps.offset[0]
    move_free(model, state, 2.0)
    weight = np.bincount(clumps.body[clumps.member], weights=state.weight[clumps.member], minlength=len(start))
    expected = np.column_stack([0.0 * weight, -2.0 * weight])
    c = clumps.body[clumps.member[0]]
    expected[c] += [300.0, -200.0]
    np.testing.assert_allclose(clumps.motion[:, 2:4] * start[:, 6:7], expected, rtol=1e-12)
    np.testing.assert_allclose(clumps.motion[:, :2] - start[:, :2], clumps.motion[:, 2:4], atol=1e-15)
    moment = 7.0 - 200.0 * lever[0] - 300.0 * lever[1]
    assert clumps.motion[c, 4] * start[c, 7] == pytest.approx(moment, rel=1e-11)
    assert not np.delete(clumps.motion[:, 4], c).any()


def test_contacts_inside_a_clump_do_not_exist(made):
    _, state = made
    pairs = listed_pairs(state)
    a, b = state.clumps.body[pairs.disc_a], state.clumps.body[pairs.disc_b]
    assert not ((a == b) & (a >= 0)).any()
    assert ((a != b) & (a >= 0) & (b >= 0)).any()


def test_lists_of_pairs_take_no_tuple_of_arrays(made):
    """A tuple that is handed on for every pair is copied for every pair: building the list took fifty times longer."""
    model, state = made[:2]
    neighbours.rebuild(model, state)
    for kernel in (cells.near_pairs, neighbours.places):
        taken = [kind for signature in kernel.signatures for kind in signature]
        assert taken
        assert not any(isinstance(kind, types.BaseTuple) for kind in taken)


def test_the_fastest_disc_of_a_clump_keeps_to_the_speed_cap(made):
    model, state = deepcopy(made)
    i = state.clumps.member[0]
    state.load[i, :3] = [1e9, 0.0, 1e9]
    capped = state.capped
    move_free(model, state, 0.0)
    own = state.clumps.member[state.clumps.body[state.clumps.member] == state.clumps.body[i]]
    assert np.hypot(*state.v[own].T).max() <= SPEED_CAP * model.smallest_radius * (1 + 1e-12)
    assert state.capped == capped + 1


def largest_omega2(model, state):
    """Largest eigenvalue of M^-1 K of the free bodies, every listed pair taken as a bond."""
    pairs, centre = listed_pairs(state), body_centres(state)
    body = np.where(state.clumps.body >= 0, model.count + state.clumps.body, np.arange(model.count))
    a, b, (nx, ny) = pairs.disc_a, pairs.disc_b, pairs.normal.T
    gap = np.hypot(*pairs.branch.T) - state.radius[a] - state.radius[b]
    point = state.x[a] + (state.radius[a] + 0.5 * gap)[:, None] * pairs.normal
    (ax, ay), (bx, by) = (point - centre[a]).T, (point - centre[b]).T
    size = model.count + len(state.clumps.motion)

    def stretch(dx, dy):
        """Relative displacement along (dx, dy): rows of coefficients of both bodies."""
        at = np.concatenate([3 * body[a] + k for k in range(3)] + [3 * body[b] + k for k in range(3)])
        values = [-dx, -dy, -(ax * dy - ay * dx), dx, dy, bx * dy - by * dx]
        rows = np.tile(np.arange(len(a)), 6)
        return scipy.sparse.csr_array((np.concatenate(values), (rows, at)), shape=(len(a), 3 * size))

    kn, ks = (scipy.sparse.diags_array(k[pairs.kind]) for k in model.law.spring)
    normal, shear = stretch(nx, ny), stretch(-ny, nx)
    stiffness = normal.T @ kn @ normal + shear.T @ ks @ shear
    mass = np.column_stack([state.mass, state.mass, state.inertia])
    mass[: model.ring] = np.inf
    mass = np.vstack([mass, state.clumps.motion[:, [6, 6, 7]]])
    scale = scipy.sparse.diags_array(mass.ravel() ** -0.5)
    return scipy.sparse.linalg.eigsh(scale @ stiffness @ scale, k=1, return_eigenvectors=False)[0]


@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize("corners", [SQUARE, OBLIQUE], ids=["square", "oblique"])
def test_static_masses_keep_the_step_stable(corners, seed):
    model, state = with_clumps(corners, seed)
    omega2, sf2 = largest_omega2(model, state), safety(model.law.damping) ** 2
    assert 1.5 * sf2 < omega2 <= 4.0 * sf2 < 4.0 / 1.7


def test_ratio_counts_bodies(made):
    model, state = deepcopy(made)
    for _ in range(5):
        move_free(model, state, 9.81)
        contact_forces(model, state)
    pairs = contacts(state)
    clumps = state.clumps
    body = np.where(clumps.body >= 0, model.count + clumps.body, np.arange(model.count))
    size, n = np.hypot(*pairs.force.T), model.count + len(clumps.motion)
    every = np.bincount(np.concatenate([body, body[pairs.disc_a], body[pairs.disc_b]]),
                        np.concatenate([9.81 * state.weight, size, size]), n)  # fmt: skip
    x, y = (np.bincount(body, f, n) for f in (state.force[:, 0], state.force[:, 1] - 9.81 * state.weight))
    free = np.unique(body[model.ring :])
    expected = np.hypot(x, y)[free].max() / every[free].mean()
    assert unbalanced_ratio(model, state, 9.81) == pytest.approx(expected, rel=1e-12)


def test_kinetic_energy_counts_bodies(made):
    model, state = deepcopy(made)
    state.disc[:, 2:5] = 0.0
    state.clumps.motion[:, 2:5] = [3e-6, 4e-6, 1e-5]
    mass, inertia = state.clumps.motion[:, 6:].T
    assert energy.kinetic(model, state) == pytest.approx(0.5 * (mass.sum() * 25e-12 + inertia.sum() * 1e-10), rel=1e-12)


def test_mean_stress_is_the_boundary_stress():
    """Branches run between centroids of clumps; between their discs the stress comes out much too low."""
    model, state = with_clumps()
    for _ in range(30):
        virtual_strain.relax(model, state, 0.0, 300)
        if unbalanced_ratio(model, state, 0.0) < 1e-8:
            break
    area = polygon_area(state.x[: model.ring])
    boundary = -(state.x[: model.ring].T @ state.force[: model.ring]) / area
    expected = [boundary[0, 0], boundary[1, 1], 0.5 * (boundary[0, 1] + boundary[1, 0])]
    pairs = contacts(state)
    np.testing.assert_allclose(mean_stress(pairs, area), expected, atol=1e-5 * abs(boundary[0, 0]))
    assert mean_stress(pairs._replace(span=pairs.branch), area)[0] > 0.8 * expected[0]


def test_a_copied_state_goes_on_with_the_same_bits(made):
    model, state = deepcopy(made)
    state, copy = gone_on_twice(model, state)
    assert state.disc.tobytes() == copy.disc.tobytes()
    assert state.clumps.motion.tobytes() == copy.clumps.motion.tobytes()


def test_recorded_bodies_give_the_same_stress(tmp_path, made):
    """The bins' mean of a recorded frame, area by area, is the mean stress of the window."""
    from colluvium import open_run
    from colluvium.results import window_fields
    from coupler_protocol.files.recorder import FrameInfo, Recorder
    from dem_server.observe import record

    model, state = made
    with Recorder(tmp_path / "dem.rank1.vtkhdf", "discrete") as recorder:
        recorder.frame(FrameInfo(0, 0.0, "couple", 1.0), **record.frame(model, state))
    with open_run(tmp_path) as run:
        bins = window_fields.bins(run, 0)._replace(area=np.ones(1), shape=(1, 1))
        bins = bins._replace(size=np.array([1e-3, 1e-3]))
        found = window_fields.mean_stress(run, 0, bins)[0]
    np.testing.assert_allclose(found, mean_stress(contacts(state), 1.0), rtol=1e-9)
