"""Who may pass the gate of a continuum, and with what a discrete process claims to pass it: three kinds on either side.

    kind     by default for            secret of the gate             link behind it
    LOCAL    loopback addresses        of this user (local.key)       plain
    KEYED    all other addresses       of each client                 CURVE
    OPEN     none (--insecure)         none                           plain

A rule of the continuum has `kind`, `number` (of its CURVE key), `judge(claim, greeting)` and `revoked(public)`; a pass of the
discrete side has `kind`, `number` (of the key it expects), `public` and `secret`.
"""

from pathlib import Path
from typing import Any, NamedTuple

from zmq.utils import z85

from coupler_protocol.exits import EnvironmentFailed
from coupler_protocol.wire import gate_words as words
from coupler_protocol.wire import keys

NONE = bytes(words.PUBLIC)
NO_NUMBER = bytes(16)
JOINED = "of this run"  # name of a client that knows its session


class Judged(NamedTuple):
    """Verdict on a claim; secret with which it is signed, if there is one; name of the client."""

    verdict: int
    secret: bytes | None = None
    name: str = ""


class SecretRule:
    """Admits processes that know one secret; with an empty one all processes, which is the kind OPEN.

    sessions: of the run, as bytes. Who proves to know one has joined the run before, and is no stranger at a gate for everybody.
    """

    number = NO_NUMBER
    curve: keys.ServerKeys | None = None

    def __init__(self, kind: int, secret: bytes) -> None:
        self.kind, self.secret = kind, secret
        self.sessions: list[bytes] = []

    def judge(self, claim: words.Claim, greeting: bytes) -> Judged:
        """Verdict on a claim."""
        if claim.kind != self.kind:
            return Judged(words.OTHER_KIND)
        for secret in self.sessions:
            if words.proves(secret, greeting, claim):
                return Judged(words.WELCOME, secret, JOINED)
        if not words.proves(self.secret, greeting, claim):
            return Judged(words.UNPROVED)
        return Judged(words.WELCOME, self.secret)

    def revoked(self, public: bytes) -> bool:
        """No secret of this kind is revoked while a continuum runs."""
        return False


class KeyRule:
    """Admits clients whose keys are in the key folder, which is read at every claim."""

    kind = words.KEYED

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        curve = keys.server_keys(folder)
        if curve is None or not any(not client.revoked for client in keys.clients_of(folder)):
            raise EnvironmentFailed(
                f"there are no keys in {folder}: make one for each other machine with `colluvium keys new NAME`"
            )
        self.curve: keys.ServerKeys | None = curve
        self.number = words.number_of(curve.public)

    def client(self, public: bytes) -> keys.Client | None:
        """The client with this public key (32 bytes)."""
        return next((client for client in keys.clients_of(self.folder) if z85.decode(client.public) == public), None)

    def judge(self, claim: words.Claim, greeting: bytes) -> Judged:
        """Verdict on a claim."""
        if claim.kind != self.kind:
            return Judged(words.OTHER_KIND)
        if claim.server != self.number:
            return Judged(words.OTHER_SERVER)
        client = self.client(claim.public)
        if client is None:
            return Judged(words.UNKNOWN)
        if not words.proves(client.gate, greeting, claim):
            return Judged(words.UNPROVED)
        return Judged(words.REVOKED if client.revoked else words.WELCOME, client.gate, client.name)

    def revoked(self, public: bytes) -> bool:
        """Whether a client that passed is not on the list any more."""
        client = self.client(public)
        return client is None or client.revoked


Rule = SecretRule | KeyRule


class Pass(NamedTuple):
    """With what a discrete process claims to pass; curve: keys of the client. where: file of the keys, for messages."""

    kind: int
    secret: bytes
    number: bytes = NO_NUMBER
    public: bytes = NONE
    curve: keys.ClientKey | None = None
    where: Any = ""


def local_rule() -> Rule:
    """Admits processes of this user on this machine."""
    return SecretRule(words.LOCAL, keys.local_secret(keys.folder_of()))


def rule_of(endpoint: str, loopback: bool, folder: str | Path | None, insecure: bool) -> Rule:
    """Rule of a continuum by its options: folder: of keys, if one is named. Raises EnvironmentFailed if there are no keys."""
    if insecure:
        return SecretRule(words.OPEN, b"")
    if loopback and folder is None:
        return local_rule()
    try:
        return KeyRule(keys.folder_of(folder))
    except EnvironmentFailed as error:
        if loopback:
            raise
        raise EnvironmentFailed(
            f"{endpoint} can be reached from other machines: {error}, or use --insecure if the network is your own"
        ) from None


def local_pass() -> Pass:
    """Pass of a process of the continuum's user on the same machine."""
    return Pass(words.LOCAL, keys.local_secret(keys.folder_of()))


def pass_of(endpoint: str, loopback: bool, file: str | Path | None, insecure: bool) -> Pass | None:
    """Pass of a discrete process by its options; file: of its keys, if one is named. None for the default on loopback."""
    if file is not None:
        own = keys.client_key(file)
        return Pass(words.KEYED, own.gate, words.number_of(own.server), z85.decode(own.public), own, file)
    if insecure:
        return Pass(words.OPEN, b"")
    if loopback:
        return None
    raise EnvironmentFailed(
        f"{endpoint} is another machine: name the key file of this one with --key FILE "
        f"(made there with `colluvium keys new NAME`), or use --insecure if the network is your own"
    )
