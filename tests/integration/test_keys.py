"""Two servers with keys on an address that others can reach: who is refused is told so, and the bits are those of one process."""

import contextlib
import os
import subprocess
import sys

import pytest

from coupler_protocol.wire import keys
from tests.commands import ROOT, command, finished
from tests.integration.short_runs import FILES, end, overrides, wait_for
from tests.same_bits import differing

STRANGERS = ROOT / "tests" / "coupler_protocol" / "wire" / "strangers.py"
NAMES = ("half_open", "garbage", "finished", "parts", "hellos", "messages", "large")


@pytest.fixture
def listening(tmp_path, configs):
    """fdm-server of the short run on all addresses, and a function that finishes a dem-server that connects with it."""
    for name in ("office", "old"):
        keys.new(tmp_path / "keys", name, tmp_path / f"{name}.key")
    out = tmp_path / "grid"
    words = [configs / "quick_slope.toml", "--quiet", *overrides()]
    options = ["--bind", "tcp://0.0.0.0:0", "--keys", tmp_path / "keys", "--out", out]
    fdm = subprocess.Popen(command("fdm_server", *words, *options), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)

    def discs(*more, folder="discs"):
        wait_for((out / "endpoint").exists, 60, "an address")
        port = (out / "endpoint").read_text().strip().rpartition(":")[2]
        address = f"tcp://127.0.0.1:{port}"
        return finished(command("dem_server", *words, "--connect", address, "--out", tmp_path / folder, *more))

    yield fdm, discs
    end(fdm)


def test_a_run_with_keys_has_the_bits_of_one_process_and_refuses_others(listening, tmp_path, short_run):
    fdm, discs = listening
    keys.revoke(tmp_path / "keys", "old")
    for more, words in ((["--key", tmp_path / "old.key"], "has revoked the key 'old'"), ([], "takes clients with a key only")):
        refused = discs(*more, folder=f"refused {len(more)}")
        assert refused.returncode == 4
        assert words in refused.stderr
        assert "Traceback" not in refused.stderr
    done = discs("--key", tmp_path / "office.key")
    assert done.returncode == 0, done.stderr
    _, said = fdm.communicate(timeout=60)
    assert fdm.returncode == 0, said
    assert "its key was revoked (key 'old')" in said
    assert "it has no key" in said
    assert "was admitted (key 'office')" in (tmp_path / "grid" / "fdm.rank0.log").read_text()
    for name in FILES:
        folder = "grid" if name.startswith("fdm") else "discs"
        assert differing(tmp_path / folder / name, short_run / name) == [], name


@pytest.mark.parametrize(
    ("module", "options", "words"),
    [
        ("fdm_server", ["--bind", "tcp://0.0.0.0:0"], "can be reached from other machines: there are no keys in"),
        ("dem_server", ["--connect", "tcp://203.0.113.7:5555"], "is another machine: name the key file of this one with --key"),
    ],
)
def test_a_server_without_keys_says_what_to_do(tmp_path, configs, module, options, words):
    done = finished(command(module, configs / "quick_slope.toml", "--out", "out", *options), cwd=tmp_path, timeout=60)
    assert done.returncode == 4
    assert words in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.long
def test_insecure_says_what_it_opens_and_both_sides_need_it(tmp_path, configs, short_run):
    words = [configs / "quick_slope.toml", "--quiet", "--insecure", *overrides()]
    fdm = subprocess.Popen(
        command("fdm_server", *words, "--bind", "tcp://0.0.0.0:0", "--out", tmp_path / "grid"), stderr=subprocess.PIPE, text=True
    )
    try:
        dem = finished(command("dem_server", *words, "--connect", tmp_path / "grid" / "endpoint", "--out", tmp_path / "discs"))
        assert dem.returncode == 0, dem.stderr
        _, said = fdm.communicate(timeout=60)
    finally:
        end(fdm)
    assert "--insecure: everybody who reaches tcp://0.0.0.0:" in said
    assert "can claim a free rank" in said
    for name in FILES:
        assert differing(tmp_path / ("grid" if name.startswith("fdm") else "discs") / name, short_run / name) == [], name


@pytest.mark.long
@pytest.mark.parametrize("kind", ["local", "open"])
def test_strangers_change_no_bit_of_a_run(tmp_path, configs, short_run, kind):
    """All kinds of strangers, one after the other, from the start of the discs to the last step."""
    more = ["--insecure"] if kind == "open" else []
    words = [configs / "quick_slope.toml", "--quiet", *more, *overrides()]
    fdm = subprocess.Popen(
        command("fdm_server", *words, "--bind", "tcp://127.0.0.1:0", "--out", tmp_path / "grid"),
        stderr=subprocess.PIPE,
        text=True,
    )
    servers, crowd = [fdm], []
    try:
        wait_for((tmp_path / "grid" / "endpoint").exists, 100, "an address")
        dem = subprocess.Popen(
            command("dem_server", *words, "--connect", tmp_path / "grid" / "endpoint", "--out", tmp_path / "discs"),
            stderr=subprocess.PIPE,
            text=True,
        )
        servers.append(dem)
        port = (tmp_path / "grid" / "endpoint").read_text().strip().rpartition(":")[2]
        number = 0
        while fdm.poll() is None:
            crowd.append(subprocess.Popen([sys.executable, STRANGERS, NAMES[number % len(NAMES)], port], stdin=subprocess.PIPE))
            number += 1
            with contextlib.suppress(subprocess.TimeoutExpired):
                fdm.wait(0.5)
            end(crowd.pop())
        assert number > 3
        assert fdm.returncode == 0, fdm.stderr.read()
        assert dem.wait(60) == 0, dem.stderr.read()
    finally:
        end(*servers, *crowd)
    assert (tmp_path / "grid" / "fdm.rank0.log").stat().st_size < 100_000
    for name in FILES:
        assert differing(tmp_path / ("grid" if name.startswith("fdm") else "discs") / name, short_run / name) == [], name


def test_a_launched_run_opens_no_port_and_no_secret_is_on_a_command_line(tmp_path, configs):
    """Nothing listens but a Unix socket in a folder of this user; the command lines and environments have no secret at all."""
    from tests.integration.short_runs import LONG, alive, children_of, coupled_frames

    words = ["run", configs / "quick_slope.toml", "--out", tmp_path / "run", "--quiet", *overrides(*LONG)]
    launcher = subprocess.Popen(command("colluvium.cli", *words), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    servers = []
    try:
        wait_for(lambda: coupled_frames(tmp_path / "run" / "dem.rank1.vtkhdf") > 1, 200, "coupled steps")
        servers = children_of(launcher.pid)
        assert len(servers) == 2
        endpoint = (tmp_path / "run" / "endpoint").read_text().strip()
        assert endpoint.startswith("ipc://")
        assert os.stat(os.path.dirname(endpoint.removeprefix("ipc://"))).st_mode & 0o077 == 0
        assert [address for pid in servers for address in listening_ports(pid)] == []
    finally:
        end(launcher)
        wait_for(lambda: not any(map(alive, servers)), 30, "the servers to end by themselves")


def listening_ports(pid):
    """Local addresses at which a process listens with TCP, from /proc."""
    sockets = set()
    for entry in os.listdir(f"/proc/{pid}/fd"):
        try:
            sockets.add(os.readlink(f"/proc/{pid}/fd/{entry}"))
        except OSError:
            continue
    for table in ("tcp", "tcp6"):
        with open(f"/proc/{pid}/net/{table}") as rows:
            for row in list(rows)[1:]:
                columns = row.split()
                if columns[3] == "0A" and f"socket:[{columns[9]}]" in sockets:
                    yield columns[1]
