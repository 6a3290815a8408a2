"""The kernels mean the same with and without the compiler."""

import json
import os
from types import SimpleNamespace

import numpy as np
import pytest

from tests.commands import ROOT, command, finished

pytestmark = pytest.mark.long

CASES = ["local small", "local large", "softening small", "softening large", "rayleigh small", "rayleigh large", "ledger small"]


def run(folder, disable):
    """All cases in one process, with or without the compiler: `sums` by case, and the `folder` of the states."""
    environment = os.environ | {"NUMBA_DISABLE_JIT": disable, "PYTHONPATH": str(ROOT), "PYTHONWARNINGS": "ignore"}
    done = finished(command("tests.fdm_server.step.computed_laws", folder, *CASES), env=environment)
    assert done.returncode == 0, done.stderr
    return SimpleNamespace(folder=folder, sums=json.loads(done.stdout))


@pytest.fixture(scope="module")
def interpreted(tmp_path_factory):
    return run(tmp_path_factory.mktemp("interpreted"), "1")


@pytest.fixture(scope="module")
def computed(tmp_path_factory):
    return run(tmp_path_factory.mktemp("compiled"), "0")


@pytest.mark.parametrize("case", CASES)
def test_compiled_equals_interpreted(interpreted, computed, case):
    (ratio, yielded), plain = interpreted.sums[case], np.load(interpreted.folder / f"{case}.npz")
    (compiled_ratio, compiled_yielded), compiled = computed.sums[case], np.load(computed.folder / f"{case}.npz")
    assert ("mass" in plain.files) == ("large" in case)
    assert ("dt" in plain.files) == ("rayleigh" in case)
    assert ("plastic_shear" in plain.files) == ("softening" in case)
    assert ("energy_gravity" in plain.files) == ("ledger" in case)
    assert yielded > (0 if "rayleigh" in case else 10)
    assert yielded == compiled_yielded
    np.testing.assert_allclose(compiled_ratio, ratio, rtol=1e-12)
    for name in plain.files:
        scale = np.abs(plain["energy_gravity" if name == "energy_error" else name]).max()
        assert (np.abs(compiled[name] - plain[name]) <= 1e-12 * scale).all(), name
