"""scripts/lan.py: packets arrive no earlier than asked for, and are lost, cut and limited in size as asked for."""

import contextlib
import json
import subprocess
import sys
import time

import lan
import pytest

from tests.commands import finished

pytestmark = pytest.mark.skipif(bool(lan.missing()), reason=f"no LAN on this machine: {lan.missing()}")

ECHO = """
import socket
with socket.socket(type=socket.SOCK_DGRAM) as port:
    port.bind(("", 7007))
    print("ready", flush=True)
    while True:
        port.sendto(*port.recvfrom(65536))
"""
ASK = """
import json, socket, sys, time
host, count, size, patience = sys.argv[1], *map(int, sys.argv[2:4]), float(sys.argv[4])
trips = []
with socket.socket(type=socket.SOCK_DGRAM) as port:
    port.setsockopt(socket.IPPROTO_IP, 10, 2)  # IP_MTU_DISCOVER, IP_PMTUDISC_DO: a datagram goes in one packet or not at all
    port.settimeout(patience)
    port.connect((host, 7007))
    for n in range(count):
        data, begin = n.to_bytes(4, "big") * (size // 4), time.perf_counter()
        try:
            port.send(data)
            while port.recv(65536) != data:
                pass
            trips.append(time.perf_counter() - begin)
        except TimeoutError:
            trips.append(None)
        except OSError as error:
            trips.append(error.strerror)
print(json.dumps(trips))
"""
BURST = """
import json, socket, sys
missed = set(range(200))
with socket.socket(type=socket.SOCK_DGRAM) as port:
    port.settimeout(0.5)
    port.connect((sys.argv[1], 7007))
    for n in range(200):
        port.send(bytes([n]))
    try:
        while True:
            missed -= set(port.recv(1))
    except TimeoutError:
        print(json.dumps(sorted(missed)))
"""


@contextlib.contextmanager
def echoing(**options):
    """A LAN whose machine a sends datagrams back, and a function for what b measures: seconds of each round trip, None: lost.

    The function runs another script where one is named.
    """
    with lan.Lan(**options) as net:
        echo = subprocess.Popen(net.a.words([sys.executable, "-c", ECHO]), stdout=subprocess.PIPE, text=True)
        try:
            assert echo.stdout.readline().strip() == "ready"
            python = [sys.executable, "-c"]
            yield (
                net,
                lambda *words, script=ASK: json.loads(finished(net.b.words([*python, script, net.a.address, *words])).stdout),
            )
        finally:
            echo.kill()
            echo.communicate()


def namespaces():
    return subprocess.run(["ip", "netns", "list"], capture_output=True, text=True).stdout


def test_no_answer_comes_before_both_delays_are_over():
    with echoing(delay=3e-3) as (net, trips):
        measured = trips(20, 400, 5.0)
        assert net.counts() == ((20, 0), (20, 0))
    assert len(measured) == 20
    assert min(measured) >= 2 * 3e-3


def test_as_many_packets_are_lost_as_asked_for_and_the_same_ones_with_the_same_seed():
    def lost(seed):
        with echoing(loss=0.1, seed=seed) as (net, trips):
            missed = trips(script=BURST)
            (_, from_a), (carried, from_b) = net.counts()
        assert from_a + from_b == len(missed)
        assert carried + from_b == 200
        return missed

    first = lost(1)
    assert 20 <= len(first) <= 60  # expected 38, standard deviation 5.5
    assert lost(1) == first
    assert lost(2) != first


def test_a_cut_line_carries_nothing_for_some_seconds_or_until_it_is_joined_and_tells_nobody():
    with echoing() as (net, trips):
        net.cut()
        assert trips(2, 100, 0.1) == [None, None]
        net.join()
        assert None not in trips(2, 100, 5.0)
        begin = time.monotonic()
        net.cut(1.0)
        while trips(1, 100, 0.05) == [None]:
            pass
        assert time.monotonic() - begin >= 1.0


@pytest.mark.parametrize(("sender", "from_a", "from_b"), [("a", (0, 3), (3, 0)), ("b", (0, 0), (0, 3))])
def test_only_one_way_can_be_cut(sender, from_a, from_b):
    with echoing() as (net, trips):
        net.cut(sender=sender)
        assert trips(3, 100, 0.1) == [None] * 3
        assert net.counts() == (from_a, from_b)


def test_packets_are_no_larger_than_the_mtu():
    with echoing(mtu=576) as (_, trips):
        (small,), (large,) = trips(1, 548, 5.0), trips(1, 552, 5.0)  # 20 + 8 bytes of headers
    assert small < 5.0
    assert large == "Message too long"


def test_nothing_is_left_of_it_also_where_it_is_killed():
    with lan.Lan() as net:
        assert net.a.name in namespaces()
    assert net.a.name not in namespaces()
    with lan.Lan() as net:
        net._process.kill()
        net._process.wait()
        assert net.b.name in namespaces()
        with pytest.raises(OSError, match="the LAN has ended"):
            net.join()
    with lan.Lan():  # of the dead
        assert net.a.name not in namespaces()
        assert net.b.name not in namespaces()


@pytest.mark.parametrize("text", ["cut -1", "cut 1 2", "cut 1 from c", "join now", "twist", ""])
def test_a_wrong_line_is_answered_with_the_right_ones(text):
    with lan.Lan() as net:
        with pytest.raises(OSError, match="is not `cut"):
            net._ask(text)
        net.join()
