"""Processes of a run are killed at random moments and started again with the same command until the run is finished."""

import os
import random
import signal
import subprocess
import sys
import time

import pytest

from coupler_protocol import exits
from tests.commands import command
from tests.integration.same_runs import assert_same_runs
from tests.integration.short_runs import alive, children_of, end, overrides, start_servers
from tests.same_bits import differing

pytestmark = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="reads /proc")
OFTEN = ("record.checkpoint_steps=20", "stage.0.until.steps=150", "link.give_up=3.0", "link.timeout=1.0")
KILLS = 3  # of one run


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory, configs):
    """Folder of the undisturbed run in two processes."""
    out = tmp_path_factory.mktemp("undisturbed")
    done = subprocess.run(words(configs, out), capture_output=True, text=True, timeout=400)
    assert done.returncode == 0, done.stderr
    return out


def words(configs, out):
    """The command of a run."""
    return command("colluvium.cli", "run", configs / "quick_slope.toml", "--out", out, "--quiet", *overrides(*OFTEN))


def moments(out):
    """What the sides have saved so far."""
    return {path.name for path in out.glob("*.h5")} if out.is_dir() else set()


def wait_for_progress(out, process, chance):
    """Waits until the run has saved something new, and then for a random moment; returns whether it still runs."""
    before, deadline = moments(out), time.monotonic() + 200.0
    while moments(out) == before and process.poll() is None:
        assert time.monotonic() < deadline
        time.sleep(0.01)
    time.sleep(chance.uniform(0.0, 0.4))
    return process.poll() is None


def kill(pids):
    """Kills processes."""
    for pid in pids:
        if alive(pid):
            os.kill(pid, signal.SIGKILL)


def seeds(count):
    """Seeds of a test; only the first one is quick enough for every day."""
    marks = [[], *([[pytest.mark.long, pytest.mark.trial]] * count)]
    return [pytest.param(seed, marks=marks[seed]) for seed in range(count)]


@pytest.mark.parametrize("seed", seeds(int(os.environ.get("COLLUVIUM_SEEDS", "5"))))  # 20 in the full form
def test_a_run_whose_processes_are_killed_goes_on_to_the_same_bits(tmp_path, configs, undisturbed, seed):
    """All processes at once, or the launcher, or one of the servers."""
    chance, out = random.Random(seed), tmp_path / "run"
    for _ in range(KILLS):
        run = subprocess.Popen(words(configs, out), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        try:
            if not wait_for_progress(out, run, chance):
                break
            servers = children_of(run.pid)
            victims = chance.choice([[run.pid, *servers], [run.pid], servers[:1], servers[-1:]])
            kill(victims)
            run.wait(120)
            deadline = time.monotonic() + 60.0
            while any(map(alive, servers)):  # without their launcher they save and end
                assert time.monotonic() < deadline
                time.sleep(0.05)
        finally:
            end(run)
    done = subprocess.run(words(configs, out), capture_output=True, text=True, timeout=400)
    assert done.returncode == 0, done.stderr
    assert_same_runs(undisturbed, out)
    again = subprocess.run(words(configs, out), capture_output=True, text=True, timeout=60)
    assert (again.returncode, again.stdout) == (0, "")
    assert "is finished (all stages done): nothing remains to be computed" in again.stderr


@pytest.mark.long
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
@pytest.mark.parametrize("asked", [0, 1])
def test_servers_by_hand_end_with_a_common_checkpoint_and_go_on_with_the_same_commands(
    tmp_path, configs, undisturbed, number, asked
):
    """Only one of the two machines gets the signal."""
    scene, folders = configs / "quick_slope.toml", (tmp_path / "a", tmp_path / "b")
    servers = start_servers(scene, *folders, *OFTEN)
    try:
        deadline = time.monotonic() + 200.0
        while not list(folders[1].glob("*.overload@*.h5")):
            assert time.monotonic() < deadline
            time.sleep(0.02)
        servers[asked].send_signal(number)
        codes = [server.wait(60) for server in servers]
    finally:
        end(*servers)
    assert codes == [exits.INTERRUPTED if rank == asked else exits.PEER for rank in (0, 1)]
    newest = [max(int(path.stem.rpartition("@")[2]) for path in folder.glob("*@*.h5")) for folder in folders]
    assert newest[0] == newest[1]
    servers = start_servers(scene, *folders, *OFTEN)
    try:
        assert [server.wait(200) for server in servers] == [0, 0]
    finally:
        end(*servers)
    for name in (name for name in moments(undisturbed) if "@" not in name):
        assert differing(undisturbed / name, folders[name.startswith("dem")] / name) == []


@pytest.mark.long
def test_a_second_run_into_the_folder_of_a_live_one_is_refused_also_with_force(tmp_path, configs):
    out, chance = tmp_path / "run", random.Random(1)
    run = subprocess.Popen(words(configs, out), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        assert wait_for_progress(out, run, chance)
        for more in ([], ["--force"]):
            done = subprocess.run([*words(configs, out), *more], capture_output=True, text=True, timeout=60)
            assert done.returncode == exits.ENVIRONMENT
            assert "is being written: run is computed there by process" in done.stderr
        assert run.wait(300) == 0
    finally:
        end(run)
