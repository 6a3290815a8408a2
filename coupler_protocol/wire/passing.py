"""How a discrete process passes the gate of a continuum, or why it does not, in words."""

import secrets
import socket
import time
from typing import NamedTuple

from coupler_protocol.wire import gate_words as words
from coupler_protocol.wire.admission import Pass

PATIENCE = 2.0  # [s] for the gate to be reached, and for each of its answers


class RefusedError(Exception):
    """A refusal that trying again does not change; the text says what to do. proved: the continuum itself has refused."""

    def __init__(self, text: str, proved: bool = False) -> None:
        super().__init__(text)
        self.proved = proved


class Passed(NamedTuple):
    """A connection that has passed; seconds to connect, and from claim to verdict; what the continuum told about itself."""

    connection: socket.socket
    to_connect: float
    to_answer: float
    about: words.About


def through(address: tuple[str, int], endpoint: str, own: Pass) -> Passed:
    """A connection that has passed the gate at an address; raises OSError, ForeignError, RefusedError.

    endpoint: name of the address for messages.
    """
    begin = time.perf_counter()
    connection = socket.create_connection(address, PATIENCE)
    to_connect = time.perf_counter() - begin
    try:
        heard = _exactly(connection, words.GREETING.size)
        kind, number = words.read_greeting(heard)
        said = words.claim(heard, own.kind, own.number, own.public, secrets.token_bytes(words.NONCE), own.secret)
        begin = time.perf_counter()
        connection.sendall(said)
        if kind != own.kind:
            raise RefusedError(_other_kind(kind, endpoint, own))
        if number != own.number:
            raise RefusedError(
                f"the continuum at {endpoint} has another key than {own.where} expects: the address is wrong, "
                f"another program has taken its port, or its keys were made again (then make a new key for this machine)"
            )
        answer = _exactly(connection, words.VERDICT.size)
        to_answer = time.perf_counter() - begin
        verdict, proved = words.read_verdict(answer, heard, said, own.secret)
        if verdict != words.WELCOME:
            text = _refusal(verdict, endpoint, own)
            raise RefusedError(text, proved) if verdict != words.FULL else OSError(text)
        if not proved:
            raise RefusedError(f"the program at {endpoint} does not know the secret of this side: it is not the continuum")
    except BaseException:
        connection.close()
        raise
    return Passed(connection, to_connect, to_answer, words.about(answer))


def trouble(error: Exception, endpoint: str) -> str:
    """Why there is no connection, in words, from what `through` raised."""
    if isinstance(error, RefusedError):
        return str(error)
    if isinstance(error, words.ForeignError):
        return f"the program at {endpoint} is not a continuum of this version: {error}; check address and version"
    if isinstance(error, ConnectionRefusedError):
        return f"no program listens at {endpoint}: check that the continuum was started, the address, and the firewall"
    if isinstance(error, TimeoutError):
        return f"the machine or program at {endpoint} does not answer: check the address and the firewall"
    return f"no connection with {endpoint}: {getattr(error, 'strerror', None) or error}"


def _other_kind(kind: int, where: str, own: Pass) -> str:
    if kind == words.KEYED:
        return f"the continuum at {where} takes clients with a key only: name the key file of this machine with --key FILE"
    if own.kind == words.KEYED:
        return f"the continuum at {where} was started without keys: start it with --keys, or this side without --key"
    if kind == words.OPEN:
        return f"the continuum at {where} was started with --insecure: start this side with --insecure as well"
    return f"the continuum at {where} takes processes of its own user only: start both sides without --insecure, or with keys"


def _refusal(verdict: int, where: str, own: Pass) -> str:
    """Why the continuum refused this process, in words."""
    keys = own.curve
    key = f"the key {keys.name!r} of {own.where}" if keys else "this process"
    return {
        words.UNKNOWN: f"the continuum at {where} does not know {key}: make a key there with `colluvium keys new NAME`",
        words.REVOKED: f"the continuum at {where} has revoked {key}: ask its user for a new one",
        words.UNPROVED: f"the continuum at {where} refused {key}: it has another secret. "
        + ("Copy the key file again" if keys else "The continuum belongs to another user of this machine: use keys"),
        words.FULL: f"the continuum at {where} has too many connections",
    }.get(verdict, f"the continuum at {where} refused {key}")


def _exactly(connection: socket.socket, size: int) -> bytes:
    """The next `size` bytes; raises ForeignError if their begin is foreign, OSError if they do not come in time."""
    found = b""
    until = time.monotonic() + PATIENCE
    while len(found) < size:
        part = connection.recv(size - len(found))
        if time.monotonic() > until:
            raise TimeoutError
        if not part:
            raise ConnectionError("it closed the connection")
        found += part
        if not words.MAGIC.startswith(found[: len(words.MAGIC)]):
            raise words.ForeignError(words.FOREIGN)
    return found
