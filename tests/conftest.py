"""Fixtures that several folders of tests share, and how two workers share the tests."""

import contextlib
import fcntl
import json
import os
import signal
from pathlib import Path
from types import SimpleNamespace

import pytest
from hypothesis import HealthCheck, settings

from coupler_protocol.wire import keys
from tests.commands import ROOT, command, finished, run_colluvium
from tests.integration.short_runs import overrides

settings.register_profile("any machine", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("any machine")
TESTS = Path(__file__).resolve().parent
FIRST = (  # dearest first, so that both workers end at about the same time
    "integration/test_restart.py",
    "physics/test_interface_limit.py",
    "dem_server/observe/test_energy_ledger.py",
    "integration/test_two_processes.py",  # not beside the first: it would only wait for the run that both need
    "integration/test_coupled_real_time.py",
    "scenes/test_quick_pile.py",
    "dem_server/effects/test_every_effect.py",
    "integration/test_large_strain.py",
    "scenes/test_footing_and_hole.py",
    "integration/test_laws.py",
    "integration/test_exchange_interval.py",
    "physics/test_servo.py",
    "physics/test_slope_safety.py",
    "colluvium/forecast/test_factor_of_safety.py",
    "integration/test_plugin.py",
    "integration/test_window_shapes.py",
    # of the long ones
    "dem_server/step/test_compiled_code.py",
    "scripts/test_accuracy_w2.py",
    "hard/test_hard.py",
    "scenes/test_factors_of_safety.py",
    "scripts/test_bench_step_discs.py",
    "dem_server/step/test_without_jit.py",
    "scenes/test_paper_slope_steps.py",
    "fdm_server/step/test_without_jit.py",
    "scripts/test_bench_exchange.py",
    "scripts/test_accuracy_w5.py",
    "scripts/test_accuracy_cost.py",
)


def pytest_configure(config):
    """Leaves long tests out where none is named; processes that tests start can be interrupted.

    What a shell starts in the background ignores SIGINT, what nohup starts SIGHUP, and so would all processes that tests start.
    """
    if config.args_source is not pytest.Config.ArgsSource.ARGS and not config.option.markexpr:
        config.option.markexpr = "not long"  # workers get it from here
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    if hasattr(signal, "SIGHUP") and signal.getsignal(signal.SIGHUP) is signal.SIG_IGN:
        signal.signal(signal.SIGHUP, signal.SIG_DFL)


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items):
    """Files of FIRST first; a worker takes a whole file, whose tests share fixtures (pytest-xdist, loadfile)."""
    place = {name: number for number, name in enumerate(FIRST)}
    items.sort(key=lambda item: place.get(item.path.relative_to(TESTS).as_posix(), len(FIRST)))


@pytest.fixture(scope="session", autouse=True)
def _root_as_working_directory():
    """Shipped scenes name their files from the root of the checkout; tests may be started from any folder."""
    with contextlib.chdir(ROOT):
        yield


@pytest.fixture(scope="session", autouse=True)
def _keys_of_their_own(tmp_path_factory):
    """Tests and the processes they start neither use nor change the keys of the user."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(keys.VARIABLE, str(tmp_path_factory.mktemp("of_user") / "keys"))
        yield


@pytest.fixture(scope="session")
def configs():
    """Folder of the shipped scenes."""
    return ROOT / "configs"


@pytest.fixture(scope="session")
def quick_run(tmp_path_factory, configs):
    """quick_slope.toml computed by two processes, as a user would: (run directory, what was printed)."""
    words = command("colluvium.cli", "run", configs / "quick_slope.toml")
    return _computed_once(tmp_path_factory, "quick_slope", lambda out: finished([*words, "--out", out]))


@pytest.fixture(scope="session")
def short_run(tmp_path_factory, configs):
    """Directory of the short run (tests/integration/short_runs.py) in one process, without a stop; tests leave it as it is."""
    words = ["run", configs / "quick_slope.toml", "--in-process", "--quiet", *overrides()]
    return _computed_once(tmp_path_factory, "short_run", lambda out: run_colluvium(*words, "--out", out))[0]


def _computed_once(tmp_path_factory, name, compute):
    """(run directory, what was printed) of compute(run directory), by the worker that comes first; the other one waits for it."""
    base = tmp_path_factory.getbasetemp()
    shared = base.parent if "PYTEST_XDIST_WORKER" in os.environ else base
    out, printed = shared / name, shared / f"{name}.json"
    with (shared / f"{name}.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not printed.exists():
            done = compute(out)
            assert done.returncode == 0, done.stderr
            printed.write_text(json.dumps({"stdout": done.stdout, "stderr": done.stderr}))
    return out, SimpleNamespace(**json.loads(printed.read_text()))
