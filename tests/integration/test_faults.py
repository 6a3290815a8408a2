"""A line that is cut and a side that stands still cost time and no bit; these are processes, as in a run by hand."""

import json
import os
import signal
import subprocess
import sys
import time

import pytest

from tests.commands import ROOT, command, run_colluvium
from tests.integration.short_runs import coupled_frames, end, wait_for
from tests.integration.small_box import FILES, box
from tests.same_bits import differing

STEPS = 4000
SECONDS = 4.0  # of the fault: several time-outs of the link
pytestmark = [pytest.mark.long, pytest.mark.trial]


@pytest.fixture(scope="module")
def scene_path(tmp_path_factory):
    path = tmp_path_factory.mktemp("faults") / "scene.json"
    path.write_text(json.dumps(box(STEPS)))
    return path


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory, scene_path):
    out = tmp_path_factory.mktemp("undisturbed")
    done = run_colluvium("run", scene_path, "--in-process", "--quiet", "--force", "--out", out)
    assert done.returncode == 0, done.stderr
    return out


def started(*words):
    options = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    return subprocess.Popen([str(word) for word in words], **options)


def relay(grid, port):
    return started(sys.executable, ROOT / "scripts" / "relay.py", "--to", grid, "--listen", f"tcp://127.0.0.1:{port}")


@pytest.mark.parametrize("fault", ["the discs stop", "the grid stops", "the line is cut"])
def test_a_fault_of_some_seconds_changes_no_bit(tmp_path, scene_path, undisturbed, fault):
    fdm_out, dem_out = tmp_path / "a", tmp_path / "b"
    processes = [started(*command("fdm_server", scene_path, "--bind", "tcp://127.0.0.1:0", "--out", fdm_out, "--quiet"))]
    try:
        wait_for((fdm_out / "endpoint").exists, 100, "the grid")
        connect = fdm_out / "endpoint"
        if fault == "the line is cut":
            processes.append(relay(connect, 0))
            connect = processes[-1].stdout.readline().split()[-1]
        processes.append(started(*command("dem_server", scene_path, "--connect", connect, "--out", dem_out, "--quiet")))
        wait_for(lambda: coupled_frames(dem_out / "dem.rank1.vtkhdf") > 2, 200, "coupled steps")
        assert coupled_frames(dem_out / "dem.rank1.vtkhdf") < STEPS // 100, "the fault comes too late"
        victim = processes[-1] if fault == "the discs stop" else processes[0]
        if fault == "the line is cut":
            end(processes.pop(1))
            time.sleep(SECONDS)
            processes.insert(1, relay(fdm_out / "endpoint", connect.rpartition(":")[2]))
        else:
            os.kill(victim.pid, signal.SIGSTOP)
            time.sleep(SECONDS)
            os.kill(victim.pid, signal.SIGCONT)
        for process in (processes[0], processes[-1]):
            assert process.wait(200) == 0, process.stderr.read()
    finally:
        end(*processes)
    for name in FILES:
        assert differing((fdm_out if name.startswith("fdm") else dem_out) / name, undisturbed / name) == [], name
