"""Handshake, by which both sides agree that they compute the same scene: HELLO, then WELCOME or REJECT."""

import os
import secrets
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from collections.abc import Set as AbstractSet
from importlib.metadata import version
from typing import Any

import numpy as np

from coupler_protocol.exits import PeerLost
from coupler_protocol.problems import unfit
from coupler_protocol.scene.differences import both_values, first_difference
from coupler_protocol.scene.named_files import with_hashes_of, without_paths
from coupler_protocol.wire import frames, messages
from coupler_protocol.wire.frames import Buffer
from coupler_protocol.wire.lanes import Lanes, Peer
from coupler_protocol.wire.lockstep import MAX_HELLO, REASON, Conversation, Hub


def takes_lanes(scene: Any, transport: Any) -> bool:
    """Whether a side of `scene` sends its step messages over lanes: if the scene says so, by default on one machine."""
    return (
        os.name == "posix" and sys.byteorder == "little" and bool(transport.local if scene.link.lane is None else scene.link.lane)
    )


def _begins(resume: dict[str, Any] | None) -> str:
    """Text of the beginning of a side; `resume` is that key of HELLO."""
    if not isinstance(resume, dict):
        return "begins at the start"
    return f"goes on after stage {resume.get('after')!r} (session {resume.get('session')!r})"


def _objection(hello: dict[str, Any], scene: Any, resume: dict[str, Any] | None, proved: bool = True) -> str | None:
    """Reason for rejecting a HELLO, or None. proved: whether its sender may see values, and not only names of keys."""
    if hello["package"] != version("colluvium"):
        return f"versions differ: {both_values(hello['package'], version('colluvium'))}"
    if hello["float"] != "<f8":
        return f"number formats differ: {both_values(hello['float'], '<f8')}"
    ours = with_hashes_of(hello["scene"], scene.resolved())
    difference = first_difference(without_paths(hello["scene"]), without_paths(ours), values=proved)
    if difference:
        return f"the scenes differ: {difference}"
    theirs = hello.get("resume")
    if theirs != resume and not proved:
        return "one side begins elsewhere: one of them continues a run, or another one"
    if theirs != resume:
        return f"one side begins elsewhere: the discrete side {_begins(theirs)}, the continuum {_begins(resume)}"
    return None


def _wants_lane(hello: Mapping[str, Any], scene: Any, transport: Any) -> bool:
    """Whether a lane is to be opened: by default not through a relay or a tunnel, which lead to a port of their own."""
    return takes_lanes(scene, transport) and "lane" in hello and (bool(scene.link.lane) or hello["lane"] == transport.port)


def welcome_all(hub: Hub, scene: Any, rims: Mapping[int, np.ndarray], resume: dict[str, Any] | None = None) -> None:
    """Waits for HELLO of every rank and sends WELCOME with the nodes of its window's rim.

    rims: {rank: (K,2) positions [m], counter-clockwise}; resume: the key `resume` that HELLO must contain, or None. A HELLO that
    does not fit is answered with REJECT and the reason. Raises PeerLost if a rank is missing for longer than the clock for
    arrivals.
    """
    session = secrets.randbits(63) | 1
    missing = set(hub.conversations)
    lanes = Lanes(session, [Peer(rank, rank, len(xy)) for rank, xy in rims.items()], messages.FORCE, messages.VELOCITY)
    arrivals = Arrivals(hub)
    while missing:
        departed = [rank for rank in missing if hub.transport.departed(rank)]
        heard = hub.receive_hello()
        arrivals.check(missing, departed if heard is None else ())
        if heard is None:
            continue
        sender, rank, frame = heard
        objection = hub.objection(rank, hub.conversations.keys() - missing) or _heard_objection(
            frame, scene, resume, hub.transport.proves
        )
        if objection:
            hub.reject(sender, rank, objection)
            continue
        hub.transport.admit(sender, rank)
        arrivals.note(rank)
        missing.discard(rank)
        conversation = hub.conversations[rank]
        conversation.begin(session)
        content = {
            "session": session,
            "rim": frames.pack_array(rims[rank]),
            "dt": 1.0,
            "exchange_every": scene.coupling.exchange_every,
        }
        door = hub.transport.door() if _wants_lane(frames.content_of(frame), scene, hub.transport) else None
        conversation.send_control(messages.WELCOME, content | ({"lane": door.offer} if door else {}))
        if door and (connection := door.admit(hub.stop.check)):
            lanes.open(rank, connection)
    if lanes.any:
        hub.transport.lanes = lanes


class Arrivals:
    """Clock of the arrivals of all ranks, started again when one comes for the first time."""

    def __init__(self, hub: Hub) -> None:
        self.hub, self._come = hub, set[int]()
        self._begin, self._since = time.monotonic(), time.strftime("%H:%M:%S")

    def note(self, rank: int) -> None:
        """Starts the clock again; not for a process that takes the place of another one."""
        if rank not in self._come:
            self._come.add(rank)
            self._begin = time.monotonic()

    def check(self, missing: AbstractSet[int], departed: Sequence[int]) -> None:
        """Raises PeerLost if the clock has run out, or if a rank can no longer come. Tells those who came about the wait."""
        ranks, limit = " and ".join(map(str, sorted(missing))), self.hub.clocks.arrival
        words = "".join(f"; one of rank {r} ended: {said}" for r, said in self.hub.last_words.items() if r in missing)
        if departed:
            raise PeerLost(f"the discrete process of rank {departed[0]} ended before it joined the run{words}")
        if time.monotonic() - self._begin > limit:
            raise PeerLost(
                f"no discrete process of rank {ranks} came within {limit:g} s (link.arrival), since {self._since}{words}; check "
                f"that it was started with the address {self.hub.transport.endpoint}, its log, and the network"
            )
        self.hub.report(f"arrival: waits for rank {ranks}")


def _heard_objection(frame: Buffer, scene: Any, resume: dict[str, Any] | None, proved: bool) -> str | None:
    try:
        return _objection(frames.content_of(frame), scene, resume, proved)
    except frames.WireError as error:
        return str(error)


def resume_from(after: str, session: int) -> dict[str, Any]:
    """Key `resume` of HELLO: stage after which this side continues, and session of its checkpoint (0: it needs none)."""
    return {"after": after, "session": session}


def refuse_large(hello: Mapping[str, Any]) -> None:
    """Raises SceneError for a HELLO that the continuum would not read."""
    size = len(frames.control_frame(messages.HELLO, 0, 0, 0, hello))
    if size > MAX_HELLO:
        raise unfit("", f"it needs {size} bytes in HELLO, {MAX_HELLO} are allowed", "use files for long lists")


def join(
    conversation: Conversation, scene: Any, resume: dict[str, Any] | None = None, meanwhile: Iterator[object] | None = None
) -> np.ndarray:
    """Sends HELLO and waits for WELCOME; returns the positions (K,2) [m] of the rim's nodes. Raises PeerLost if rejected.

    meanwhile: work for the time without an answer, as for Conversation.receive.
    """
    hello = {"package": version("colluvium"), "float": "<f8", "scene": scene.resolved()}
    if takes_lanes(scene, conversation.transport):
        hello["lane"] = conversation.transport.port
    hello |= {} if resume is None else {"resume": resume}
    refuse_large(hello)
    conversation.send_control(messages.HELLO, hello)
    kind, frame = conversation.receive((messages.WELCOME, messages.REJECT), meanwhile=meanwhile)
    content = frames.content_of(frame)
    if kind == messages.REJECT:
        raise PeerLost(f"the continuum refused this process: {frames.one_line(content['reason'], REASON)}")
    if content["session"] == 0:
        raise PeerLost("the continuum gave no session")
    rim = frames.unpack_array(content["rim"], columns=2)
    if len(rim) < 3:
        raise PeerLost(f"the continuum sent a rim of {len(rim)} nodes")
    conversation.session = content["session"]
    if "lane" in content and (connection := conversation.transport.enter(content["lane"])):
        peer = Peer(conversation.peer, conversation.rank, len(rim))
        conversation.transport.lanes = Lanes(conversation.session, [peer], messages.VELOCITY, messages.FORCE)
        conversation.transport.lanes.open(conversation.peer, connection)
    return np.ascontiguousarray(rim)
