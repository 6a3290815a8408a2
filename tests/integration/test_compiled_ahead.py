"""Kernels of coupled stages are compiled while a side waits: nothing is compiled in the stages, and no bit changes."""

import json
import os

import pytest

from colluvium import open_run
from tests.commands import command, finished
from tests.integration.test_plain_steps import CASES, SHORT
from tests.same_bits import differing

interpreted = pytest.mark.skipif(os.environ.get("NUMBA_DISABLE_JIT", "0") != "0", reason="nothing is compiled")


@interpreted
@pytest.mark.trial
@pytest.mark.long
@pytest.mark.parametrize("case", [SHORT, *(case for case in CASES if "energies" in case)])  # each effect is in one of these
def test_nothing_is_compiled_after_a_side_has_compiled_ahead(tmp_path, case):
    done = finished(command("tests.integration.compiled_ahead", tmp_path, case), timeout=500)
    found = json.loads(done.stdout.splitlines()[-1])
    names = {side: [(ahead, name) for one, ahead, name in found["compiled"] if one == side] for side in ("grid", "discs")}
    for side in ("grid", "discs"):
        assert (False, "plain_loop") in names[side]
        assert [name for late, name in names[side] if late] == []
    assert len(found["texts"]) > 3  # progress says a few times a second what is compiled
    with open_run(tmp_path / "ahead") as run:
        assert run.info["compiled"]["seconds"] > 0.0
        assert run.info["windows"][0]["compiled"]["functions"] > 10
    files = sorted(path.name for path in (tmp_path / "ahead").iterdir() if path.suffix in (".h5", ".vtkhdf"))
    assert len(files) >= 6
    assert [(name, found) for name in files for found in differing(tmp_path / "ahead" / name, tmp_path / "apart" / name)] == []


def test_the_case_with_stones_is_among_them():
    assert SHORT in CASES
