"""The link: key files, the address of the continuum, and the other side."""

import contextlib
import errno
import math
import socket
import time
from collections.abc import Iterator
from importlib.metadata import version
from pathlib import Path

from colluvium.doctor.findings import LOOK, OK, WRONG, Finding
from coupler_protocol.exits import EnvironmentFailed
from coupler_protocol.wire import admission, gate_words, keys, link_tcp, passing
from coupler_protocol.wire.frames import one_line
from coupler_protocol.wire.messages import PROTOCOL_VERSION

TRIES = 3  # of which the fastest counts
AGREE = 2.0  # [s] by which two clocks may differ


def key_files(folder: Path, file: str | None) -> Iterator[Finding]:
    """Yields whether the keys of this user, and the key file of this machine, can be used; never a key."""
    try:
        if folder.exists():
            keys.private_folder(folder)
            found = keys.clients_of(folder)
            keys.server_keys(folder)
            for path in folder.glob("local.key"):
                keys.read_secret(path, {})
            revoked = sum(client.revoked for client in found)
            yield Finding(OK, "keys", f"{len(found) - revoked} valid and {revoked} revoked in {folder}, for this user only")
        else:
            yield Finding(
                OK, "keys", f"none in {folder}; a grid that takes discs of another machine needs one: colluvium keys new NAME"
            )
    except EnvironmentFailed as error:
        yield Finding(WRONG, "keys", str(error))
    if file is not None:
        try:
            yield Finding(OK, "key file", f"{file} is the key {keys.client_key(file).name!r}, for this user only")
        except EnvironmentFailed as error:
            yield Finding(WRONG, "key file", str(error))


def port(endpoint: str) -> Iterator[Finding]:
    """Yields whether the continuum could listen at an address of this machine."""
    try:
        host, number = link_tcp.host_and_port(endpoint)
        with contextlib.closing(link_tcp.listening_socket(host, number)):
            yield Finding(OK, "port", f"{endpoint} is free")
    except ValueError as error:
        yield Finding(WRONG, "port", f"{endpoint}: {error}", "for example tcp://0.0.0.0:5555")
    except OSError as error:
        if error.errno == errno.EADDRINUSE:
            yield Finding(LOOK, "port", f"{endpoint} is in use", "well if that is your continuum; otherwise choose another port")
        else:
            yield Finding(WRONG, "port", f"{endpoint} cannot be used: {error.strerror}", "name an address of this machine")


def other(endpoint: str, file: str | None, insecure: bool) -> Iterator[Finding]:
    """Yields whether a discrete process of this machine can reach and pass the continuum at an address, and what that is."""
    try:
        address = link_tcp.host_and_port(endpoint)
        addresses = sorted({str(row[4][0]) for row in socket.getaddrinfo(*address, type=socket.SOCK_STREAM)})
        ticket = _ticket(endpoint, file, insecure)
    except ValueError as error:
        yield Finding(WRONG, "other side", f"{endpoint}: {error}", "for example --other office.example:5555")
        return
    except OSError as error:
        yield Finding(
            WRONG, "other side", f"{address[0]} has no address ({error.strerror})", "check the name, or give the address"
        )
        return
    except EnvironmentFailed as error:
        yield Finding(WRONG, "other side", str(error))
        return
    yield Finding(OK, "other side", f"{address[0]} has the addresses {', '.join(addresses)}")
    try:
        yield from _passed(address, endpoint, ticket)
    except (OSError, passing.RefusedError, gate_words.ForeignError) as error:
        yield Finding(WRONG, "other side", passing.trouble(error, endpoint))


def _ticket(endpoint: str, file: str | None, insecure: bool) -> admission.Pass:
    """With what this side claims to pass; without a key it asks another machine as everybody can."""
    local = link_tcp.is_loopback(endpoint)
    return admission.pass_of(endpoint, local, file, insecure or not (local or file)) or admission.local_pass()


def _passed(address: tuple[str, int], endpoint: str, ticket: admission.Pass) -> Iterator[Finding]:
    """Yields what a continuum says that lets this side pass."""
    best, offsets = math.inf, []
    for _ in range(TRIES):
        before = time.time()
        found = passing.through(address, endpoint, ticket)
        found.connection.close()
        if found.to_answer < best:
            best, connect = found.to_answer, found.to_connect
            offsets = [found.about.time - before - found.to_connect - 0.5 * found.to_answer]
    name = f" with the key {ticket.curve.name!r}" if ticket.curve else ""
    yield Finding(OK, "other side", f"the continuum at {endpoint} lets this machine pass{name}")
    if ticket.kind == gate_words.OPEN:
        yield Finding(
            LOOK,
            "other side",
            "it was started with --insecure: everybody can take part",
            "use keys on a network that is not your own",
        )
    yield Finding(OK, "round trip", f"{1e3 * connect:.2f} ms to connect, {1e3 * best:.2f} ms for a question and its answer")
    package, own = one_line(found.about.package), version("colluvium")
    if (package, found.about.protocol) != (own, PROTOCOL_VERSION):
        text = f"colluvium {package}, protocol {found.about.protocol} there; {own}, {PROTOCOL_VERSION} here"
        yield Finding(WRONG, "version", text, "install the same version on both machines")
    else:
        yield Finding(OK, "version", f"colluvium {own}, protocol {PROTOCOL_VERSION} on both sides")
    offset = offsets[0]
    if not abs(offset) < AGREE:
        text = f"the clock there is {abs(offset):.0f} s {'ahead of' if offset > 0 else 'behind'} this one"
        yield Finding(LOOK, "clocks", text, "times in the logs do not fit together, results do not depend on them")
    else:
        yield Finding(OK, "clocks", f"they agree within {AGREE:g} s")
