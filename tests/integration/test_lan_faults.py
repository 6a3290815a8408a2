"""Two machines on a LAN, with keys, and what LANs and people do: the run has the bits of one process, or both sides end in words.

The machines are network namespaces, their line is scripts/lan.py.
"""

import contextlib
import json
import os
import signal
import subprocess
import threading
import time

import lan
import pytest

from coupler_protocol import exits
from coupler_protocol.wire import keys
from tests.commands import command, run_colluvium
from tests.integration.short_runs import coupled_frames, end, wait_for
from tests.integration.small_box import FILES, box
from tests.same_bits import differing

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(bool(lan.missing()), reason=f"no LAN on this machine: {lan.missing()}"),
]
STEPS = 1000
PORT = 5555
IMPATIENT = ("link.give_up=4.0", "link.timeout=1.0")
ENDS = ("fdm.rank0.couple.h5", "dem.rank1.couple.h5")


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    path = tmp_path_factory.mktemp("lan") / "scene.json"
    path.write_text(json.dumps(box(STEPS, every=50, checkpoint_steps=100)))
    return path


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory, scene):
    out = tmp_path_factory.mktemp("undisturbed")
    done = run_colluvium("run", scene, "--in-process", "--quiet", "--force", "--out", out)
    assert done.returncode == 0, done.stderr
    return out


class Office:
    """fdm-server on the machine a of a LAN, dem-server on b, with keys, in folders `grid` and `discs`."""

    def __init__(self, scene, folder):
        self.scene, self.out = scene, (folder / "grid", folder / "discs")
        self.keys, self.key = folder / "keys", folder / "office.key"
        keys.new(self.keys, "office", self.key)
        self.servers = ()

    def start(self, net, *overrides):
        """Starts both servers, with the same commands every time."""
        more = ["--quiet", *(word for pair in overrides for word in ("--set", pair))]
        address = f"tcp://{net.a.address}:{PORT}"
        grid = command("fdm_server", self.scene, "--bind", address, "--keys", self.keys, "--out", self.out[0], *more)
        discs = command("dem_server", self.scene, "--connect", address, "--key", self.key, "--out", self.out[1], *more)
        options = {"stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE, "text": True}
        self.servers = tuple(
            subprocess.Popen(machine.words(words), **options) for machine, words in ((net.a, grid), (net.b, discs))
        )

    def reach(self, frames):
        """Waits for some frames of coupled discs, in the middle of the run."""
        path = self.out[1] / "dem.rank1.vtkhdf"
        wait_for(lambda: coupled_frames(path) >= frames or None not in self.codes(), 200, "coupled steps")
        assert self.codes() == [None, None], [server.stderr.read() for server in self.servers]
        assert coupled_frames(path) < STEPS // 50, "the fault comes too late"

    def codes(self):
        return [server.poll() for server in self.servers]

    def ended(self, seconds):
        """(exit codes, what was said) of both servers, at the latest after that time."""
        said = [server.communicate(timeout=seconds)[1] for server in self.servers]
        return self.codes(), said

    def assert_done(self, undisturbed, files=FILES):
        """Both servers end well, with the bits of the run in one process."""
        codes, said = self.ended(200)
        assert codes == [0, 0], said
        for name in files:
            assert differing(self.out[name.startswith("dem")] / name, undisturbed / name) == [], name

    def moments(self):
        """Steps of the checkpoints of both sides."""
        return [{int(path.stem.rpartition("@")[2]) for path in folder.glob("*.couple@*.h5")} for folder in self.out]


@pytest.fixture
def office(scene, tmp_path):
    office = Office(scene, tmp_path)
    yield office
    for server in office.servers:
        with contextlib.suppress(ProcessLookupError):
            server.send_signal(signal.SIGCONT)
    end(*office.servers)


def test_lost_packets_cost_no_bit(office, undisturbed):
    with lan.Lan(delay=1e-4, loss=0.01, seed=1) as net:
        office.start(net)
        office.assert_done(undisturbed)
        (_, lost_of_grid), (_, lost_of_discs) = net.counts()
        assert lost_of_grid > 5
        assert lost_of_discs > 5


def test_small_packets_cost_no_bit(office, undisturbed):
    with lan.Lan(mtu=576) as net:
        office.start(net)
        office.assert_done(undisturbed)


@pytest.mark.trial
@pytest.mark.parametrize("seconds", [4.0, 20.0])
@pytest.mark.parametrize("lane", [False, True])
def test_an_outage_costs_time_and_no_bit(office, undisturbed, seconds, lane):
    with lan.Lan() as net:
        office.start(net, f"link.lane={'true' if lane else 'false'}")
        office.reach(2)
        net.cut(seconds)
        office.assert_done(undisturbed)


@pytest.mark.trial
@pytest.mark.parametrize("sender", [None, "a", "b"])
def test_after_a_silent_end_of_the_line_both_sides_end_in_words_and_go_on_later(office, undisturbed, sender):
    """Neither side is told: all packets are dropped, or those of one machine."""
    with lan.Lan() as net:
        office.start(net, *IMPATIENT)
        office.reach(6)
        net.cut(sender=sender)
        codes, said = office.ended(120)  # heartbeats 5 s, give_up 4 s, a farewell 1 s; the rest for a busy machine
        assert codes == [exits.PEER, exits.PEER], said
        assert "the discrete process of rank 1 was lost: not connected for" in said[0]
        assert "the continuum was lost: not connected for" in said[1]
        assert all("link.give_up = 4 s" in text and "Traceback" not in text for text in said)
        common = set.intersection(*office.moments())
        assert common, office.moments()
        net.join()
        office.start(net, *IMPATIENT)
        office.assert_done(undisturbed, ENDS)
        for folder, log in zip(office.out, ("fdm.rank0.log", "dem.rank1.log"), strict=True):
            assert f"step {max(common)} of stage 'couple'" in (folder / log).read_text()


@pytest.mark.trial
@pytest.mark.parametrize("victim", [0, 1], ids=["grid", "discs"])
def test_a_machine_that_stands_still_costs_time_and_no_bit(office, undisturbed, victim):
    with lan.Lan() as net:
        office.start(net)
        office.reach(2)
        os.kill(office.servers[victim].pid, signal.SIGSTOP)
        time.sleep(4.0)
        os.kill(office.servers[victim].pid, signal.SIGCONT)
        office.assert_done(undisturbed)


@contextlib.contextmanager
def slowed(process, run=0.01, stop=0.49):
    """A process that computes during a fiftieth of the time."""
    ended = threading.Event()

    def throttle():
        with contextlib.suppress(ProcessLookupError):
            while not ended.wait(run) and process.poll() is None:
                process.send_signal(signal.SIGSTOP)
                ended.wait(stop)
                process.send_signal(signal.SIGCONT)

    thread = threading.Thread(target=throttle)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()


@pytest.mark.trial
@pytest.mark.parametrize("victim", [0, 1], ids=["grid", "discs"])
def test_a_machine_fifty_times_slower_costs_time_and_no_bit(office, undisturbed, victim):
    with lan.Lan() as net:
        office.start(net)
        office.reach(2)
        with slowed(office.servers[victim]):
            time.sleep(10.0)
        office.assert_done(undisturbed)
