"""Imports in the idle time of a run: when they begin, what they leave alone, and that reports of progress pass through."""

import importlib
import os
import sys
import threading

import pytest

from colluvium.running.idle_imports import LOWEST, IdleImports
from tests.commands import ROOT, finished

SOURCE = """
import os, threading
thread = threading.current_thread().name
niceness = os.getpriority(os.PRIO_PROCESS, threading.get_native_id()) if hasattr(os, "getpriority") else None
"""


def row(step):
    return {"rank": 0, "stage": "equilibrium", "text": "", "step": step, "of": None, "ratio": None, "factor": None}


def idle_threads():
    return [thread for thread in threading.enumerate() if thread.name == "idle imports"]


@pytest.fixture
def module(tmp_path, monkeypatch):
    """Name of a module that notes which thread imports it, with which nice value."""
    (tmp_path / "imported_when_idle.py").write_text(SOURCE)
    monkeypatch.syspath_prepend(tmp_path)
    yield "imported_when_idle"
    sys.modules.pop("imported_when_idle", None)


def test_imports_begin_with_the_first_step(module):
    seen = []
    with IdleImports([module], seen.append) as picture:
        picture(row(0))
        assert not idle_threads()
        assert module not in sys.modules
        picture(row(3))
        for thread in idle_threads():
            thread.join()
        assert module in sys.modules
        picture(row(4))
    assert [report["step"] for report in seen] == [0, 3, 4]
    assert importlib.import_module(module).thread == "idle imports"


@pytest.mark.skipif(sys.platform != "linux", reason="priorities of threads")
def test_they_have_the_lowest_priority_and_leave_that_of_the_run_alone(module):
    before = os.getpriority(os.PRIO_PROCESS, 0)
    with IdleImports([module]) as picture:
        picture(row(1))
        for thread in idle_threads():
            thread.join()
    assert importlib.import_module(module).niceness == LOWEST
    assert os.getpriority(os.PRIO_PROCESS, threading.get_native_id()) == before


def test_nothing_is_begun_after_the_end(module):
    with IdleImports([module]) as picture:
        picture._ended.set()
        picture(row(1))
    for thread in idle_threads():
        thread.join()
    assert module not in sys.modules


ENDING = """
import sys
from importlib import import_module
from pathlib import Path
from colluvium import cli
from coupler_protocol.scene.reader import read_scene
scene = read_scene("configs/quick_slope.toml")
for name in cli.OF_BAND:
    import_module(name)
before = set(sys.modules)
cli._add_band(scene, Path(sys.argv[1]))
cli._conclude(Path(sys.argv[1]), None)
own = ("colluvium", "coupler_protocol", "dem_server", "fdm_server")
print("late:", *sorted(name for name in set(sys.modules) - before if name.startswith((*own, "scipy", "h5py", "rich", "shapely"))))
"""


@pytest.mark.long
def test_the_end_of_a_run_imports_nothing_more(tmp_path):
    """Otherwise the lists in colluvium/cli.py lack a module; rich chooses some of its own by the terminal."""
    shorter = ["--set=stage.overload.until.steps=20", "--set=stage.couple.until.steps=20"]
    command = [sys.executable, "-m", "colluvium.cli", "run", "configs/quick_slope.toml", f"--out={tmp_path / 'run'}", *shorter]
    done = finished(command, cwd=ROOT)
    assert done.returncode == 0, done.stderr
    done = finished([sys.executable, "-c", ENDING, str(tmp_path / "run")], cwd=ROOT)
    assert done.returncode == 0, done.stderr
    late = done.stdout.rpartition("late:")[2].split()
    assert [name for name in late if not name.startswith("rich._")] == []
