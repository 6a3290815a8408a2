"""How both sides find out that they compute the same thing: HELLO, then WELCOME or REJECT."""

import secrets
from importlib.metadata import version

import numpy as np

from coupler_protocol import messages, wire
from coupler_protocol.exits import PeerLost


def first_difference(a, b, path=""):
    """The first key at which two resolved scenes differ, with both values; None when they are the same."""
    if isinstance(a, dict) and isinstance(b, dict):
        for key in sorted(a.keys() | b.keys()):
            if key not in a or key not in b:
                return f"{path}{key}: only one side has it"
            found = first_difference(a[key], b[key], f"{path}{key}.")
            if found:
                return found
        return None
    if isinstance(a, list) and isinstance(b, list) and len(a) == len(b):
        for i, (x, y) in enumerate(zip(a, b, strict=True)):
            found = first_difference(x, y, f"{path}{i}.")
            if found:
                return found
        return None
    return None if a == b else f"{path.rstrip('.')}: {a!r} there, {b!r} here"


def _objection(hello, scene, rank, conversations, taken):
    """Why a HELLO cannot be accepted, or None."""
    if rank not in conversations:
        return f"the scene has ranks {sorted(conversations)}, not {rank}"
    if rank in taken:
        return f"rank {rank} is taken and its holder lives"
    if hello.get("package") != version("colluvium"):
        return f"version {hello.get('package')} there, {version('colluvium')} here"
    if hello.get("float") != "<f8":
        return f"number format {hello.get('float')!r}, not '<f8'"
    difference = first_difference(hello.get("scene"), scene.resolved())
    return f"the scenes differ: {difference}" if difference else None


def welcome_all(hub, scene, rims):
    """Wait until every rank has said HELLO and send each its WELCOME with the nodes of its window's rim.

    rims: {rank: (K,2) positions [m], counter-clockwise}. A HELLO that does not fit is answered with REJECT and its reason.
    """
    session = secrets.randbits(63) | 1
    taken = set()
    while taken != set(hub.conversations):
        heard = hub.hear_next((messages.HELLO,))
        if heard is None:
            continue
        sender, rank, frame = heard
        hello = wire.content_of(frame)
        objection = _objection(hello, scene, rank, hub.conversations, taken)
        if objection:
            hub.transport.send(wire.control_frame(messages.REJECT, 0, rank, 0, {"reason": objection}), sender)
            continue
        hub.transport.admit(sender, rank)
        taken.add(rank)
        conversation = hub.conversations[rank]
        conversation.session = session
        conversation.say_control(
            messages.WELCOME,
            {"session": session, "rim": wire.pack_array(rims[rank]), "dt": 1.0, "exchange_every": 1},
        )
        conversation.sequence += 1


def join(conversation, scene):
    """Say HELLO and wait for the WELCOME; returns the positions (K,2) [m] of the rim's nodes. Raises PeerLost if rejected."""
    conversation.say_control(
        messages.HELLO,
        {"package": version("colluvium"), "float": "<f8", "scene": scene.resolved()},
    )
    kind, frame = conversation.hear((messages.WELCOME, messages.REJECT))
    content = wire.content_of(frame)
    if kind == messages.REJECT:
        raise PeerLost(f"the continuum refused this process: {content.get('reason')}")
    conversation.session = content["session"]
    conversation.sequence += 1
    rim = wire.unpack_array(content["rim"], columns=2)
    return np.ascontiguousarray(rim)
