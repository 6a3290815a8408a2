"""Both ends of the ways that a FORCE and a VELOCITY can go: there and back, nothing computed. Started by bench/links.py.

    python scripts/bench/link_ends.py continuum HOST WAY FOLDER NODES TRIPS REPEATS
    python scripts/bench/link_ends.py discs OFFER WAY FOLDER NODES TRIPS REPEATS

The first process prints its offer, as JSON on one line, and the second one gets it. NODES: numbers of nodes, separated by commas;
FOLDER: of the keys. Both print a line of JSON for each number of nodes. Calls of `access` with the names in MARKS stand around
the measured trips, so that a trace of system calls shows which belong to them.
"""

import json
import os
import resource
import socket
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from bench.stream_loops import lane_trips, raw_trips
from coupler_protocol.compiled.ahead import ENABLED
from coupler_protocol.process.interrupt import StopRequest
from coupler_protocol.scene.scene import Link
from coupler_protocol.wire import admission, gate_words, keys, link_tcp, messages, pumping
from coupler_protocol.wire.clocks import Clocks
from coupler_protocol.wire.frames import StepFrame
from coupler_protocol.wire.lanes import Lanes, Peer
from coupler_protocol.wire.lockstep import Conversation

WARM = 50  # trips before the measured ones
MARKS = {"begin": "/trips-of-{}-begin", "end": "/trips-of-{}-end"}
SESSION = 1


class Stream:
    """A plain TCP connection for each number of nodes, and a compiled loop on both ends."""

    kind = "raw awake"

    def __init__(self, answers, place, folder):
        self.answers = answers
        self.call(self.lanes(3), 0)  # compiles
        if answers:
            self.listener = socket.create_server((place, 0))
            self.offer = {"host": place, "port": self.listener.getsockname()[1]}
        else:
            self.address = place["host"], place["port"]

    def lanes(self, nodes):
        """Lanes of this end for a number of nodes, without a connection."""
        kinds = (messages.FORCE, messages.VELOCITY) if self.answers else (messages.VELOCITY, messages.FORCE)
        return Lanes(SESSION, [Peer(int(self.answers), 1, nodes)], *kinds)

    def trips_of(self, nodes):
        """Function that makes a number of trips with frames of that many nodes."""
        lanes = self.lanes(nodes)
        connection = self.listener.accept()[0] if self.answers else socket.create_connection(self.address)
        lanes.open(int(self.answers), connection)
        connection.setblocking(self.kind == "raw asleep")

        def trips(count):
            if self.call(lanes, count) != count:
                raise SystemExit("the other end has gone")

        return trips

    def close(self):
        """Ends the last connection with the process."""

    def call(self, lanes, count):
        """One compiled call."""
        if self.kind == "lane":
            return lane_trips(lanes.wire, count, self.answers)
        return raw_trips(lanes.wire, count, self.answers, self.kind == "raw awake")


class SleepingStream(Stream):
    """A Stream whose ends wait in `read`."""

    kind = "raw asleep"


class LaneStream(Stream):
    """A Stream whose ends wait as plain steps do."""

    kind = "lane"


class Linked:
    """The conversation of a run over ZeroMQ, in Python: through a Unix socket, as in `colluvium run`."""

    def __init__(self, answers, place, folder):
        self.answers, self.folder = answers, Path(folder)
        if answers:
            self.transport = link_tcp.HubTransport(self.address(place), self.rule())
            self.offer = {"endpoint": self.transport.endpoint}
        else:
            self.transport = link_tcp.RankTransport(place["endpoint"], self.ticket(place["endpoint"]))
        self.talk = Conversation(self.transport, 1, int(answers), Clocks(Link()), StopRequest())
        self.joined = False

    def address(self, place):
        """Address of the continuum."""
        return link_tcp.LOCAL

    def rule(self):
        """Rule of its gate."""
        return None

    def ticket(self, endpoint):
        """Pass of the discs."""
        return None

    def trips_of(self, nodes):
        """Function that makes a number of trips with frames of that many nodes."""
        force = StepFrame(messages.FORCE, 0, 1, len(messages.Answer._fields), 3 * nodes)
        velocity = StepFrame(messages.VELOCITY, 0, 1, len(messages.Order._fields), 2 * nodes)
        said, heard = (velocity, force) if self.answers else (force, velocity)
        if self.answers and not self.joined:
            self.admit_discs()

        def trips(count):
            for _ in range(count):
                if self.answers:
                    heard.accept(self.talk.receive((heard.kind,))[1])
                self.talk.send_step(said)
                if not self.answers:
                    heard.accept(self.talk.receive((heard.kind,))[1])

        return trips

    def admit_discs(self):
        """Gives rank 1 to the process whose first message comes; the conversation gets that message too."""
        while not self.joined:
            received = self.transport.receive(5.0)
            if received is not None:
                self.transport.admit(received[0], 1)
                self.talk._inbox.append((1, bytes(received[1])))
                self.joined = True

    def close(self):
        """Ends the link, after what is under way."""
        self.transport.close()


class GatedLink(Linked):
    """The same through gate and passage over TCP, as between two programs that a user starts on one machine."""

    secret = bytes(range(32))

    def address(self, place):
        """Address of the continuum."""
        return f"tcp://{place}:0"

    def rule(self):
        """Rule of its gate."""
        return admission.SecretRule(gate_words.LOCAL, self.secret)

    def ticket(self, endpoint):
        """Pass of the discs."""
        return admission.Pass(gate_words.LOCAL, self.secret)

    def trips_of(self, nodes):
        """The same, once compiled loops can pass the bytes on, as after the first second of a run."""
        while ENABLED and not pumping.ready():
            time.sleep(0.01)
        return super().trips_of(nodes)


class EncryptedLink(GatedLink):
    """The same with CURVE, as between two machines."""

    def rule(self):
        """Rule of its gate."""
        keys.new(self.folder / "keys", "bench", self.folder / "bench.key")
        return admission.KeyRule(self.folder / "keys")

    def ticket(self, endpoint):
        """Pass of the discs."""
        return admission.pass_of(endpoint, True, self.folder / "bench.key", False)


WAYS = {
    "raw awake": Stream,
    "raw asleep": SleepingStream,
    "lane": LaneStream,
    "link": Linked,
    "gated link": GatedLink,
    "encrypted link": EncryptedLink,
}


def sleeps():
    """How often threads of this process have slept so far."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_nvcsw


def measured(trips, nodes, count, repeats):
    """Row of one number of nodes: seconds of a trip, `repeats` times over `count` trips, and sleeps of this process in a trip."""
    trips(WARM)
    found, before = [], sleeps()
    os.access(MARKS["begin"].format(nodes), os.F_OK)
    for _ in range(repeats):
        begin = time.perf_counter()
        trips(count)
        found.append((time.perf_counter() - begin) / count)
    os.access(MARKS["end"].format(nodes), os.F_OK)
    return {"nodes": nodes, "seconds": found, "sleeps": (sleeps() - before) / (count * repeats)}


def main(side, place, way, folder, sizes, count, repeats):
    """Entry point."""
    answers = side == "continuum"
    end = WAYS[way](answers, place if answers else json.loads(place), folder)
    if answers:
        print(json.dumps(end.offer), flush=True)
    for nodes in map(int, sizes.split(",")):
        print(json.dumps(measured(end.trips_of(nodes), nodes, int(count), int(repeats))), flush=True)
    end.close()


if __name__ == "__main__":
    main(*sys.argv[1:])
