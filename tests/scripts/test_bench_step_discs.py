"""The benchmark of the discs runs and reports all it promises (no seconds asserted); what it compares is the same."""

import json

import numpy as np
import pytest
from bench.dem import SIZES, Case, ScalarCase
from bench.dense_box import FRICTION, IN_TILE, dense_box, tile

from dem_server.observe.coordination import coordination
from dem_server.observe.unbalanced_ratio import unbalanced_ratio
from dem_server.pairs import listed_pairs
from dem_server.step.cycle import advance
from tests.commands import run_script


@pytest.mark.trial
@pytest.mark.long
def test_every_row_has_its_companion(tmp_path):
    done = run_script("bench_step.py", "--dem", "--fast", "--repeats", "2", "--json", tmp_path / "rows.json")
    assert done.returncode == 0, done.stderr
    rows = json.loads((tmp_path / "rows.json").read_text())
    assert all(row["value"] > 0.0 and row["companion"]["triad_GB_per_s"] > 0.0 for row in rows)
    found = {row["name"]: row for row in rows}
    packings = ["dense box, friction", "dense box, friction, contact bonds", "paper window, bonded, stones as clumps"]
    for name in packings:
        assert found[name]["unit"] == "disc-steps/s"
        assert "list build" in found[name]["note"]
        assert found[f"list build; {name}"]["unit"] == "ns/disc"
    assert all(", 0 bonds broken" in found[name]["note"] for name in packings[1:])
    assert found["scalar loop; dense box, friction"]["unit"] == "disc-steps/s"
    assert "cost of a step with contact bonds over without" in found
    assert {"step a disc; sizes 1:20 over 1:1", "list build a disc; sizes 1:20 over 1:1"} <= set(found)
    memory = {row["name"]: int(row["note"].split()[0]) for row in rows if row["name"].startswith("law")}
    assert memory == {
        "law: spring": 20, "law: spring, friction": 28, "law: spring, friction, bond": 29, "law: spring, friction, rolling": 36,
        "law: spring, friction, dashpot": 36, "law: spring, friction, parallel bond": 28 + 33, "law: all": 28 + 1 + 16 + 33,
    }  # fmt: skip


def test_the_scalar_loop_computes_what_the_kernels_compute():
    case = Case(*dense_box(1, 1, friction=FRICTION))
    model, state = case.model, case.state
    rng = np.random.default_rng(7)
    state.v[model.ring :] = 2e-5 * rng.standard_normal((case.free, 2))
    state.spin[model.ring :] = 1e-3 * rng.standard_normal(case.free)
    scalar, builds = ScalarCase(case), state.builds
    for step in range(12):
        advance(model, state, 0.0, 1)
        scalar.take(1)
        if step == 0:
            pairs = listed_pairs(state)
            sliding = (pairs.normal_force > 0.0) & (np.abs(pairs.shear_force) >= 0.55 * pairs.normal_force * (1.0 - 1e-12))
            assert 10 < sliding.sum() < 0.9 * len(sliding)
    assert state.builds == builds
    force, moment = np.abs(state.force).max(), np.abs(state.moment).max()
    np.testing.assert_allclose(scalar.force, state.force, rtol=0.0, atol=1e-9 * force)
    np.testing.assert_allclose(scalar.moment, state.moment, rtol=0.0, atol=1e-9 * moment)
    np.testing.assert_allclose(scalar.x, state.x, rtol=1e-12)


def test_the_box_is_dense_and_at_rest_and_as_large_as_it_says():
    assert all(across * up * IN_TILE == size for size, (across, up) in SIZES.items())
    case = Case(*dense_box(2, 1, friction=FRICTION))
    assert case.free == 2 * IN_TILE
    number, loose = coordination(case.model, case.state)
    assert 4.0 < number < 4.5
    assert loose < 0.05
    assert unbalanced_ratio(case.model, case.state, 0.0) < 1e-3
    assert np.array_equal(tile()[0], tile()[0])
