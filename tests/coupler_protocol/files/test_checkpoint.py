"""A checkpoint gives back every bit of a State, and its place never holds half of one."""

import dataclasses
from typing import NamedTuple

import h5py
import numpy as np
import pytest

from coupler_protocol.files import checkpoint, seal


class Bonds(NamedTuple):
    state: np.ndarray
    broken: int


class State(NamedTuple):
    velocity: np.ndarray
    flags: np.ndarray
    empty: np.ndarray
    time: float
    step: int
    sliding: bool
    bonds: Bonds | None


@dataclasses.dataclass
class GridState:
    stress: np.ndarray
    plastic: np.ndarray | None


def a_state(bonds):
    velocity = np.random.default_rng(1).standard_normal((50, 2))
    velocity[0] = (np.nan, -0.0)
    velocity[1] = (5e-324, np.inf)
    return State(velocity, np.arange(7, dtype=np.uint8), np.empty((0, 3)), 0.1 + 0.2, 2**40, True, bonds)


def test_every_bit_and_type_comes_back(tmp_path):
    state = a_state(Bonds(np.array([True, False]), 3))
    checkpoint.save(tmp_path / "fdm.rank0.couple.h5", state, {"scene": "abc", "step": 12, "factor": 1.5})
    fields, attributes = checkpoint.load(tmp_path / "fdm.rank0.couple.h5")
    assert attributes == {"scene": "abc", "step": 12, "factor": 1.5}
    assert attributes == checkpoint.attributes(tmp_path / "fdm.rank0.couple.h5")
    back = checkpoint.rebuild(State, fields)
    for name in ("velocity", "flags", "empty"):
        before, after = getattr(state, name), getattr(back, name)
        assert (after.dtype, after.shape, after.tobytes()) == (before.dtype, before.shape, before.tobytes())
    assert (back.time, back.step, back.sliding) == (0.1 + 0.2, 2**40, True)
    assert [type(back.time), type(back.step), type(back.sliding)] == [float, int, bool]
    assert back.bonds.state.tolist() == [True, False]
    assert back.bonds.broken == 3


class Side(NamedTuple):
    grid: GridState
    rims: dict[str, Bonds]


def test_states_in_states_come_back_as_what_they_were(tmp_path):
    side = Side(GridState(np.ones(3), None), {"upper": Bonds(np.arange(2), 1), "lower": Bonds(np.arange(3), 2)})
    checkpoint.save(tmp_path / "a.h5", side)
    back = checkpoint.rebuild(Side, checkpoint.load(tmp_path / "a.h5")[0])
    assert isinstance(back.grid, GridState)
    assert back.grid.plastic is None
    assert {name: bonds.broken for name, bonds in back.rims.items()} == {"upper": 1, "lower": 2}


def test_a_dictionary_without_entries_is_not_stored_and_comes_back(tmp_path):
    """Files of before have an empty group for it."""
    side, path = Side(GridState(np.ones(3), None), {}), tmp_path / "a.h5"
    checkpoint.save(path, side)
    with h5py.File(path) as file:
        assert list(file["state"]) == ["grid"]
    assert checkpoint.rebuild(Side, checkpoint.load(path)[0]).rims == {}
    with h5py.File(path, "a") as file:
        file["state"].create_group("rims")
    content = bytearray(path.read_bytes())
    seal.put_on(memoryview(content))
    path.write_bytes(content)
    assert checkpoint.rebuild(Side, checkpoint.load(path)[0]).rims == {}


def test_an_absent_effect_stays_absent(tmp_path):
    checkpoint.save(tmp_path / "a.h5", a_state(None))
    assert checkpoint.load(tmp_path / "a.h5")[0]["bonds"] is None
    checkpoint.save(tmp_path / "b.h5", GridState(np.ones((3, 4)), None))
    fields, _ = checkpoint.load(tmp_path / "b.h5")
    assert GridState(**fields).plastic is None


def test_a_failed_save_leaves_the_old_checkpoint(tmp_path):
    path = tmp_path / "a.h5"
    checkpoint.save(path, GridState(np.ones(3), None), {"step": 1})
    with pytest.raises(TypeError, match="not of object"):
        checkpoint.save(path, GridState(np.zeros(3), object()), {"step": 2})
    fields, attributes = checkpoint.load(path)
    assert attributes["step"] == 1
    assert fields["stress"].tolist() == [1.0, 1.0, 1.0]


def test_a_new_checkpoint_replaces_the_old_one_and_leaves_nothing_beside_it(tmp_path):
    path = tmp_path / "a.h5"
    for step in (1, 2):
        checkpoint.save(path, GridState(np.full(3, float(step)), None), {"step": step})
    assert checkpoint.load(path)[1]["step"] == 2
    assert [p.name for p in tmp_path.iterdir()] == ["a.h5"]
