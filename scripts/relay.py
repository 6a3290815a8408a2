"""A slow line on one machine: hands TCP connections on and delays each direction by a latency.

    python scripts/relay.py --to tcp://127.0.0.1:5555 [--listen tcp://127.0.0.1:5556] [--latency MS]

Stands between both servers: `dem-server SCENE --connect tcp://127.0.0.1:5556 ...`. --to may name the file `endpoint` of a run's
directory. Bytes arrive in order and unchanged, none before its latency is over; how many are under way is not limited, so a
direction carries what the machine can. Prints the endpoint it listens on and, stopped with Ctrl-C, how late bytes left.

One thread does everything: threads of one process would wait for each other's turns. Just before bytes are due, and for a moment
after the last ones came, it does not sleep, for waking takes some 50 us, but gives the processor to whoever asks for it.
"""

import argparse
import os
import select
import signal
import socket
import sys
import time
from collections import deque
from functools import partial
from pathlib import Path
from statistics import median, quantiles

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from coupler_protocol.wire.link_tcp import endpoint_from

AWAKE = 5e-4  # [s] without sleep after the last bytes
NEAR = 2e-4  # [s] before bytes are due in which it does not sleep
ASLEEP = 0.1  # [s] at most
AT_ONCE = 1 << 16  # bytes a read; buffers of more are taken from the system and given back every time


class Direction:
    """Bytes on their way from one socket to another; late: list to which it adds how long [s] after they were due they left."""

    def __init__(self, source, target, latency, late):
        self.source, self.target, self.latency, self.late = source, target, latency, late
        self.under_way = deque()  # (when they are due [s], bytes; none: the end)
        self.reading = True

    def read(self, now):
        """Take what has come by now [s]."""
        data = self.source.recv(AT_ONCE)
        self.reading = bool(data)
        self.under_way.append((now + self.latency, data))

    def write(self):
        """Hand on what is due, as far as the other end takes it."""
        while self.under_way:
            due, data = self.under_way[0]
            late = time.perf_counter() - due
            if late < 0.0:
                return
            self.under_way.popleft()
            if not data:
                self.target.shutdown(socket.SHUT_WR)
                return
            sent = self._send(data)
            if sent < len(data):
                self.under_way.appendleft((due, data[sent:]))
                return
            self.late.append(late)

    def _send(self, data):
        try:
            return self.target.send(data)
        except BlockingIOError:
            return 0

    @property
    def done(self):
        """Whether its end has been handed on."""
        return not self.reading and not self.under_way


def rest(queues, last):
    """How long a relay may sleep [s]; queues of (when it is due [s], data), last: when data came [s]."""
    now = time.perf_counter()
    due = [queue[0][0] for queue in queues if queue]
    if due:
        return max(0.0, min(due) - now - NEAR)
    return ASLEEP if now - last > AWAKE else 0.0


class Relay:
    """Listens on `address` and connects every caller with `target` (host, port); latency [s] in each direction."""

    def __init__(self, address, target, latency):
        self.target, self.latency = target, latency
        self.late = []  # of all directions
        self.stopped = False
        self._lines = []  # pairs of directions
        self._last = 0.0  # when bytes came [s]
        self._listener = socket.create_server(address)
        self.address = self._listener.getsockname()[:2]

    def run(self):
        """Relay until `stopped`, then close all sockets."""
        while not self.stopped:
            for line in list(self._lines):
                self._attempt(line, *(d.write for d in line))
            rest = self._rest()
            ready = self._wait(rest)
            if self._listener in ready:
                self._accept()
            for line in list(self._lines):
                self._attempt(line, *(partial(d.read, self._last) for d in line if d.source in ready))
            if not ready and rest == 0.0:
                os.sched_yield()
        for line in list(self._lines):
            self._close(line)
        self._listener.close()

    def _rest(self):
        """How long it may sleep [s]."""
        return rest([direction.under_way for line in self._lines for direction in line], self._last)

    def _wait(self, rest):
        sources = [direction.source for line in self._lines for direction in line if direction.reading]
        ready, _, _ = select.select([self._listener, *sources], [], [], rest)
        if ready:
            self._last = time.perf_counter()
        return ready

    def _accept(self):
        caller, _ = self._listener.accept()
        try:
            called = socket.create_connection(self.target, 1.0)
        except OSError:  # nobody is there yet: the caller will try again
            caller.close()
            return
        for end in (caller, called):
            end.setblocking(False)
            end.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._lines.append([Direction(a, b, self.latency, self.late) for a, b in ((caller, called), (called, caller))])

    def _attempt(self, line, *steps):
        """Do something with a line; it ends where one of its ends has gone, or both have said all."""
        try:
            for step in steps:
                step()
        except OSError:
            self._close(line)
            return
        if all(direction.done for direction in line):
            self._close(line)

    def _close(self, line):
        self._lines.remove(line)
        for direction in line:
            direction.source.close()


def host_and_port(endpoint):
    """(host, port) of tcp://HOST:PORT."""
    host, _, port = endpoint.partition("://")[2].rpartition(":")
    return host.strip("[]"), int(port)


def lateness(late):
    """In words, how late bytes left; late [s]."""
    if len(late) < 2:
        return "nothing was relayed"
    late = [1e6 * seconds for seconds in late]
    return f"{len(late)} times bytes left: {median(late):.0f} us late (median), {quantiles(late, n=20)[-1]:.0f} us (95 %)"


def main(argv=None):
    """Relay until SIGINT or SIGTERM."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--to", required=True, metavar="ENDPOINT", help="where the continuum listens, or the file that says it")
    parser.add_argument("--listen", default="tcp://127.0.0.1:0", metavar="ENDPOINT", help="port 0: any free one")
    parser.add_argument("--latency", type=float, default=0.0, metavar="MS", help="one way, in milliseconds")
    options = parser.parse_args(argv)
    if not options.latency >= 0.0:
        parser.error("a latency cannot be negative")
    target = host_and_port(endpoint_from(options.to, 60.0))
    relay = Relay(host_and_port(options.listen), target, 1e-3 * options.latency)
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: setattr(relay, "stopped", True))
    print("tcp://{}:{}".format(*relay.address), flush=True)
    relay.run()
    print(lateness(relay.late), flush=True)


if __name__ == "__main__":
    main()
