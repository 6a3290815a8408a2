"""Two servers in plain steps: killed, stopped by the system for a while, or asked to end, as in the loop step by step."""

import json
import signal
import subprocess
import sys
import time

import h5py
import pytest

from colluvium.running.threads import run
from coupler_protocol.files.saved_moments import inside
from coupler_protocol.scene.reader import build_scene
from coupler_protocol.wire import lanes
from tests.commands import run_colluvium
from tests.integration.short_runs import coupled_frames, end, wait_for
from tests.integration.test_plain_steps import CASES, SHORT, scene
from tests.same_bits import differing

pytestmark = pytest.mark.long
STEPS, EVERY = 20_000, 1_000  # of the stage that is disturbed: a second or so; a frame in so many steps
TIMEOUT, GIVE_UP = 1.0, 4.0  # [s]
STOPPED, PATIENT = 4.0, 30.0  # [s] for which the system stops a side, and `link.give_up` meanwhile
SERVER = """
import sys
from coupler_protocol.wire import lanes
from {} import __main__ as server
lanes.EARLIEST = 0
sys.exit(server.main(sys.argv[1:]))
"""
NAMES = {"grid": "fdm.rank0", "discs": "dem.rank1"}


@pytest.fixture(scope="module")
def straight(tmp_path_factory):
    """(scene file, run directory) of the undisturbed run in one process, which compiles plain steps."""
    data = scene(link__timeout=TIMEOUT, link__give_up=GIVE_UP, **CASES[SHORT])
    data["record"]["every"] = EVERY
    data["stage"][-1]["until"] = {"steps": STEPS}
    out = tmp_path_factory.mktemp("straight")
    file = tmp_path_factory.mktemp("scene") / "scene.json"
    file.write_text(json.dumps(data))
    data["link"] = {}  # kernels may be compiled longer than a step may take
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(lanes, "EARLIEST", 0)
        run(build_scene(data), out)
    assert json.loads((out / "run.json").read_text())["stages"][-1]["plain_steps"] > 0.9 * STEPS
    return file, out


class Servers:
    """Both servers of the scene, which share a run directory."""

    def __init__(self, file, straight, out):
        self.out = out
        self._before = coupled_frames(straight / "dem.rank1.vtkhdf") - STEPS // EVERY  # frames of earlier stages
        out.mkdir()

        def start(package, *words):
            words = [sys.executable, "-c", SERVER.format(package), file, "--out", out, "--quiet", "--force", *words]
            return subprocess.Popen([*map(str, words)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)

        self.grid = start("fdm_server", "--bind", "tcp://127.0.0.1:0")
        wait_for((out / "endpoint").exists, 60, "the grid to listen")
        self.discs = start("dem_server", "--connect", out / "endpoint", "--rank", "1")

    def of(self, side):
        return getattr(self, side)

    def other(self, side):
        return self.discs if side == "grid" else self.grid

    def in_plain_steps(self, frames=1):
        """Waits for so many frames of the last stage, whose steps are plain but for one for each frame."""
        wait_for(lambda: coupled_frames(self.out / "dem.rank1.vtkhdf") >= self._before + frames, 200, "plain steps")
        assert self.grid.poll() is None
        assert self.discs.poll() is None

    def row(self):
        """The last stage in run.json."""
        return json.loads((self.out / "run.json").read_text())["stages"][-1]


@pytest.fixture
def servers(straight, tmp_path):
    found = Servers(*straight, tmp_path / "run")
    try:
        yield found
    finally:
        end(found.grid, found.discs)


@pytest.mark.parametrize("victim", ["discs"])
def test_a_killed_peer_ends_the_other_side_as_its_fault(servers, victim):
    left = servers.other(victim)
    servers.in_plain_steps()
    servers.of(victim).kill()
    assert left.wait(GIVE_UP + TIMEOUT + 30.0) == 5
    errors = left.stderr.read()
    assert "was lost: not connected for" in errors
    assert f"(link.give_up = {GIVE_UP:g} s)" in errors
    name = next(name for side, name in NAMES.items() if side != victim)
    with h5py.File(servers.out / f"{name}.stopped.h5") as file:
        assert len(file) > 0
    if victim == "discs":
        assert servers.row()["plain_steps"] > 0


@pytest.mark.trial
def test_sides_that_the_system_stops_for_a_while_cost_no_bit_and_no_lane(straight, tmp_path):
    """Each side in turn for four seconds: the other one sends its last message again, and waits within `link.give_up`."""
    data = json.loads(straight[0].read_text())
    data["link"]["give_up"] = PATIENT
    file = tmp_path / "scene.json"
    file.write_text(json.dumps(data))
    servers = Servers(file, straight[1], tmp_path / "run")
    try:
        for frames, side in ((1, servers.grid), (3, servers.discs)):
            servers.in_plain_steps(frames)
            side.send_signal(signal.SIGSTOP)
            time.sleep(STOPPED)
            side.send_signal(signal.SIGCONT)
        for process in (servers.grid, servers.discs):
            assert process.wait(120) == 0, process.stderr.read()
    finally:
        end(servers.grid, servers.discs)
    for name in NAMES.values():
        assert differing(straight[1] / f"{name}.more.h5", servers.out / f"{name}.more.h5") == []
    row = servers.row()
    assert row["plain_steps"] > 0.9 * STEPS
    assert row["plain_steps_discrete"][0] > 0.9 * STEPS
    assert "one_by_one" not in row


@pytest.mark.parametrize(("side", "number"), [("grid", signal.SIGINT)])
def test_a_request_to_end_saves_both_sides_and_the_run_goes_on_with_the_same_bits(servers, straight, side, number):
    servers.in_plain_steps()
    servers.of(side).send_signal(number)
    assert servers.of(side).wait(30) == 130
    assert servers.other(side).wait(30) == 5
    assert f"interrupted by {number.name}" in servers.other(side).stderr.read()
    steps = [{path.name.partition("@")[2] for path in inside(servers.out, name)} for name in NAMES.values()]
    assert steps[0] & steps[1], "both sides have saved the same step"
    done = run_colluvium("resume", servers.out, "--in-process", "--quiet")
    assert done.returncode == 0, done.stderr
    for name in NAMES.values():
        assert differing(straight[1] / f"{name}.more.h5", servers.out / f"{name}.more.h5") == []
