"""What both ends of a connection say at the gate of a continuum, before anything else: three messages of fixed size.

    continuum  GREETING   kind of gate, number of the continuum's key, a nonce
    discs      CLAIM      the same from the other side, the client's public key, a nonce, and the proof
    continuum  VERDICT    WELCOME with the proof of the continuum, or why not

A proof is the HMAC-SHA256 (RFC 2104) of all that was said before on this connection, and the role of who says it, with the secret
that both have. So no end needs to believe the other, and what one end heard is of no use on another connection.
"""

import hashlib
import hmac
import struct
import time
from functools import cache
from importlib.metadata import version
from typing import NamedTuple

from coupler_protocol.wire.messages import PROTOCOL_VERSION

MAGIC, VERSION = b"CLVMGATE", 1
GREETING = struct.Struct("<8sBB6x16s32s")  # magic, version, kind of gate, number of a key, nonce
CLAIM = struct.Struct("<8sBB6x16s32s32s32s")  # magic, version, kind, number of the expected key, public key, nonce, proof
VERDICT = struct.Struct(
    "<8sBBH4xd16s32s"
)  # magic, version, verdict, version of the protocol, time, version of the package, proof
NONCE = PROOF = PUBLIC = 32  # bytes

OPEN, LOCAL, KEYED = range(3)  # kinds of gates: for everybody, for processes of one user, for clients with a key
KINDS = ("takes everybody (--insecure)", "takes processes of its own user on its own machine", "takes clients with a key")
WELCOME, UNKNOWN, REVOKED, UNPROVED, OTHER_KIND, OTHER_SERVER, FULL = range(7)  # verdicts

FOREIGN = "it does not speak as colluvium does"


class Claim(NamedTuple):
    """CLAIM as heard."""

    kind: int
    server: bytes  # number of the key that the client expects
    public: bytes  # of the client; zeros without CURVE
    data: bytes  # all of it


class About(NamedTuple):
    """What VERDICT tells to who may pass: versions of protocol and package, and the time [s] since 1970 there (UTC)."""

    protocol: int
    package: str
    time: float


class ForeignError(ValueError):
    """Bytes that are not what is expected here, or of another version."""


def number_of(public: bytes) -> bytes:
    """Number (16 bytes) by which a public CURVE key is recognised."""
    return hashlib.blake2b(public, digest_size=16).digest()


def greeting(kind: int, server: bytes, nonce: bytes) -> bytes:
    """GREETING; server: number of the continuum's key, zeros without."""
    return GREETING.pack(MAGIC, VERSION, kind, server, nonce)


def read_greeting(data: bytes) -> tuple[int, bytes]:
    """(kind of gate, number of the continuum's key); raises ForeignError."""
    magic, version, kind, server, _ = GREETING.unpack(data)
    _check(magic, version)
    if kind >= len(KINDS):
        raise ForeignError(FOREIGN)
    return kind, server


def _check(magic: bytes, version: int) -> None:
    if magic != MAGIC:
        raise ForeignError(FOREIGN)
    if version != VERSION:
        raise ForeignError(f"its gate has version {version}, not {VERSION}")


def claim(heard: bytes, kind: int, server: bytes, public: bytes, nonce: bytes, secret: bytes) -> bytes:
    """CLAIM in answer to a GREETING."""
    said = CLAIM.pack(MAGIC, VERSION, kind, server, public, nonce, b"")[:-PROOF]
    return said + _proof(secret, b"discs", heard, said)


def read_claim(data: bytes) -> Claim:
    """The CLAIM in these bytes; raises ForeignError."""
    magic, version, kind, server, public, _, _ = CLAIM.unpack(data)
    _check(magic, version)
    return Claim(kind, server, public, data)


def proves(secret: bytes, greeted: bytes, heard: Claim) -> bool:
    """Whether the CLAIM that followed a GREETING was made with this secret."""
    return hmac.compare_digest(heard.data[-PROOF:], _proof(secret, b"discs", greeted, heard.data[:-PROOF]))


def verdict(what: int, greeted: bytes, heard: Claim, secret: bytes | None) -> bytes:
    """VERDICT; its proof is zeros if no secret is known. Who may not pass learns neither versions nor time."""
    told = (PROTOCOL_VERSION, time.time(), _package()) if what == WELCOME else (0, 0.0, b"")
    said = VERDICT.pack(MAGIC, VERSION, what, *told, b"")[:-PROOF]
    return said + (bytes(PROOF) if secret is None else _proof(secret, b"continuum", greeted, heard.data + said))


def read_verdict(data: bytes, heard: bytes, claimed: bytes, secret: bytes) -> tuple[int, bool]:
    """(verdict, whether the continuum has proved itself); raises ForeignError."""
    magic, version, what, *_, proof = VERDICT.unpack(data)
    _check(magic, version)
    return what, hmac.compare_digest(proof, _proof(secret, b"continuum", heard, claimed + data[:-PROOF]))


@cache
def _package() -> bytes:
    """Version of the package, for a field of 16 bytes."""
    return version("colluvium").encode()[:16]


def about(data: bytes) -> About:
    """What a VERDICT tells about the continuum."""
    _, _, _, protocol, when, package, _ = VERDICT.unpack(data)
    return About(protocol, package.rstrip(b"\0").decode("ascii", "replace"), when)


def _proof(secret: bytes, role: bytes, heard: bytes, said: bytes) -> bytes:
    return hmac.digest(secret, role + heard + said, "sha256")
