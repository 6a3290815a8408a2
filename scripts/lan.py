"""A LAN of two machines on one: two network namespaces and a line between them that delays, loses and cuts packets.

    python scripts/lan.py [--delay MS] [--loss PERCENT] [--seed N] [--mtu BYTES]

Prints name and address of both namespaces and `ready`; `ip netns exec NAME PROGRAM` starts a program on one of these machines.
Then obeys lines of its standard input, and answers each with `done` or with what is wrong:

    cut [SECONDS] [from a|b]    nothing arrives any more, or nothing that a or b sends; for some seconds, or until `join`
    join                        the line carries packets again
    counts                      packets carried and packets lost, from a and from b

The end of its input, SIGINT or SIGTERM end the LAN: both namespaces are removed. It needs root, `ip` and /dev/net/tun, not netem.

The delay is that of one way. Every packet is lost with the probability --loss; each way has its own random numbers from --seed.
Which bytes are in a packet depends on the moment: two runs do not lose the same bytes. A cut line tells neither end: no reset, no
message of an unreachable machine, as where a switch fails or a firewall begins to drop. Both ends know the MTU.

One thread carries the packets between two TUN devices and waits as scripts/relay.py does. `Lan` starts this script for tests and
benchmarks.
"""

import argparse
import contextlib
import fcntl
import os
import random
import select
import shutil
import signal
import struct
import subprocess
import sys
import time
from collections import deque
from pathlib import Path
from typing import NamedTuple

sys.path.insert(0, str(Path(__file__).resolve().parent))

from relay import rest

TUN = "/dev/net/tun"
TUNSETIFF = 0x400454CA  # linux/if_tun.h
IFF_TUN, IFF_NO_PI = 0x0001, 0x1000  # packets of IP, nothing before them
DEVICE = "lan0"  # in both namespaces
LARGEST = 1 << 16  # bytes of a packet
ADDRESSES = ("192.168.77.1", "192.168.77.2")
LABELS = ("a", "b")


def missing():
    """What this machine lacks for a LAN, in words; empty where nothing is missing."""
    if not sys.platform.startswith("linux"):
        return "network namespaces need Linux"
    if not shutil.which("ip"):
        return "there is no command `ip`"
    if os.geteuid() != 0:
        return "only root can make network namespaces"
    try:
        os.close(os.open(TUN, os.O_RDWR))
        _ip("netns", "list")
    except (OSError, subprocess.CalledProcessError) as error:
        return f"no TUN device or no network namespace can be made: {error}"
    return ""


def _ip(*words):
    """What `ip WORDS` prints."""
    return subprocess.run(["ip", *map(str, words)], check=True, capture_output=True, text=True).stdout


def sweep():
    """Removes the namespaces of LANs whose process was killed."""
    for name in (row.split()[0] for row in _ip("netns", "list").splitlines()):
        prefix, _, rest_of_name = name.partition("-")
        pid = rest_of_name.partition("-")[0]
        if prefix == "colluvium" and pid.isdigit() and not Path("/proc", pid).exists():
            _ip("netns", "delete", name)


class Machine(NamedTuple):
    """One of both machines: the name of its network namespace and its address."""

    name: str
    address: str

    def words(self, command):
        """Command line that starts a command on this machine; the process is that of the command itself."""
        return ["ip", "netns", "exec", self.name, *map(str, command)]


class Way:
    """Packets under way from one device to the other; delay [s], loss: probability."""

    def __init__(self, source, target, delay, loss, seed):
        self.source, self.target, self.delay, self.loss = source, target, delay, loss
        self.under_way = deque()  # (when it is due [s], packet)
        self.cut_until = 0.0  # [s]
        self.carried = self.lost = 0
        self._chance = random.Random(seed)

    def read(self, now):
        """Takes all packets that have come by now [s]."""
        with contextlib.suppress(BlockingIOError):
            while True:
                packet = os.read(self.source, LARGEST)
                if now < self.cut_until or self._chance.random() < self.loss:
                    self.lost += 1
                else:
                    self.under_way.append((now + self.delay, packet))

    def write(self):
        """Hands on the packets that are due; one that the device does not take is lost."""
        while self.under_way and self.under_way[0][0] <= time.perf_counter():
            try:
                os.write(self.target, self.under_way.popleft()[1])
                self.carried += 1
            except OSError:  # its queue is full, or it is down
                self.lost += 1


class Line:
    """Two network namespaces, a TUN device in each, and the packets between them."""

    def __init__(self, delay, loss, seed, mtu):
        self.machines = [Machine(f"colluvium-{os.getpid()}-{x}", address) for x, address in zip(LABELS, ADDRESSES, strict=True)]
        self.devices = []
        self.stopped = False
        self._last = 0.0  # when packets came [s]
        sweep()
        try:
            for machine in self.machines:
                self._make(machine, mtu)
        except BaseException:
            self.remove()
            raise
        a, b = self.devices
        self.ways = [Way(a, b, delay, loss, f"{seed} a"), Way(b, a, delay, loss, f"{seed} b")]

    def _make(self, machine, mtu):
        _ip("netns", "add", machine.name)
        device = os.open(TUN, os.O_RDWR | os.O_NONBLOCK)
        self.devices.append(device)
        answer = fcntl.ioctl(device, TUNSETIFF, struct.pack("16sH22x", b"", IFF_TUN | IFF_NO_PI))  # the kernel chooses a name
        _ip("link", "set", answer[:16].rstrip(b"\0").decode(), "netns", machine.name, "name", DEVICE)
        inside = ("-n", machine.name)
        _ip(*inside, "link", "set", "lo", "up")
        _ip(*inside, "address", "add", f"{machine.address}/24", "dev", DEVICE)
        _ip(*inside, "link", "set", DEVICE, "addrgenmode", "none")  # no packets of IPv6: losses are those of our packets
        _ip(*inside, "link", "set", DEVICE, "mtu", mtu, "up")

    def run(self, commands):
        """Carries packets and obeys the lines of a file until it ends or the line is stopped."""
        while not self.stopped:
            for way in self.ways:
                way.write()
            pause = rest([way.under_way for way in self.ways], self._last)
            ready, _, _ = select.select([*self.devices, commands], [], [], pause)
            now = time.perf_counter()
            for way in self.ways:
                if way.source in ready:
                    self._last = now
                    way.read(now)
            if commands in ready:
                self._obey(commands.readline().decode(errors="replace"))
            if not ready and pause == 0.0:
                os.sched_yield()

    def _obey(self, text):
        if not text:
            self.stopped = True
            return
        try:
            answer = self._do(*text.split())
        except (TypeError, ValueError, StopIteration):
            answer = f"wrong: {text.strip()!r} is not `cut [SECONDS] [from a|b]`, `join` or `counts`"
        print(answer, flush=True)

    def _do(self, verb, *words):
        if verb == "cut":
            return self._cut(*words)
        if words:
            raise ValueError
        if verb == "join":
            for way in self.ways:
                way.cut_until = 0.0
            return "done"
        if verb == "counts":
            return " ".join(f"{way.carried} {way.lost}" for way in self.ways)
        raise ValueError

    def _cut(self, *words):
        """Drops packets, those under way as well."""
        ways = self.ways
        if "from" in words:
            *words, _, sender = words
            ways = [ways[LABELS.index(sender)]]
        (seconds,) = [float(word) for word in words] or [float("inf")]
        if not seconds > 0.0:
            raise ValueError
        for way in ways:
            way.cut_until = time.perf_counter() + seconds
            way.lost += len(way.under_way)
            way.under_way.clear()
        return "done"

    def remove(self):
        """Removes both namespaces; processes that still run in them keep theirs, without a line."""
        for device in self.devices:
            os.close(device)
        for machine in self.machines:
            with contextlib.suppress(subprocess.CalledProcessError):
                _ip("netns", "delete", machine.name)


class Lan:
    """A LAN as a context manager, in a process of its own; delay [s] of one way, loss: probability that a packet is lost.

    `a` and `b` are its machines. The LAN ends with the block, or with the process that made it, however that ends.
    """

    def __init__(self, delay=0.0, loss=0.0, seed=0, mtu=1500):
        words = ["--delay", 1e3 * delay, "--loss", 100.0 * loss, "--seed", seed, "--mtu", mtu]
        self._words = [sys.executable, __file__, *map(str, words)]

    def __enter__(self):
        self._process = subprocess.Popen(self._words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, bufsize=0)
        lines = [self._process.stdout.readline().decode().split() for _ in range(3)]
        if lines[-1] != ["ready"]:
            self.__exit__()
            raise OSError("there is no LAN: see what scripts/lan.py said")
        self.a, self.b = (Machine(*line) for line in lines[:2])
        return self

    def __exit__(self, *_):
        self._process.stdin.close()
        self._process.stdout.close()
        self._process.wait(30.0)

    def _ask(self, text):
        with contextlib.suppress(BrokenPipeError):
            self._process.stdin.write(f"{text}\n".encode())
        answer = self._process.stdout.readline().decode().strip()
        if not answer or answer.startswith("wrong"):
            raise OSError(answer or "the LAN has ended")
        return answer

    def cut(self, seconds=None, sender=None):
        """Carries no packet for some seconds (None: until `join`); sender: only none of "a" or of "b"."""
        self._ask(" ".join(["cut", *([str(seconds)] if seconds else []), *(["from", sender] if sender else [])]))

    def join(self):
        """Carries packets again."""
        self._ask("join")

    def counts(self):
        """((carried, lost) from a, (carried, lost) from b): packets so far."""
        a, lost_a, b, lost_b = map(int, self._ask("counts").split())
        return (a, lost_a), (b, lost_b)


def main(argv=None):
    """Carries packets until the input ends, or SIGINT or SIGTERM."""
    options = arguments(argv)
    if lacking := missing():
        print(f"no LAN: {lacking}", file=sys.stderr)
        return 4
    line = Line(1e-3 * options.delay, 1e-2 * options.loss, options.seed, options.mtu)
    try:
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, lambda *_: setattr(line, "stopped", True))
        for machine in line.machines:
            print(*machine)
        print("ready", flush=True)
        with open(0, "rb", 0, closefd=False) as commands:  # without a buffer, in which lines could wait unseen
            line.run(commands)
    finally:
        line.remove()
    return 0


def arguments(argv):
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--delay", type=float, default=0.0, metavar="MS", help="of one way, in milliseconds")
    parser.add_argument("--loss", type=float, default=0.0, metavar="PERCENT", help="of all packets")
    parser.add_argument("--seed", type=int, default=0, help="of the losses")
    parser.add_argument("--mtu", type=int, default=1500, metavar="BYTES", help="largest packet, 576 to 65535")
    options = parser.parse_args(argv)
    if not options.delay >= 0.0:
        parser.error("a delay cannot be negative")
    if not 0.0 <= options.loss <= 100.0:
        parser.error("a loss is 0 to 100 %")
    if not 576 <= options.mtu < LARGEST:
        parser.error("an MTU is 576 to 65535 bytes")
    return options


if __name__ == "__main__":
    sys.exit(main())
