"""Strangers at the gate of a continuum, in a process of their own: `python strangers.py NAME PORT` until standard input closes.

Prints a line each of the first ENOUGH times it has done what its name says. Some need a gate for everybody (--insecure): they
pass it as a discrete process does and then speak ZMTP 3.1.
"""

import contextlib
import itertools
import os
import random
import resource
import select
import socket
import struct
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from coupler_protocol.wire import frames, gate_words
from coupler_protocol.wire.messages import HELLO

GREETING = b"\xff" + bytes(8) + b"\x7f\x03\x01" + b"NULL".ljust(20, b"\0") + bytes(32)
READY = b"\x05READY\x0bSocket-Type" + struct.pack(">I", 6) + b"DEALER" + b"\x08Identity" + struct.pack(">I", 0)
MANY = 1500
ENOUGH = 3  # times, after which a siege says something
HOST = "127.0.0.1"


def going_on():
    """Whether standard input is still open."""
    return not select.select([0], [], [], 0)[0]


def acts():
    """Prints a line for each of the first ENOUGH acts."""
    for act in itertools.count():
        if act < ENOUGH:
            print("acted", flush=True)
        yield


ACTED = acts()


def connected(port):
    """A connection that does not wait; the gate may close it at any time."""
    connection = socket.socket()
    connection.setblocking(False)
    with contextlib.suppress(BlockingIOError):
        connection.connect((HOST, port))
    return connection


def framed(content, flags=0):
    """A frame of ZMTP."""
    return struct.pack(">BQ", flags | 2, len(content)) + content


def inside(port):
    """A connection that has passed a gate for everybody and the handshake of ZMTP; raises OSError."""
    connection = socket.create_connection((HOST, port), timeout=2.0)
    heard = connection.recv(gate_words.GREETING.size, socket.MSG_WAITALL)
    nonce = os.urandom(gate_words.NONCE)
    connection.sendall(gate_words.claim(heard, gate_words.OPEN, bytes(16), bytes(32), nonce, b""))
    verdict = connection.recv(gate_words.VERDICT.size, socket.MSG_WAITALL)
    if gate_words.VERDICT.unpack(verdict.ljust(gate_words.VERDICT.size))[2] != gate_words.WELCOME:
        connection.close()
        raise ConnectionError
    connection.sendall(GREETING + framed(READY, 4))
    return connection


def crowd(port, keep, speak):
    """Makes connections all the time, keeps the last `keep` of them and calls speak(connection) on each now and then."""
    held = []
    while going_on():
        for _ in range(50):
            held.append(connected(port))
            if len(held) > keep:
                held.pop(random.randrange(len(held))).close()
        next(ACTED)
        for connection in random.sample(held, min(100, len(held))):
            with contextlib.suppress(OSError):
                speak(connection)
        time.sleep(0.01)


def half_open(port):
    """Connections that never say anything."""
    crowd(port, MANY, lambda connection: None)


def slow_loris(port):
    """Connections that say the right beginning, one byte at a time."""
    crowd(port, MANY, lambda connection: connection.send(b"C"))


def garbage(port):
    """Bytes of no protocol, on many connections."""
    crowd(port, 20, lambda connection: connection.send(os.urandom(1000)))


def zeromq(port):
    """Greetings of ZeroMQ without a claim, as from another program or an older version."""
    crowd(port, 20, lambda connection: connection.send(GREETING))


def claims(port):
    """Whole claims that prove nothing."""
    claim = gate_words.claim(bytes(gate_words.GREETING.size), gate_words.LOCAL, bytes(16), bytes(32), bytes(32), b"guessed")
    crowd(port, 20, lambda connection: connection.send(claim))


def repeated(port, work):
    """Calls work(connection inside) until the connection is closed, on one connection after the other."""
    while going_on():
        with contextlib.suppress(OSError):
            connection = inside(port)
            connection.settimeout(0.5)
            with connection:
                while going_on():
                    next(ACTED)
                    work(connection)


def finished(port):
    """Connections that have passed everything and say nothing more."""
    held = []
    while going_on():
        with contextlib.suppress(OSError):
            held.append(inside(port))
            next(ACTED)
        del held[:-MANY]


def messages(port):
    """10,000 small messages of garbage a second on each connection."""
    piece = framed(b"x" * 50) * 100
    repeated(port, lambda connection: (connection.sendall(piece), time.sleep(0.01)))


def few_messages(port):
    """Messages of garbage, as many as a connection may send before it is closed, on new connections all the time."""
    piece = framed(b"x" * 50) * 30
    while going_on():
        with contextlib.suppress(OSError), inside(port) as connection:
            next(ACTED)
            connection.sendall(piece)


def parts(port):
    """One message of endless parts."""
    piece = framed(b"", 1) * 10 + framed(b"x" * 255, 1) * 100
    repeated(port, lambda connection: connection.sendall(piece))


def large(port):
    """Frames of 63 MiB."""
    frame = framed(bytes(63 << 20))
    repeated(port, lambda connection: connection.sendall(frame))


def almost_large(port):
    """Frames of 4 MiB less a little, of which the last byte never comes, on as many connections as there may be."""
    held, frame = [], framed(bytes((4 << 20) - 100))[:-1]
    while going_on():
        with contextlib.suppress(OSError):
            connection = inside(port)
            held.append(connection)
            next(ACTED)
            connection.settimeout(0.1)
            connection.sendall(frame)


def hellos(port):
    """Valid HELLOs, 1,000 a second."""
    hello = framed(bytes(frames.control_frame(HELLO, 0, 1, 0, {"package": "0\n\x1b[31m", "float": "<f8", "scene": {}})))
    repeated(port, lambda connection: (connection.sendall(hello), time.sleep(0.001)))


if __name__ == "__main__":
    limit = resource.getrlimit(resource.RLIMIT_NOFILE)[1]
    resource.setrlimit(resource.RLIMIT_NOFILE, (min(4096, limit), limit))
    globals()[sys.argv[1]](int(sys.argv[2]))
    os._exit(0)
