"""The benchmark of a step runs and reports all it promises (no seconds asserted); what it counts and compares is right."""

import json

import numpy as np
import pytest
from bench.laws import FULL, Box
from bench.operations import operations
from bench.scalar_zone import step_of_zones

from fdm_server.step.blocks import from_blocks
from fdm_server.step.stress import limit
from tests.commands import run_script


@pytest.mark.trial
@pytest.mark.long
def test_every_row_has_its_companion(tmp_path):
    done = run_script("bench_step.py", "--fdm", "--fast", "--repeats", "2", "--json", tmp_path / "rows.json")
    assert done.returncode == 0, done.stderr
    rows = json.loads((tmp_path / "rows.json").read_text())
    assert all(row["value"] > 0.0 and row["companion"]["triad_GB_per_s"] > 0.0 for row in rows)
    names = [row["name"] for row in rows]
    assert sum(name.startswith("scalar loop") for name in names) == 2
    memory = {row["name"]: int(row["note"].split()[0]) for row in rows if row["name"].startswith("laws")}
    elastic, plastic = memory["laws: elastic, local"], memory["laws: elastic, mohr coulomb, tension, local"]
    assert elastic < plastic < memory["laws: elastic, mohr coulomb, tension, local, softening, flowing"]
    assert elastic < memory["laws: elastic, local, large strain"]


def test_the_scalar_loop_computes_what_the_kernels_compute():
    case = Box(40, 40, FULL, flowing=True)
    model, state = case.model, case.state
    law = model.material_law
    laws = [tuple(p[0]) for p in (law.elastic, law.mohr_coulomb, law.tension)]
    stress = from_blocks(state.stress, case.zones)
    plastic, force = np.zeros(case.zones, dtype=np.int64), np.zeros_like(state.force)
    for _ in range(12):
        case.step()
        step_of_zones(model.zones, model.grid.xy, state.velocity, *laws, stress, plastic, force)
    assert np.all(plastic & 1)
    np.testing.assert_allclose(stress, from_blocks(state.stress, case.zones), rtol=1e-9, atol=1e-3)
    np.testing.assert_allclose(force, state.force, rtol=1e-9, atol=1e-3)
    assert np.array_equal(plastic, from_blocks(state.plastic, case.zones)[:, 0])


def test_operations_are_counted_in_loops_and_calls_and_effects():
    counted = operations(_inner, per="LANES")
    assert counted == {"flops": 3, "divisions": 1}
    assert operations(_outer, per="LANES", present=("effect",)) == {"flops": 2 * 3 + 1, "divisions": 2, "roots": 1}
    assert operations(_outer, per="LANES") == {"flops": 2 * 3, "divisions": 2}


def _inner(x, y):
    return (x * y + 1.0) / (x - y)


def _outer(a, effect):
    for i in range(LANES):  # noqa: F821
        for t in range(2):
            a[i + t] = _inner(a[i], 2.0)
        if effect is not None:
            a[i] = sqrt(a[i] + effect)  # noqa: F821


def test_what_is_absent_in_a_caller_is_absent_in_what_it_calls():
    laws = ("mohr_coulomb", "tension")
    assert operations(limit, present=laws)["roots"] == 8
    assert operations(limit, present=(*laws, "softens"))["roots"] == 12  # those of plastic shear strain
