"""How a lane is opened: the continuum offers a port and a token in WELCOME, the discrete process comes through that door.

Both ends prove that they know the token (HMAC-SHA256 over a nonce of the other one, RFC 2104), so neither a stranger who finds
the port nor one who has taken it gets a lane. The door is open for seconds and for one connection; during steps nothing listens.
"""

import contextlib
import hmac
import secrets
import socket
import time
from collections.abc import Callable
from typing import Any

NONCE = PROOF = 32  # bytes
PATIENCE = 1.0  # [s] for one connection to prove itself
OPEN = 5.0  # [s] in which the other side must come


class Door:
    """A port at which one lane can be opened. place: an address of this machine, or a folder of this user for a Unix socket."""

    def __init__(self, place: str) -> None:
        self.token = secrets.token_bytes(NONCE)
        if "/" in place:
            port = secrets.randbelow(1 << 31)  # a name
            self.listener = socket.socket(socket.AF_UNIX)
            self.listener.bind(_path(place, port))
            self.listener.listen(1)
        else:
            family = socket.AF_INET6 if ":" in place else socket.AF_INET
            self.listener = socket.create_server((place, 0), family=family, backlog=4)
            port = self.listener.getsockname()[1]
        self.offer: dict[str, Any] = {"port": port, "token": self.token}  # content of WELCOME

    def admit(self, check: Callable[[], object], seconds: float = OPEN) -> socket.socket | None:
        """Waits for the other side; returns the connection, or None. Strangers are sent away. check(): of the stop request."""
        with self.listener:
            until = time.monotonic() + seconds
            while time.monotonic() < until:
                check()
                self.listener.settimeout(0.2)
                with contextlib.suppress(OSError):
                    connection, _ = self.listener.accept()
                    if _proved(connection, self.token, b"continuum", b"discs"):
                        return connection
                    connection.close()
        return None


def _path(folder: str, port: int) -> str:
    """Path of the Unix socket of a lane."""
    return f"{folder}/lane-{port}"


def enter(place: str, offer: dict[str, Any], seconds: float = OPEN) -> socket.socket | None:
    """Goes through the door of an offer; returns the connection, or None if there is no way or nobody who knows the token."""
    with contextlib.suppress(OSError, OverflowError):  # a port may be any number
        if "/" in place:
            connection = socket.socket(socket.AF_UNIX)
            connection.connect(_path(place, offer["port"]))
        else:
            connection = socket.create_connection((place, offer["port"]), timeout=seconds)
        if _proved(connection, offer["token"], b"discs", b"continuum"):
            return connection
        connection.close()
    return None


def _proved(connection: socket.socket, token: bytes, own: bytes, other: bytes) -> bool:
    """Whether the other end knows the token; tells it that this end does."""
    try:
        connection.settimeout(PATIENCE)
        mine = secrets.token_bytes(NONCE)
        connection.sendall(mine)
        theirs = _exactly(connection, NONCE)
        connection.sendall(hmac.digest(token, own + theirs, "sha256"))
        return hmac.compare_digest(_exactly(connection, PROOF), hmac.digest(token, other + mine, "sha256"))
    except OSError:
        return False


def _exactly(connection: socket.socket, size: int) -> bytes:
    """The next `size` bytes; raises OSError if they do not come in time."""
    found = b""
    until = time.monotonic() + PATIENCE
    while len(found) < size:
        part = connection.recv(size - len(found))
        if not part or time.monotonic() > until:
            raise OSError("no proof")
        found += part
    return found
