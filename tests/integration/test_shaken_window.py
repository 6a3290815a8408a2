"""A coupled window in ground that shakes, on a compliant and on a rigid side: the same bits in every form, and its energy.

The ledger of the grid closes to round-off; what the waves bring goes into motion, the discs and the dashpots.
"""

import numpy as np
import pytest

from colluvium import open_run
from colluvium.running import processes, threads
from coupler_protocol.scene.reader import build_scene
from tests.integration.kills import goes_on, kill_at, killed_run
from tests.integration.same_runs import assert_same_runs
from tests.integration.test_plain_steps import CASES, SHAKEN, scene, with_motion


def shaken(folder, **record):
    data = with_motion(scene(**CASES[SHAKEN]), folder)
    data["record"] = data.get("record", {}) | {"checkpoint_steps": 40, "checkpoint": 0.0} | record
    return build_scene(data)


@pytest.fixture(scope="module")
def straight(tmp_path_factory):
    folder = tmp_path_factory.mktemp("shaken")
    (folder / "run").mkdir()
    threads.run(shaken(folder), folder / "run")
    return folder


def test_ledgers_close_and_the_wave_brings_energy(straight):
    with open_run(straight / "run") as run:
        first = run.frames[run.last_frame(run.info["stages"][2]["name"])].step + 1
        steps, arriving = run.history("energy_arriving", 0)
        error, dashpots = (run.history(f"energy_{name}", 0)[1] for name in ("error", "dashpots"))
    assert steps[0] >= first
    assert np.abs(arriving).max() > 0.0
    assert np.abs(dashpots).max() > 0.0
    assert np.abs(error[-len(steps) :]).max() < 1e-9 * np.abs(arriving).max()


@pytest.mark.long
def test_two_processes_have_the_bits_of_one(straight, tmp_path):
    processes.run_scene(shaken(straight), tmp_path)
    assert_same_runs(straight / "run", tmp_path)


@pytest.mark.long
def test_a_killed_run_goes_on_with_the_same_bits(straight, tmp_path):
    steps = steps_of(straight / "run")
    killed_run(shaken(straight), tmp_path / "run", kill_at(steps - 60))
    goes_on(shaken(straight), tmp_path / "run")
    assert_same_runs(straight / "run", tmp_path / "run")


def steps_of(folder):
    with open_run(folder) as run:
        return run.frames[-1].step
