"""Every effect of the contact law answers the same questions; an effect without a case fails.

Run as a file it writes what all cases come to, for the comparison of compiled and interpreted kernels.
"""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from verification.discrete.discs import loose_discs

from coupler_protocol.files import checkpoint
from dem_server.effects import Law, histories
from dem_server.effects.bond import Bond
from dem_server.effects.dashpot import Dashpot
from dem_server.effects.friction import Friction
from dem_server.effects.parallel_bond import ParallelBond
from dem_server.effects.rolling import Rolling
from dem_server.model import MOMENT, SPIN, VX, State
from dem_server.observe import record
from dem_server.step import bonds_made, neighbours
from dem_server.step.contact_pass import contact_forces
from dem_server.step.cycle import advance, in_real_time, in_static_mode
from dem_server.step.motion import move_free
from dem_server.step.walls import make_walls
from tests.dem_server.ledger_rows import ledger_rows

EFFECTS = [name for name in Law._fields if name != "damping"]  # damping acts on bodies, not at contacts
CEMENT = ParallelBond(normal_stiffness=1e9, shear_stiffness=5e8, tension=1e9, shear=1e9, radius=0.8)
CASES = {  # what a grain needs for the effect to act, beside springs
    "spring": {},
    "friction": {"friction": Friction(coefficient=0.5)},
    "bond": {"bond": Bond(tension=1e9, shear=1e9)},
    "rolling": {"friction": Friction(coefficient=0.5), "rolling": Rolling(coefficient=0.3)},
    "dashpot": {"friction": Friction(coefficient=0.5), "dashpot": Dashpot(normal=0.2, shear=0.1)},
    "parallel_bond": {"parallel_bond": CEMENT},
}
WEAK = {  # bonds that the four discs break
    "bond": {"bond": Bond(tension=2e3, shear=1e9)},
    "parallel_bond": {"parallel_bond": CEMENT.model_copy(update={"tension": 5e4})},
}
TAKES = {"friction", "rolling", "dashpot"}  # effects that take energy; the others keep it
R = 0.03
ALONE = {"friction": None, "bond": None, "damping": None}
EVERY = pytest.mark.parametrize("effect", EFFECTS)


def discs_with(effect, spacing=1.99 * R, fraction=0.05, cases=CASES):
    """Model and State of an oblique square of four discs with the effect, bonded where it bonds.

    In real time, of a fraction of the stable step; fraction None: in static mode.
    """
    turn = np.array([[np.cos(0.4), np.sin(0.4)], [-np.sin(0.4), np.cos(0.4)]])
    xy = spacing * np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]]) @ turn
    model, state = loose_discs(xy, np.full(4, R), effect == "bond", **ALONE | cases[effect])
    if effect == "parallel_bond":
        bonds_made.add_parallel_bonds(model, state, lambda pairs: np.ones(len(pairs.slot), dtype=bool))
    return (in_static_mode(model, state) if fraction is None else in_real_time(model, state, fraction)), state


def set_going(state):
    """Give discs velocities and spins in which all effects act."""
    rng = np.random.default_rng(5)
    state.v[:], state.spin[:] = rng.normal(0.0, 0.05, (4, 2)), rng.normal(0.0, 2.0, 4)


def arrays_of(state):
    """All that pairs remember: {name of the history: array}."""
    found = {}
    for name in histories.PairHistory._fields:
        value = getattr(state, name)
        if isinstance(value, tuple):
            found |= {f"{name}.{part}": array for part, array in value._asdict().items()}
        elif value is not None:
            found[name] = value
    return found


def state_after(effect, with_wall=False):
    """Model and State after 50 steps; with_wall: against a wall under the square."""
    model, state = discs_with(effect)
    if with_wall:
        state.walls = make_walls([[-1.0, -0.0295, 1.0, -0.0290]], [[0.05, 0.1]], model)
    set_going(state)
    advance(model, state, 0.0, 50)
    return model, state


def test_every_effect_has_a_case_and_every_declaration_an_effect():
    assert list(CASES) == EFFECTS
    assert list(histories.DECLARED) == EFFECTS


@EVERY
def test_no_force_without_motion_and_overlap(effect):
    model, state = discs_with(effect, spacing=2.0 * R * (1.0 + 1e-9))
    advance(model, state, 0.0, 5)
    assert np.abs(state.load).max() < 1e-2  # [N]; bonds see the gaps of 6e-11 m
    assert np.abs(state.disc[:, VX : SPIN + 1]).max() < 1e-6


@EVERY
def test_a_translation_changes_no_force(effect):
    model, state = state_after(effect)
    state.v[:], state.spin[:] = 0.0, 0.0
    contact_forces(model, state)
    before = state.load.copy()
    state.v[:] = [0.02, -0.01]
    state.x[:] += [0.02 * state.dt, -0.01 * state.dt]
    contact_forces(model, state)
    np.testing.assert_allclose(state.load, before, rtol=1e-6, atol=1e-6 * np.abs(before).max())


@EVERY
def test_it_acts(effect):
    """Forces or moments differ from those of a law without it."""
    found = [state_after(name)[1].disc[:, :5] for name in (effect, "spring")]
    assert np.array_equal(*found) == (effect == "spring")


@EVERY
def test_momentum_stays(effect):
    model, state = discs_with(effect, fraction=0.005)
    set_going(state)

    def momenta():
        linear = state.mass @ state.v
        turning = state.x[:, 0] * state.v[:, 1] - state.x[:, 1] * state.v[:, 0]
        return [*linear, state.mass @ turning + state.inertia @ state.spin]

    before = momenta()
    advance(model, state, 0.0, 2000)
    np.testing.assert_allclose(momenta(), before, rtol=1e-9, atol=1e-9 * np.abs(before).max())


def loads_beside_springs(model, state):
    """Forces and moments (n, 3) on discs without those of their springs: what dashpots do."""
    i, j = state.first.astype(int), state.second.astype(int)
    way = state.x[j] - state.x[i]
    d = np.hypot(*way.T)
    n = way / d[:, None]
    half_gap = 0.5 * (d - state.radius[i] - state.radius[j])
    shear = np.zeros(len(i)) if state.shear is None else state.shear
    force = state.normal[:, None] * n + shear[:, None] * np.column_stack([-n[:, 1], n[:, 0]])
    rest = state.load[:, : MOMENT + 1].copy()
    for disc, sign in ((i, 1.0), (j, -1.0)):
        np.add.at(rest, disc, np.column_stack([sign * force, shear * (state.radius[disc] + half_gap)]))
    return rest


def booked(effect, fraction, cases=CASES):
    """Ledger of the discs let go until they have swung or parted: energies over that at the beginning, {name: (steps,)}.

    `total`: kinetic and stored; `taken`: the work of dashpots by the trapezoidal rule, from the loads on discs.
    """
    model, state = discs_with(effect, fraction=fraction, cases=cases)
    set_going(state)
    if effect == "dashpot":
        contact_forces(model, state)  # of dashpots in this motion
    loads, work = [loads_beside_springs(model, state)], [0.0]

    def after():
        loads.append(loads_beside_springs(model, state))
        mean = 0.5 * (loads[-2] + loads[-1])
        work.append(work[-1] + state.dt * np.sum(mean * state.disc[:, VX : SPIN + 1]))

    rows = ledger_rows(model, state, round(8.0 / fraction), after=after)
    rows["total"], rows["taken"] = rows["kinetic"] + rows["stored"], -np.array(work[:-1])
    return {name: row / rows["total"][0] for name, row in rows.items()}


def left_open(fraction):
    """Largest share of the energy E that steps of this fraction of the stable one, 2/w, leave unexplained.

    The trapezoidal rule is exact for a spring. If the contact opens or closes within the step, it is wrong by k (v dt)^2 / 8 at
    most, which is (w dt)^2 / 4 of m v^2 / 2 <= E, with w^2 = k/m. What else it does not see, contacts that turn and levers that
    change within the step, is smaller by their overlap over R.
    """
    return 0.25 * (2.0 * fraction) ** 2


@EVERY
def test_the_energy_ledger_closes_and_no_energy_is_gained(effect):
    """To the error of one step, 0.0025 % at the finer one; losses are there where the effect takes, and never negative."""
    errors = []
    for fraction in (0.04, 0.005):
        found, most = booked(effect, fraction), left_open(fraction)
        errors.append(np.abs(found["error"]).max())
        assert errors[-1] < most
        assert (found["total"] - np.minimum.accumulate(found["total"])).max() < most
        assert np.ptp(found["stored"]) > 0.1
        for name in ("friction", "bonds"):
            assert np.diff(found[name]).min() > -1e-12
        assert (found["friction"][-1] > 1e-3) == (effect in TAKES)
        assert np.abs(found["bonds"]).max() < 1e-12
        if effect == "dashpot":
            assert np.diff(found["dashpots"]).min() > -1e-12
            assert found["dashpots"][-1] > 0.1
            np.testing.assert_allclose(found["dashpots"], found["taken"], atol=most)
        elif effect not in TAKES:
            assert np.abs(found["total"] - 1.0).max() < most
            assert np.abs(found["friction"]).max() < 1e-12
    assert errors[1] < errors[0] / 6.0  # of first order in the step, eight times shorter, where contacts hold; else of second


@pytest.mark.parametrize("effect", WEAK)
def test_bonds_that_break_lose_what_the_ledger_books(effect):
    for fraction in (0.04, 0.005):
        found, most = booked(effect, fraction, WEAK), left_open(fraction)
        assert found["bonds"][-1] > 1e-3
        assert np.diff(found["bonds"]).min() > -most
        assert np.abs(found["error"]).max() < most


@EVERY
def test_a_wall_and_the_discs_push_each_other_alike(effect):
    _, state = state_after(effect, with_wall=True)
    assert np.abs(state.walls.force).max() > 0.0
    np.testing.assert_allclose(state.force.sum(axis=0), -state.walls.force[0], rtol=1e-9, atol=1e-6)


@EVERY
def test_what_pairs_remember_is_there_with_the_effect_alone(effect):
    model, state = discs_with(effect)
    wanted = {history.name for history in histories.histories_of(model.law)}
    assert set(arrays_of(state)) == wanted
    assert {history.name for history in histories.DECLARED[effect]} - {"shear"} <= wanted
    others = (name for name in EFFECTS if getattr(model.law, name) is None)
    for name in others:
        assert not {history.name for history in histories.DECLARED[name]} & set(arrays_of(state))


@EVERY
@pytest.mark.parametrize("fraction", [0.05, None], ids=["real time", "static"])
def test_a_new_list_carries_all_that_pairs_remember(effect, fraction):
    """But for the masses of pairs, which are those of the discs after the rebuild: in static mode the new pairs change them."""
    model, state = discs_with(effect, spacing=2.2 * R, fraction=fraction)  # sides are listed, diagonals are not
    masses = state.mass.copy()
    rng, known = np.random.default_rng(2), {}
    for name, array in arrays_of(state).items():
        array[:] = rng.integers(1, 4, len(array)) if array.dtype == np.int8 else rng.normal(size=len(array))
        known[name] = dict(zip(zip(state.first.tolist(), state.second.tolist(), strict=True), array.tolist(), strict=True))
    pairs = len(state.first)
    state.x[:] *= 0.7  # now diagonals are listed too
    neighbours.rebuild(model, state)
    assert len(state.first) > pairs
    assert (state.mass != masses).all() == (fraction is None)
    at = list(zip(state.first.tolist(), state.second.tolist(), strict=True))
    for name, array in arrays_of(state).items():
        if name == "root_mass":
            wanted = [(1.0 / state.mass[i] + 1.0 / state.mass[j]) ** -0.5 for i, j in at]
            np.testing.assert_allclose(array, wanted, rtol=1e-15)
        else:
            assert array.tolist() == [known[name].get(pair, 0.0) for pair in at], name


@EVERY
def test_a_checkpoint_goes_on_to_the_bit(effect, tmp_path):
    model, state = state_after(effect, with_wall=True)
    checkpoint.save(tmp_path / "state.h5", state)
    again = checkpoint.rebuild(State, checkpoint.load(tmp_path / "state.h5")[0])
    assert type(again.parallel) is type(state.parallel)
    for one in (state, again):
        advance(model, one, 0.0, 20)
    assert {k: v.tobytes() for k, v in arrays_of(again).items()} == {k: v.tobytes() for k, v in arrays_of(state).items()}
    assert again.disc.tobytes() == state.disc.tobytes()
    assert again.walls.force.tobytes() == state.walls.force.tobytes()


@EVERY
def test_frames_hold_what_is_declared_so(effect):
    model, state = state_after(effect)
    fields = record.frame(model, state)["cell_fields"]
    wanted = {history.recorded for history in histories.histories_of(model.law)} - {""}
    every = {history.recorded for declared in histories.DECLARED.values() for history in declared} - {""}
    assert set(fields) & every == wanted


@EVERY
def test_one_call_of_many_steps_is_many_calls_of_one(effect):
    model, state = discs_with(effect)
    set_going(state)
    for _ in range(50):
        move_free(model, state, 0.0)
        contact_forces(model, state)
    assert state.disc.tobytes() == state_after(effect)[1].disc.tobytes()


def write_all(path):
    """What the discs and pairs of every case come to, with a wall."""
    found = {}
    for effect in EFFECTS:
        _, state = state_after(effect, with_wall=True)
        found |= {f"{effect}/disc": state.disc, f"{effect}/load": state.load, f"{effect}/wall": state.walls.force}
        found |= {f"{effect}/{name}": array for name, array in arrays_of(state).items()}
    np.savez(path, **found)


@pytest.fixture(scope="module")
def both(tmp_path_factory):
    """Arrays of all cases, compiled and interpreted."""
    folder, root = tmp_path_factory.mktemp("cases"), Path(__file__).parents[3]
    for disabled in "01":
        folders = os.pathsep.join((str(root), str(root / "scripts")))
        environment = os.environ | {"NUMBA_DISABLE_JIT": disabled, "PYTHONPATH": folders}
        subprocess.run([sys.executable, __file__, folder / disabled], env=environment, check=True)
    return [dict(np.load(f"{folder / disabled}.npz")) for disabled in "01"]


@EVERY
def test_compiled_is_interpreted(effect, both):
    compiled, plain = ({name: a for name, a in found.items() if name.partition("/")[0] == effect} for found in both)
    assert compiled.keys() == plain.keys()
    for name, array in compiled.items():
        np.testing.assert_allclose(array, plain[name], rtol=1e-9, atol=1e-9 * np.abs(array).max(initial=0.0), err_msg=name)


if __name__ == "__main__":
    write_all(sys.argv[1])
