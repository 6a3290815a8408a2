"""`record.energy` in a coupled scene: both files hold ledgers, power is one number seen from two sides, nothing else changes."""

import copy
import json
import tomllib

import numpy as np
import pytest

import colluvium
from colluvium.results.rank_file import NotRecordedError
from tests.integration.short_runs import watched
from tests.same_bits import differing

GRID = ("kinetic", "strain", "plastic", "damping", "external", "gravity", "masses", "error")
DISCS = ("kinetic", "stored", "friction", "bonds", "damping", "masses", "gravity", "ring", "error")


@pytest.fixture(scope="module")
def tables(configs):
    """The quick slope to where it fails: slip, broken bonds, plastic zones."""
    data = tomllib.loads((configs / "quick_slope.toml").read_text())
    data["record"] = {"every": 5000, "history": 3, "energy": True}
    data["stage"][0]["until"] = {"steps": 400}
    data["stage"][2] |= {"handover": 100, "until": {"steps": 203}}
    data["stage"][3] |= {"gravity_factor": {"to": 8.0, "over": 600}, "until": {"steps": 1000}}
    return data


@pytest.fixture(scope="module")
def run(tables, tmp_path_factory):
    with colluvium.run(colluvium.Scene(**tables), tmp_path_factory.mktemp("energy") / "run") as run:
        yield run


def of(run, name, rank):
    """History and its steps, of the last stage."""
    steps, values = run.history(name, rank)
    return values[steps >= 603], steps[steps >= 603]


def test_power_is_the_same_from_both_sides(run):
    for name in ("interface_power", "interface_work"):
        steps, grid = run.history(name, 0)
        theirs, discs = run.history(name, 1)
        np.testing.assert_array_equal(steps, theirs)
        assert np.abs(grid - discs).max() < 1e-12 * np.abs(grid).max(), name
        assert np.abs(grid).max() > 0.0


def test_both_sides_explain_their_energies(run):
    """The grid to round-off (small strain), the discs to what contacts do inside a step that open, close and turn."""
    assert np.abs(of(run, "energy_error", 0)[0]).max() < 1e-12 * of(run, "energy_gravity", 0)[0].max()
    assert np.abs(of(run, "energy_error", 1)[0]).max() < 1e-4 * of(run, "energy_gravity", 1)[0].max()


def test_only_losses_are_losses(run):
    """Friction, bonds and damping take, and take much of what the weights of the discs give."""
    lost = 0.0
    for name in ("friction", "bonds", "damping"):
        values, _ = of(run, f"energy_{name}", 1)
        assert np.diff(values).min() > -1e-6 * values.max(), name
        assert values[-1] > 0.0, name
        lost += values[-1]
    assert lost > 0.1 * of(run, "energy_gravity", 1)[0][-1]


def test_what_the_rim_takes_the_ring_gives(run):
    """Work by the trapezoidal rule at the discs, by power at the rim: the same to the change of forces within a step."""
    work, ring = of(run, "interface_work", 0)[0], of(run, "energy_ring", 1)[0]
    np.testing.assert_allclose(-ring[-1], work[-1], rtol=0.01)


def test_every_history_is_there_and_begins_anew_in_each_stage(run):
    for rank, names in ((0, GRID), (1, DISCS)):
        for name in names:
            steps, values = run.history(f"energy_{name}", rank)
            assert np.all(np.diff(steps) > 0)
            if name not in ("kinetic", "strain", "stored"):  # the others are works since the stage began
                at = np.searchsorted(steps, 603)
                assert steps[at] == 603
                scale = np.abs(values).max() + np.abs(run.history("energy_gravity", rank)[1]).max()
                assert abs(values[at]) <= 1e-12 * scale, name


def test_asking_for_it_changes_no_bit_and_not_asking_leaves_nothing(tables, run, tmp_path):
    data = copy.deepcopy(tables)
    del data["record"]["energy"]
    with colluvium.run(colluvium.Scene(**data), tmp_path / "run") as plain:
        for name in ("fdm.rank0.overload.h5", "dem.rank1.overload.h5"):
            assert differing(run.folders[0] / name, tmp_path / "run" / name) == [], name
        for rank, name in ((0, "energy_kinetic"), (1, "energy_kinetic"), (0, "interface_power"), (1, "interface_work")):
            with pytest.raises(NotRecordedError):
                plain.history(name, rank)
    assert watched(json.loads((tmp_path / "run" / "run.json").read_text())) == []


def test_forces_held_over_steps_are_no_mismatch_and_both_ledgers_go_on(tables, tmp_path):
    data = copy.deepcopy(tables) | {"coupling": {"exchange_every": 5}}
    with colluvium.run(colluvium.Scene(**data), tmp_path / "run") as run:
        stages = run.info["stages"]
        assert any(0 < row["exchanges"] < row["steps"] and not row["fell_back"] for row in stages if "exchanges" in row)
        assert watched(run.info) == []
        np.testing.assert_array_equal(run.history("interface_work", 0)[0], run.history("interface_work", 1)[0])
        assert np.abs(of(run, "energy_error", 0)[0]).max() < 1e-12 * of(run, "energy_gravity", 0)[0].max()
        assert np.abs(of(run, "energy_error", 1)[0]).max() < 1e-4 * of(run, "energy_gravity", 1)[0].max()
