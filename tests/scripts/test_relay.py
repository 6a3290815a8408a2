"""scripts/relay.py: bytes come in order, unchanged, and no earlier than asked for; a coupled run has the same bits through it."""

import contextlib
import json
import random
import signal
import socket
import subprocess
import sys
import threading
import time
import tomllib
from pathlib import Path

import pytest
import relay

import colluvium
from coupler_protocol.wire.link_tcp import endpoint_from
from tests.commands import command, finished
from tests.same_bits import differing

SCRIPT = Path(relay.__file__)


@contextlib.contextmanager
def relayed(to, latency):
    """Endpoint of a relay to the endpoint `to` with a latency [ms]."""
    words = [sys.executable, SCRIPT, "--to", str(to), "--latency", str(latency)]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as process:
        try:
            yield process.stdout.readline().strip()
        finally:
            process.send_signal(signal.SIGTERM)
            assert "us late" in process.stdout.read()
    assert process.returncode == 0


@pytest.fixture
def echo():
    """Endpoint of a server that answers every connection with the bytes it gets."""

    def serve(listener):
        with contextlib.suppress(OSError):
            while True:
                threading.Thread(target=answer, args=(listener.accept()[0],), daemon=True).start()

    def answer(connection):
        with connection, contextlib.suppress(OSError):
            while data := connection.recv(1 << 16):
                connection.sendall(data)

    with socket.create_server(("127.0.0.1", 0)) as listener:
        threading.Thread(target=serve, args=(listener,), daemon=True).start()
        yield f"tcp://127.0.0.1:{listener.getsockname()[1]}"


def test_no_answer_comes_before_both_latencies_are_over(echo):
    with relayed(echo, 3.0) as endpoint, socket.create_connection(relay.host_and_port(endpoint)) as line:
        for n in range(20):
            begin = time.perf_counter()
            line.sendall(bytes([n]))
            assert line.recv(10) == bytes([n])
            assert time.perf_counter() - begin >= 2 * 3e-3


def test_a_long_stream_comes_back_unchanged_and_ends_where_it_ended(echo):
    """More than sockets hold, on two lines at once."""
    data = random.Random(1).randbytes(6_000_000)
    with relayed(echo, 1.0) as endpoint:
        lines = [socket.create_connection(relay.host_and_port(endpoint)) for _ in range(2)]
        for line in lines:
            threading.Thread(target=lambda line=line: (line.sendall(data), line.shutdown(socket.SHUT_WR)), daemon=True).start()
        for line in lines:
            with line, line.makefile("rb") as stream:
                assert stream.read() == data


def test_a_caller_is_told_that_nobody_is_there():
    with socket.create_server(("127.0.0.1", 0)) as free:
        endpoint = f"tcp://127.0.0.1:{free.getsockname()[1]}"
    line = relay.Relay(("127.0.0.1", 0), relay.host_and_port(endpoint), 0.0)
    thread = threading.Thread(target=line.run)
    thread.start()
    with socket.create_connection(line.address, 5.0) as caller:
        assert caller.recv(1) == b""
    line.stopped = True
    thread.join(5.0)
    assert not thread.is_alive()


def test_both_servers_have_the_same_bits_through_it(configs, tmp_path):
    data = tomllib.loads((configs / "quick_slope.toml").read_text(encoding="utf-8"))
    data["stage"] = data["stage"][:3]
    data["stage"][0]["until"] = {"steps": 100}
    data["stage"][2] |= {"handover": 40, "until": {"steps": 60}}
    colluvium.run(colluvium.Scene(**data), tmp_path / "direct").close()
    scene, out = tmp_path / "scene.json", [tmp_path / "grid", tmp_path / "discs"]
    scene.write_text(json.dumps(data))
    grid = subprocess.Popen(command("fdm_server", scene, "--bind", "tcp://127.0.0.1:0", "--out", out[0], "--quiet"))
    with relayed(endpoint_from(str(out[0] / "endpoint"), 60.0), 0.5) as endpoint:
        words = command("dem_server", scene, "--connect", endpoint, "--rank", 1, "--out", out[1], "--quiet")
        discs = finished(words)
        assert (discs.returncode, grid.wait(60.0)) == (0, 0), discs.stderr
    for folder, name in zip(out, ("fdm.rank0.couple.h5", "dem.rank1.couple.h5"), strict=True):
        assert differing(tmp_path / "direct" / name, folder / name) == []
    (stage,) = (row for row in json.loads((out[0] / "run.json").read_text())["stages"] if row["name"] == "couple")
    assert sum(stage["seconds"][column] for column in ("continuum", "waiting", "recording")) >= 59 * 2 * 0.5e-3
