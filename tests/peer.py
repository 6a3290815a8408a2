"""The other side of a run, written from docs/protocol.md alone: it imports nothing of this project.

`Discs` speaks for a window with the process of a grid: the removed ground is a bed of linear springs on the nodes of the rim.
`Grid` speaks for a grid with the process of a window: it moves the rim with given velocities. Both use ZeroMQ, and a lane if one
is offered. tests/integration/test_peer.py runs them against the servers; if the document is wrong, they do not understand them.
"""

import contextlib
import hmac
import os
import select
import socket
import struct
import tempfile
import threading
import time
import zlib

import msgpack
import zmq

VERSION = 4
KINDS = [
    "HELLO", "WELCOME", "REJECT", "PACKED", "FIELD", "READY", "GO", "FORCE", "VELOCITY", "STOP", "FAREWELL", "FAILURE",
    "PROGRESS",
]  # fmt: skip
NUMBER = {name: number for number, name in enumerate(KINDS, start=1)}
HEADER = struct.Struct("<4sHHQIIQII")
AGAIN = 1
RECORD, END_OF_STAGE, CHECKPOINT, STRAIN = 1, 2, 4, 8
FORCE_SCALARS, VELOCITY_SCALARS = 9, 7
PATIENCE = 120.0  # [s] for any message, longer than a busy machine compiles


class EndedError(Exception):
    """The other side ended the run, with its reason."""


# -- bytes ---------------------------------------------------------------------------------------------------------------


def sealed(kind, session, rank, sequence, payload, flags=0):
    """A frame: header and payload, with the checksum of all of it."""
    head = [b"CLVM", VERSION, NUMBER[kind], session, rank, flags, sequence, len(payload)]
    return HEADER.pack(*head, zlib.crc32(HEADER.pack(*head, 0) + payload)) + payload


def opened(frame):
    """(kind, session, rank, flags, sequence, payload) of a frame that is whole."""
    magic, version, kind, session, rank, flags, sequence, length, check = HEADER.unpack_from(frame)
    payload = frame[HEADER.size :]
    assert (magic, version, length) == (b"CLVM", VERSION, len(payload))
    assert zlib.crc32(frame[:36] + bytes(4) + payload) == check
    return KINDS[kind - 1], session, rank, flags, sequence, payload


def numbers(data):
    """Float64 of an array or of a step message."""
    return list(struct.unpack(f"<{len(data) // 8}d", data))


def array(values):
    """Bytes of float64."""
    return struct.pack(f"<{len(values)}d", *values)


def pairs(flat, of=2):
    """Rows of `of` numbers."""
    return [tuple(flat[i : i + of]) for i in range(0, len(flat), of)]


# -- ways ----------------------------------------------------------------------------------------------------------------


class Lane:
    """A plain connection for step messages. role, other: of the two ends, by which they prove that they know the token."""

    def __init__(self, connection, token, role, other):
        self.connection, self._got = connection, b""
        connection.settimeout(5.0)
        nonce = os.urandom(32)
        connection.sendall(nonce)
        connection.sendall(hmac.digest(token, role + self._exactly(32), "sha256"))
        assert hmac.compare_digest(self._exactly(32), hmac.digest(token, other + nonce, "sha256"))

    def _exactly(self, size):
        found = b""
        while len(found) < size:
            part = self.connection.recv(size - len(found))
            assert part, "the lane was closed"
            found += part
        return found

    def send(self, frame):
        self.connection.sendall(frame)

    def receive(self):
        """The next frame, or None if the other end has closed the lane."""
        try:
            head = self._exactly(HEADER.size)
            return head + self._exactly(HEADER.unpack(head)[7])
        except (AssertionError, OSError):
            return None


class Side:
    """One side of one conversation: turns, repetitions and both ways. asks: whether it is the discrete side."""

    def __init__(self, asks, rank, timeout):
        self.asks, self.rank, self.timeout = asks, rank, timeout
        self.session = self.sequence = 0
        self.lane = None
        self.progress = []  # texts of PROGRESS
        self.by_lane = self.repeated = 0  # step messages that came over the lane; frames that were asked for again
        self.deaf_to = set()  # turns whose first message is ignored, as if it had been lost
        self.alive = lambda: True  # whether the other side runs
        self._last = b""

    def send(self, kind, content):
        """Sends the message of this turn; content: a map, or float64 as bytes."""
        payload = content if isinstance(content, bytes) else msgpack.packb(content)
        self._last = sealed(kind, self.session, self.rank, self.sequence, payload)
        fits = (kind, len(payload)) in self.fitting if self.lane else False
        (self.lane.send if fits else self.post)(self._last)
        self.sequence += not self.asks

    def receive(self, *kinds):
        """Waits for the message of this turn; returns its kind, and its content or float64."""
        until, again = time.monotonic() + PATIENCE, time.monotonic() + self.timeout
        while time.monotonic() < until and self.alive():
            frame = self._next_frame()
            if frame is None:
                if time.monotonic() > again:
                    again = time.monotonic() + self.timeout
                    self._repeat(AGAIN)
                continue
            kind, session, rank, flags, sequence, payload = opened(frame)
            assert rank == self.rank
            assert self.session in (0, session) or (session == 0 and kind in ("HELLO", "REJECT", "FAILURE"))
            if kind == "PROGRESS":
                self.progress.append(msgpack.unpackb(payload)["doing"])
            elif kind in ("FAILURE", "REJECT") and kind not in kinds:
                raise EndedError(msgpack.unpackb(payload)["reason"])
            elif sequence == self.sequence:
                assert kind in kinds, f"{kind} in turn {sequence}, not {kinds}"
                if sequence in self.deaf_to:
                    self.deaf_to.discard(sequence)
                    continue
                self.sequence += self.asks
                return kind, numbers(payload) if kind in ("FORCE", "VELOCITY") else msgpack.unpackb(payload)
            elif sequence == self.sequence - 1 and (flags & AGAIN or kind == "HELLO"):
                self.repeated += 1
                self._repeat(0)
            else:
                assert sequence < self.sequence, f"{kind} of turn {sequence} in turn {self.sequence}"
        raise TimeoutError(f"no {kinds} in turn {self.sequence}")

    def _repeat(self, flags):
        if self._last:
            kind, session, rank, _, sequence, payload = opened(self._last)
            self.post(sealed(kind, session, rank, sequence, payload, flags))

    def _next_frame(self):
        """A frame of either way, or None."""
        ways = [self.socket, self.lane.connection] if self.lane else [self.socket]
        poller = zmq.Poller()
        for way in ways:
            poller.register(way, zmq.POLLIN)
        poller.poll(int(200 * min(1.0, self.timeout)))
        if self.lane and select.select([self.lane.connection], [], [], 0.0)[0]:
            frame = self.lane.receive()
            if frame is None:
                self.lane = None
            self.by_lane += frame is not None
            return frame
        with contextlib.suppress(zmq.Again):
            frame = self.take()
            kind, *_, payload = opened(frame)
            if self.lane and kind in ("FORCE", "VELOCITY") and len(payload) == self.heard_by_lane:
                self.lane = self.lane.connection.close()
            return frame
        return None

    def close(self):
        if self.lane:
            self.lane.connection.close()
        self.socket.close(1000)
        self.context.term()


# -- the way through a gate ----------------------------------------------------------------------------------------------


class Passage:
    """Proves itself at the gate of a continuum, then passes the bytes of one connection to `endpoint` on."""

    def __init__(self, address, secret):
        host, port = address.removeprefix("tcp://").rsplit(":", 1)
        self.outside = socket.create_connection((host, int(port)), timeout=PATIENCE)
        greeting = self.outside.recv(64, socket.MSG_WAITALL)
        assert greeting[:16] == b"CLVMGATE" + bytes([1, 1]) + bytes(6)
        claim = greeting[:16] + bytes(16) + bytes(32) + os.urandom(32)
        claim += hmac.digest(secret, b"discs" + greeting + claim, "sha256")
        self.outside.sendall(claim)
        verdict = self.outside.recv(72, socket.MSG_WAITALL)
        assert verdict[:16] == b"CLVMGATE" + bytes([1, 0]) + struct.pack("<H4x", VERSION), f"verdict {verdict[9]}"
        assert verdict[40:] == hmac.digest(secret, b"continuum" + greeting + claim + verdict[:40], "sha256")
        folder = tempfile.mkdtemp()
        self.endpoint = f"ipc://{folder}/passage"
        self.listener = socket.socket(socket.AF_UNIX)
        self.listener.bind(f"{folder}/passage")
        self.listener.listen()
        threading.Thread(target=self._serve, daemon=True).start()

    def _serve(self):
        inside = self.listener.accept()[0]
        threading.Thread(target=self._copy, args=(inside, self.outside), daemon=True).start()
        self._copy(self.outside, inside)

    @staticmethod
    def _copy(source, target):
        with contextlib.suppress(OSError):
            while data := source.recv(1 << 16):
                target.sendall(data)
            target.shutdown(socket.SHUT_WR)


# -- the discrete side ---------------------------------------------------------------------------------------------------


class Discs(Side):
    """A window. scene: the scene with all defaults, as in scene.json of the continuum; package: version of the continuum.

    endpoint: ipc://FOLDER/link, or tcp://HOST:PORT with the secret of the user (kind 1 of a gate), then without a lane.
    """

    def __init__(self, endpoint, scene, package, rank=1, lane=False, secret=None):
        super().__init__(True, rank, scene["link"]["timeout"])
        self.folder = os.path.dirname(endpoint.removeprefix("ipc://"))
        self.passage = None if secret is None else Passage(endpoint, secret)
        self.context = zmq.Context()
        self.socket = self.context.socket(zmq.DEALER)
        self.socket.routing_id = b"P" + os.urandom(15)
        self.socket.connect(self.passage.endpoint if self.passage else endpoint)
        hello = {"package": package, "float": "<f8", "scene": scene}
        self.hello = hello | ({"lane": 0} if lane else {})

    def post(self, frame):
        self.socket.send(frame)

    def take(self):
        return self.socket.recv(zmq.NOBLOCK)

    def join(self):
        """HELLO and WELCOME; enters the lane. Returns the nodes of the rim."""
        self.send("HELLO", self.hello)
        _, welcome = self.receive("WELCOME")
        self.session, self.rim = welcome["session"], pairs(numbers(welcome["rim"]))
        self.surface = pairs(numbers(welcome["surface"])) if "surface" in welcome else None
        assert 0 < welcome["run"] < 1 << 48
        K = len(self.rim)
        self.fitting, self.heard_by_lane = {("FORCE", 8 * (FORCE_SCALARS + 3 * K))}, 8 * (VELOCITY_SCALARS + 2 * K)
        if "lane" in welcome:
            way = socket.socket(socket.AF_UNIX)
            way.connect(f"{self.folder}/lane-{welcome['lane']['port']}")
            self.lane = Lane(way, welcome["lane"]["token"], b"discs", b"continuum")
        return self.rim

    def tractions(self, zones):
        """Forces of the removed zones on the ground, at the nodes: stress of the nearest zone on each segment of the rim."""
        force = [[0.0, 0.0] for _ in self.rim]
        for i, (x0, y0) in enumerate(self.rim if self.surface is None else self.rim[:-1]):
            j = (i + 1) % len(self.rim)
            x1, y1 = self.rim[j]
            _, _, _, xx, yy, xy, _ = min(zones, key=lambda z: (z[0] - 0.5 * (x0 + x1)) ** 2 + (z[1] - 0.5 * (y0 + y1)) ** 2)
            nx, ny = y1 - y0, x0 - x1  # outward normal of the window times the length: its nodes are counter-clockwise
            for node in (i, j):
                force[node][0] -= 0.5 * (xx * nx + xy * ny)
                force[node][1] -= 0.5 * (xy * nx + yy * ny)
        return force

    def run(self, stiffness):
        """The whole run: forces P0 - stiffness u on the nodes, u their displacement [m]. Returns what happened."""
        self.join()
        self.send("PACKED", {"discs": 0})
        _, field = self.receive("FIELD")
        zones = pairs(numbers(field["field"]), 7)
        begin, K, history = self.tractions(zones), len(self.rim), self.hello["scene"]["record"]["history"]
        self.send("READY", {"inner_mass": array([0.0] * K), "report": {"porosity": 0.0}})
        _, go = self.receive("GO")
        moved, orders = [[0.0, 0.0] for _ in range(K)], []
        step, asked, shear = go["step"], False, 0.0
        measured = said = [0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
        while True:
            force = [p - stiffness * u for P, U in zip(begin, moved, strict=True) for p, u in zip(P, U, strict=True)]
            if orders and orders[-1][2] & END_OF_STAGE:
                said = measured
            values = said + force + [stiffness] * K
            said = measured
            values += [number for x, y in self.bins(go["bin"]) for number in (x, y, shear)] if asked else []
            self.send("FORCE", array(values))
            kind, content = self.receive("VELOCITY", "STOP")
            if kind == "STOP":
                break
            stage, number, _gravity, _factor, dt, steps, flags = content[:VELOCITY_SCALARS]
            assert (number, dt) == (step + steps, 1.0)
            velocity = pairs(content[VELOCITY_SCALARS:])
            assert len(velocity) == K
            for U, (vx, vy) in zip(moved, velocity, strict=True):
                U[0] += vx * steps
                U[1] += vy * steps
            step, asked = int(number), bool(int(flags) & STRAIN)
            if step % history == 0:
                stored = 0.5 * stiffness * sum(u * u for U in moved for u in U)
                power = sum(p * v for p, v in zip(force, content[VELOCITY_SCALARS:], strict=True))
                measured = [0.0, 1.0, 0.0, stored, power, 0.0, 0.0, 0.0, 0.0]
            orders.append((int(stage), int(number), int(flags)))
        times = {"name": "couple", "computing": 0.0, "waiting": 0.0, "recording": 0.0}
        self.send("FAREWELL", {"report": {}, "stages": [times]})
        return {"reason": content["reason"], "go": go, "field": field, "zones": zones, "moved": moved, "orders": orders}

    def bins(self, length):
        """Middles of the bins for strain, row by row from below, left to right."""
        outline = self.rim + (self.surface or [])
        (x0, x1), (y0, y1) = ((min(axis), max(axis)) for axis in zip(*outline, strict=True))
        columns, rows = max(1, round((x1 - x0) / length)), max(1, round((y1 - y0) / length))
        return [
            (x0 + (column + 0.5) * (x1 - x0) / columns, y0 + (row + 0.5) * (y1 - y0) / rows)
            for row in range(rows)
            for column in range(columns)
        ]


# -- the continuum -------------------------------------------------------------------------------------------------------


class Grid(Side):
    """A grid with one window. rim: its nodes, counter-clockwise."""

    def __init__(self, rim, timeout, lane=False):
        super().__init__(False, 1, timeout)
        self.rim, self.offers = rim, lane
        K = len(rim)
        self.fitting, self.heard_by_lane = {("VELOCITY", 8 * (VELOCITY_SCALARS + 2 * K))}, 8 * (FORCE_SCALARS + 3 * K)
        self.context = zmq.Context()
        self.socket = self.context.socket(zmq.ROUTER)
        self.folder = tempfile.mkdtemp()
        self.endpoint = f"ipc://{self.folder}/link"
        self.socket.bind(self.endpoint)
        self._sender = b""

    def post(self, frame):
        self.socket.send_multipart([self._sender, frame])

    def take(self):
        self._sender, frame = self.socket.recv_multipart(zmq.NOBLOCK)
        return frame

    def welcome(self):
        """HELLO and WELCOME; opens the lane. Returns the content of HELLO."""
        _, hello = self.receive("HELLO")
        self.session = session = 1 + int.from_bytes(os.urandom(7), "little")
        content = {"session": session, "run": 1 + int.from_bytes(os.urandom(5), "little"), "dt": 1.0, "exchange_every": 1}
        content["rim"] = array([c for node in self.rim for c in node])
        if not (self.offers and hello.get("lane") == 0):
            self.send("WELCOME", content)
            return hello
        token = os.urandom(32)
        with socket.socket(socket.AF_UNIX) as door:
            door.bind(f"{self.folder}/lane-7")
            door.listen()
            self.send("WELCOME", content | {"lane": {"port": 7, "token": token}})
            door.settimeout(PATIENCE)
            self.lane = Lane(door.accept()[0], token, b"continuum", b"discs")
        return hello

    def begin(self, zones, go):
        """PACKED to GO. zones: rows x, y, area, xx, yy, xy, density; go: content of GO. Returns the content of READY."""
        self.packed = self.receive("PACKED")[1]
        rows = array([number for zone in zones for number in zone])
        self.send("FIELD", {"field": rows, "gravity": go["gravity"], "insitu": True})
        _, ready = self.receive("READY")
        self.step, self.stage = go["step"], go["stage"]
        self.send("GO", go)
        return ready

    def turn(self, velocity, flags=0, extra=0):
        """One step with velocities [m/step] of the nodes, 0 ... 1 in turn; returns scalars, forces, sums and strain of FORCE.

        extra: rows of strain that the FORCE of this turn has.
        """
        found = self.forces(extra)
        self.step += 1
        scalars = [float(self.stage), float(self.step), 0.0, 1.0, 1.0, 1.0, float(flags)]
        self.send("VELOCITY", array(scalars + [number for node in velocity for number in node]))
        return found

    def forces(self, extra=0):
        """Waits for FORCE."""
        _, values = self.receive("FORCE")
        K = len(self.rim)
        assert len(values) == FORCE_SCALARS + 3 * K + 3 * extra
        after = values[FORCE_SCALARS:]
        return values[:FORCE_SCALARS], pairs(after[: 2 * K]), after[2 * K : 3 * K], pairs(after[3 * K :], 3)

    def stop(self, reason):
        """Receives the last FORCE, sends STOP; returns it, and FAREWELL."""
        found = self.forces()
        self.send("STOP", {"reason": reason})
        return found, self.receive("FAREWELL")[1]
