"""The ledger of the discs closes: to round-off where the leap-frog identity holds, to first order in the amplitude elsewhere."""

import numpy as np
import pytest
from disc_cases import loose_discs
from verification.coupling import chain
from verification.coupling.block import R, block
from window_case import stone_grain

from dem_server.effects.bond import BROKEN_TENSION
from dem_server.effects.dashpot import Dashpot, restitution_of
from dem_server.effects.friction import Friction
from dem_server.effects.parallel_bond import ParallelBond
from dem_server.effects.rolling import Rolling
from dem_server.observe import energy
from dem_server.observe.energy_ledger import Ledger as DiscLedger
from dem_server.step import clock, neighbours
from dem_server.step.bonds_made import add_parallel_bonds
from dem_server.step.contact_pass import contact_forces
from dem_server.step.motion import move_free
from dem_server.stones import bodies
from fdm_server.observe.energy_ledger import Ledger as GridLedger
from fdm_server.step.gridpoint_pass import update_velocities
from fdm_server.step.zone_pass import advance
from tests.dem_server.ledger_rows import ledger_rows


def booked(joined, steps, gravity=0.0, change=None):
    """Rows of both ledgers (grid, discs) of a verification.coupling.joined.Joined: dictionaries of arrays, power and work too."""
    grid, discs = joined.grid, joined.discs
    ledgers = GridLedger(joined.grid_model, grid), DiscLedger(joined.disc_model, discs)
    rim, rows = type("Rim", (), {"nodes": joined.nodes}), ([], [])
    for n in range(steps):
        rim.force = joined.hang(gravity).copy()
        ledgers[0].copy_before_step(grid)
        ledgers[1].copy_before_step(discs, gravity)
        update_velocities(joined.grid_model, grid, gravity, joined.kick)
        ledgers[0].book_motion(joined.grid_model, grid, gravity, joined.kick, [rim])
        joined.kick = None
        move_free(joined.disc_model, discs, gravity)
        joined.rim.move(discs, grid.velocity[joined.nodes])
        ledgers[1].book_motion(joined.disc_model, discs, gravity)
        for rows_of, ledger, model, state in zip(
            rows, ledgers, (joined.grid_model, joined.disc_model), (grid, discs), strict=True
        ):
            rows_of.append(ledger.values(model, state) | {"power": ledger.power})
        ledgers[1].copy_contacts(joined.disc_model, discs)
        if change:
            change(n)
        contact_forces(joined.disc_model, discs)
        ledgers[1].book_contacts(joined.disc_model, discs)
        advance(joined.grid_model, grid)
        ledgers[0].book_strain(joined.grid_model, grid)
    return [{name: np.array([row[name] for row in own]) for name in own[0]} for own in rows]


def shaken(amplitude, **how):
    """A coupled block at 29 degrees, its discs bonded, in motion of about so many R."""
    joined = block(around=1, across=2, **how)
    joined.begin(0.5, from_rest=False)
    rng, speed = np.random.default_rng(5), amplitude * R / joined.grid.dt / 10.0
    joined.grid.velocity[:] = speed * rng.normal(size=joined.grid.velocity.shape)
    free = joined.discs.v[joined.disc_model.ring :]
    free[:] = speed * rng.normal(size=free.shape)
    return joined


@pytest.mark.trial
@pytest.mark.long
def test_a_coupled_chain_closes_to_round_off():
    """Linear and undamped: both sides explain their energies, and what leaves one arrives at the other."""
    joined, _, _ = chain.coupled()
    grid, discs = booked(joined, 1000)
    total = grid["kinetic"] + grid["strain"] + discs["kinetic"] + discs["stored"]
    assert np.ptp(total) < 1e-12 * total[0]
    for rows in (grid, discs):
        assert np.abs(rows["error"]).max() < 1e-12 * total[0]
    assert np.abs(discs["ring"]).max() > 0.05 * total[0]
    np.testing.assert_allclose(discs["ring"], -grid["external"], atol=1e-12 * total[0])
    for name in ("friction", "bonds", "damping", "masses", "gravity"):
        assert np.abs(discs[name]).max() < 1e-12 * total[0], name


@pytest.mark.parametrize("shift", [0.0, 2.0 * R])
def test_both_sides_see_the_same_power(shift):
    """To 1e-12 of the largest, with control discs on their segments and beside them, in large motion."""
    grid, discs = booked(shaken(1e-2, shift=shift), 300)
    scale = np.abs(grid["power"]).max()
    assert np.abs(grid["power"] - discs["power"]).max() < 1e-12 * scale


def test_the_paper_mapping_loses_or_makes_power_and_the_ledgers_show_it():
    grid, discs = booked(shaken(1e-6, shift=2.0 * R, mapping="paper"), 300)
    assert np.abs(grid["power"] - discs["power"]).max() > 0.01 * np.abs(grid["power"]).max()


def test_in_the_plane_the_error_falls_with_the_amplitude():
    """Directions of contacts turn by as much as the amplitude over R: relative error of first order, below 1e-6 at 1e-6 R."""
    errors = []
    for amplitude in (1e-4, 1e-6):
        _, discs = booked(shaken(amplitude), 500)
        errors.append(np.abs(discs["error"]).max() / discs["kinetic"].max())
    assert errors[1] < 1e-7
    assert errors[1] < 0.03 * errors[0]


def test_a_broken_bond_loses_what_it_held():
    """The chain is cut in motion: what is stored, X^2 / 2k, less the work X w / 2 of the step, X falling to 0, is lost there."""
    joined, _, _ = chain.coupled()
    discs, seen = joined.discs, {}

    def cut(n):
        if n < 100 or seen:
            return
        at = int(np.argmin(discs.normal))
        i, j = discs.first[at], discs.second[at]
        n_ij = discs.x[j] - discs.x[i]
        way = (discs.v[j] - discs.v[i]) @ n_ij / np.hypot(*n_ij) * discs.dt
        X, k = discs.normal[at], joined.disc_model.law.spring.normal[discs.kind[at]]
        discs.bond_state[at] = BROKEN_TENSION
        seen.update(step=n, tension=X, lost=0.5 * X * X / k - 0.5 * X * way)

    _, rows = booked(joined, 102, change=cut)
    assert seen["tension"] < 0.0
    step = seen["step"]
    assert np.all(rows["bonds"][: step + 1] == 0.0)
    assert rows["bonds"][step + 1] == pytest.approx(seen["lost"], rel=1e-9)
    assert np.abs(rows["error"]).max() < 1e-12 * rows["kinetic"][0]


def test_weights_and_their_work_are_booked():
    """Free fall of the coupled block: kinetic energy is the work of weights on both sides."""
    joined = block(around=1, across=2)
    joined.begin(0.5)
    grid, discs = booked(joined, 200, gravity=9.81)
    for rows in (grid, discs):
        gained = rows["kinetic"] - rows["kinetic"][0]
        assert gained[-1] > 1.0
        over = gained - rows["gravity"] - rows.get("external", 0.0)
        np.testing.assert_allclose(over, 0.0, atol=1e-9 * gained[-1])


def test_a_clump_that_is_hit_and_turns_loses_nothing_to_damping_that_is_not_there():
    """Four discs as one body, spinning, meet a free one, under their weight: levers are those of before the motion."""
    xy = np.array([[0.0, 0.0], [0.06, 0.0], [0.0, 0.06], [0.06, 0.06], [0.119, 0.02]])
    model, state = loose_discs(xy, np.full(5, 0.03), stone=stone_grain())
    square = np.array([[-0.01, -0.01], [0.07, -0.01], [0.07, 0.07], [-0.01, 0.07]])
    bodies.assign_discs(model, state, [square], 2700.0)
    model = bodies.form_stones(model, state, [square], "clump")
    neighbours.rebuild(model, state)
    model = clock.begin(model, state, None, 0.05)
    state.clumps.motion[0, 2:5] = 0.2, 0.0, 8.0
    state.v[4] = -0.2, 0.1
    contact_forces(model, state)
    spins = []
    found = ledger_rows(model, state, 4000, 9.81, lambda: spins.append(state.clumps.motion[0, 4]))
    assert (np.abs(found["damping"]) < 1e-12 * found["kinetic"]).all()
    assert np.ptp(spins) > 1e-3 * abs(spins[0]), np.ptp(spins)  # it was hit off its centre


def test_the_weight_of_a_clump_acts_at_its_centroid():
    """Its discs lie to one side of its polygon, which turns as it falls: T and the height of the centroid explain each other."""
    xy = np.array([[0.0, 0.0], [0.06, 0.0], [0.0, 0.06], [0.06, 0.06]])
    model, state = loose_discs(xy, np.full(4, 0.03), stone=stone_grain())
    outline = np.array([[-0.01, -0.01], [0.2, -0.01], [0.07, 0.07], [-0.01, 0.07]])
    bodies.assign_discs(model, state, [outline], 2700.0)
    model = bodies.form_stones(model, state, [outline], "clump")
    neighbours.rebuild(model, state)
    model = clock.begin(model, state, None, 0.05)
    assert abs(state.clumps.motion[0, 0] - 0.03) > 0.01
    state.clumps.motion[0, 2:5] = 0.2, 0.5, 8.0
    contact_forces(model, state)
    heights = []
    rows = ledger_rows(model, state, 4000, 9.81, lambda: heights.append(energy.potential(state, 9.81)))
    whole = rows["kinetic"].max()
    assert np.ptp(rows["kinetic"]) > 0.01 * whole
    assert np.abs(rows["error"]).max() < 1e-11 * whole
    np.testing.assert_allclose(rows["kinetic"][1:] + heights[:-1], rows["kinetic"][1] + heights[0], atol=1e-11 * whole)
    assert energy.potential(state, 9.81) == pytest.approx(9.81 * energy.weight_height(model, state))


CEMENT = ParallelBond(normal_stiffness=1e9, shear_stiffness=5e8, tension=1e9, shear=1e9, radius=0.8)


@pytest.mark.long
@pytest.mark.parametrize(
    ("laws", "most", "falls"),
    [({"rolling": Rolling(coefficient=0.2)}, 1e-3, 3.0), ({"parallel_bond": CEMENT}, 3e-7, 1.5)],
    ids=["rolling", "parallel bonds"],
)
def test_three_discs_that_slip_and_roll_or_are_cemented_explain_their_energy(laws, most, falls):
    """Contacts open, slip, roll and bend; what the trapezoidal rule does not see falls with the step."""
    errors = []
    for fraction in (0.05, 0.025):
        xy = np.array([[0.0, 0.0], [0.0595, 0.0], [0.0297, 0.0515]])
        model, state = loose_discs(xy, np.full(3, 0.03), "parallel_bond" in laws, **laws)
        if "parallel_bond" in laws:
            add_parallel_bonds(model, state)
        model = clock.begin(model, state, None, fraction)
        contact_forces(model, state)
        rng = np.random.default_rng(2)
        state.v[:], state.spin[:] = 1e-2 * rng.normal(size=(3, 2)), 0.3 * rng.normal(size=3)
        found = ledger_rows(model, state, round(60 / fraction))
        whole = found["kinetic"][0] + found["stored"][0]
        errors.append(np.abs(found["error"]).max() / whole)
        assert ("rolling" in laws) == (found["friction"][-1] > 1e-5 * whole)
        assert np.ptp(found["stored"]) > 0.01 * whole
    assert errors[0] < most
    assert errors[1] < errors[0] / falls


def collision(fraction, tension, spin=0.0, **laws):
    """Rows of the ledger of two discs, one of which hits the other at 23 deg, spinning; steps of `fraction`."""
    n = np.array([np.cos(0.4), np.sin(0.4)])
    dashpot = Dashpot(normal=0.3, shear=0.2, tension=tension)
    model, state = loose_discs(np.array([[0.0, 0.0], 0.0601 * n]), np.full(2, 0.03), dashpot=dashpot, **laws)
    model = clock.begin(model, state, None, fraction)
    state.v[1], state.spin[1] = -0.2 * n, spin
    contact_forces(model, state)
    return ledger_rows(model, state, round(60 / fraction))


@pytest.mark.parametrize("tension", [False, True])
def test_dashpots_take_what_a_head_on_collision_loses(tension):
    """1 - e^2 of the energy of the approach, which is half of the kinetic energy of one disc that hits an equal one."""
    rows = collision(0.01, tension)
    approach, e = 0.5 * rows["kinetic"][0], restitution_of(0.3, tension)
    assert rows["dashpots"][-1] == pytest.approx((1.0 - e * e) * approach, rel=5e-3)
    assert np.abs(rows["error"]).max() < 2e-3 * approach


@pytest.mark.parametrize("laws", [{}, {"friction": Friction(coefficient=0.3)}], ids=["smooth", "rough"])
def test_the_error_of_an_oblique_collision_with_dashpots_falls_with_the_step(laws):
    errors = []
    for fraction in (0.04, 0.01):
        rows = collision(fraction, False, 2.0, **laws)
        errors.append(np.abs(rows["error"]).max() / rows["kinetic"][0])
        assert rows["dashpots"][-1] > 0.1 * rows["kinetic"][0]
    assert errors[1] < 2e-3
    assert errors[1] < 0.5 * errors[0]
