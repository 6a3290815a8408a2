"""Handshake, by which both sides agree that they compute the same scene: HELLO, then WELCOME or REJECT."""

import os
import secrets
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from collections.abc import Set as AbstractSet
from functools import cache
from importlib import metadata
from typing import Any, NamedTuple

import numpy as np

from coupler_protocol.exits import PeerLost
from coupler_protocol.problems import unfit
from coupler_protocol.scene import run_number
from coupler_protocol.scene.differences import both_values, first_difference
from coupler_protocol.scene.moments import Moment, as_texts, newest_common
from coupler_protocol.scene.named_files import that_computes, with_hashes_of
from coupler_protocol.wire import frames, messages
from coupler_protocol.wire.clocks import ARRIVAL, Waiting
from coupler_protocol.wire.frames import Buffer
from coupler_protocol.wire.lanes import Lanes, Peer
from coupler_protocol.wire.lockstep import MAX_HELLO, REASON, Conversation, Hub

version = cache(metadata.version)  # read once: reading it costs more than all else that a stranger's HELLO asks for


def takes_lanes(scene: Any, transport: Any) -> bool:
    """Whether a side of `scene` sends its step messages over lanes: if the scene says so, by default on one machine."""
    return (
        os.name == "posix" and sys.byteorder == "little" and bool(transport.local if scene.link.lane is None else scene.link.lane)
    )


class Choice(NamedTuple):
    """Moments from which the continuum can continue; needs(moment): whether the discs must have it, because they existed then.

    run: number of the run that it continues, or of a new one; 0: a new one is drawn.
    """

    own: Sequence[Moment] = ()
    needs: Callable[[Moment], bool] = lambda moment: True
    run: int = 0

    def objection(self, theirs: Sequence[Moment], scene: Any) -> str | None:
        """Reason why nothing can be continued with a discrete process that has the moments `theirs`, or None."""
        known = {moment.session for moment in self.own}
        if not self.own and not theirs:
            return None
        if newest_common(self.own, [theirs], self.needs) and (not theirs or any(moment.session in known for moment in theirs)):
            return None
        return (
            f"one side begins elsewhere: the discrete side has saved {as_texts(theirs, scene)}, the continuum "
            f"{as_texts(self.own, scene)}, and no moment of the same run: give both sides the folders of one run, or use --force"
        )


def moments_of(hello: Mapping[str, Any]) -> list[Moment]:
    """Moments in a HELLO."""
    return [Moment(row["session"], row["stage"], row["step"]) for row in hello.get("checkpoints", ())]


def _objection(hello: dict[str, Any], scene: Any, choice: Choice, proved: bool = True) -> str | None:
    """Reason for rejecting a HELLO, or None. proved: whether its sender may see values, and not only names of keys."""
    if hello["package"] != version("colluvium"):
        return f"versions differ: {both_values(hello['package'], version('colluvium'))}"
    if hello["float"] != "<f8":
        return f"number formats differ: {both_values(hello['float'], '<f8')}"
    ours = with_hashes_of(hello["scene"], scene.resolved())
    difference = first_difference(that_computes(hello["scene"]), that_computes(ours), values=proved)
    if difference:
        return f"the scenes differ: {difference}"
    objection = choice.objection(moments_of(hello), scene)
    if objection and not proved:
        return "one side begins elsewhere: one of them continues a run, or another one"
    return objection


def _wants_lane(hello: Mapping[str, Any], scene: Any, transport: Any) -> bool:
    """Whether a lane is to be opened: by default not through a relay or a tunnel, which lead to a port of their own."""
    return takes_lanes(scene, transport) and "lane" in hello and (bool(scene.link.lane) or hello["lane"] == transport.port)


def welcome_all(
    hub: Hub,
    scene: Any,
    rims: Mapping[int, np.ndarray],
    choice: Choice | None = None,
    surfaces: Mapping[int, np.ndarray] | None = None,
) -> Moment | None:
    """Waits for HELLO of every rank, then sends WELCOME with the nodes of its window's rim; returns the moment to continue from.

    rims: {rank: (K,2) positions [m], counter-clockwise}; choice: of moments, by default none; surfaces: {rank: (S,2) points [m]
    of the ground surface between the last and the first node} of windows that reach it. A HELLO that does not fit is answered
    with REJECT and the reason. Raises PeerLost if a rank is missing for longer than the clock for arrivals.
    """
    choice = choice or Choice()
    choice = choice._replace(run=choice.run or run_number.new())
    session = secrets.randbits(63) | 1
    heard: dict[int, dict[str, Any]] = {}

    def surface_of(rank: int) -> dict[str, Any]:
        return {"surface": frames.pack_array(surfaces[rank])} if surfaces and rank in surfaces else {}

    lanes = Lanes(session, [Peer(rank, rank, len(xy)) for rank, xy in rims.items()], messages.FORCE, messages.VELOCITY)
    arrivals = Arrivals(hub)
    while missing := hub.conversations.keys() - heard.keys():
        departed = [rank for rank in missing if hub.transport.departed(rank)]
        received = hub.receive_hello()
        arrivals.check(missing, departed if received is None else ())
        if received is None:
            continue
        sender, rank, frame = received
        objection = hub.objection(rank, heard.keys()) or _heard_objection(frame, scene, choice, hub.transport.proves)
        if objection:
            hub.reject(sender, rank, objection)
            continue
        hub.transport.admit(sender, rank)
        arrivals.note(rank)
        heard[rank] = frames.content_of(frame)
        if not choice.own:  # else the moment depends on all ranks
            agreed = {"session": session, "run": choice.run} | surface_of(rank)
            _welcome(hub, scene, rank, heard[rank], rims[rank], lanes, agreed)
    hub.arrival = None
    begin = newest_common(choice.own, [moments_of(hello) for hello in heard.values()], choice.needs)
    if begin is None and choice.own:
        raise PeerLost("the discrete processes have no common checkpoint: use --force on all sides")
    for rank, hello in heard.items() if choice.own else ():
        agreed = {"session": session, "run": choice.run} | ({"resume": begin._asdict()} if begin is not None else {})
        _welcome(hub, scene, rank, hello, rims[rank], lanes, agreed | surface_of(rank))
    if lanes.any:
        hub.transport.lanes = lanes
    return begin


def _welcome(
    hub: Hub, scene: Any, rank: int, hello: Mapping[str, Any], rim: np.ndarray, lanes: Lanes, agreed: Mapping[str, Any]
) -> None:
    """Answers the HELLO of a rank with WELCOME, and opens its lane. agreed: the entries that all ranks get."""
    conversation = hub.conversations[rank]
    conversation.begin(agreed["session"])
    content = {**agreed, "rim": frames.pack_array(rim), "dt": 1.0, "exchange_every": scene.coupling.exchange_every}
    door = hub.transport.door() if _wants_lane(hello, scene, hub.transport) else None
    conversation.send_control(messages.WELCOME, content | ({"lane": door.offer} if door else {}))
    if door and (connection := door.admit(hub.stop.check)):
        lanes.open(rank, connection)


class Arrivals:
    """Clock of the arrivals of all ranks, started again when one comes for the first time."""

    def __init__(self, hub: Hub) -> None:
        self.hub, self._come = hub, set[int]()
        self._begin, self._since, self._at = time.monotonic(), time.strftime("%H:%M:%S"), time.time()

    def note(self, rank: int) -> None:
        """Starts the clock again; not for a process that takes the place of another one."""
        if rank not in self._come:
            self._come.add(rank)
            self._begin = time.monotonic()

    def check(self, missing: AbstractSet[int], departed: Sequence[int]) -> None:
        """Raises PeerLost if the clock has run out, or if a rank can no longer come. Tells those who came about the wait."""
        ranks, limit = " and ".join(map(str, sorted(missing))), self.hub.clocks.arrival
        self.hub.arrival = Waiting(f"the discrete process of rank {ranks}", ARRIVAL.name, "HELLO", self._at, "")
        words = "".join(f"; one of rank {r} ended: {said}" for r, said in self.hub.last_words.items() if r in missing)
        if departed:
            raise PeerLost(f"the discrete process of rank {departed[0]} ended before it joined the run{words}")
        if time.monotonic() - self._begin > limit:
            raise PeerLost(
                f"no discrete process of rank {ranks} came within {limit:g} s (link.arrival), since {self._since}{words}; check "
                f"that it was started with the address {self.hub.transport.endpoint}, its log, and the network"
            )
        self.hub.report(f"arrival: waits for rank {ranks}")


def _heard_objection(frame: Buffer, scene: Any, choice: Choice, proved: bool) -> str | None:
    try:
        return _objection(frames.content_of(frame), scene, choice, proved)
    except frames.WireError as error:
        return str(error)


def refuse_large(hello: Mapping[str, Any]) -> None:
    """Raises SceneError for a HELLO that the continuum would not read."""
    size = len(frames.control_frame(messages.HELLO, 0, 0, 0, hello))
    if size > MAX_HELLO:
        raise unfit("", f"it needs {size} bytes in HELLO, {MAX_HELLO} are allowed", "use files for long lists")


class Joined(NamedTuple):
    """Content of WELCOME: positions (K,2) [m] of the rim's nodes, moment to continue from, number of the run.

    surface (S,2) [m]: of a window that reaches the ground surface, its points between the last and the first node.
    """

    rim: np.ndarray
    moment: Moment | None
    run: int
    surface: np.ndarray | None = None


def join(conversation: Conversation, scene: Any, own: Iterable[Moment] = (), meanwhile: Iterator[object] | None = None) -> Joined:
    """Sends HELLO and waits for WELCOME.

    own: moments of which this side has checkpoints; meanwhile: work for the time without an answer, as for Conversation.receive.
    Raises PeerLost if rejected.
    """
    hello = {"package": version("colluvium"), "float": "<f8", "scene": scene.resolved()}
    if takes_lanes(scene, conversation.transport):
        hello["lane"] = conversation.transport.port
    saved = [moment._asdict() for moment in own]
    hello |= {"checkpoints": saved} if saved else {}
    refuse_large(hello)
    conversation.send_control(messages.HELLO, hello)
    kind, frame = conversation.receive((messages.WELCOME, messages.REJECT), meanwhile=meanwhile)
    content = frames.content_of(frame)
    if kind == messages.REJECT:
        raise PeerLost(f"the continuum refused this process: {frames.one_line(content['reason'], REASON)}")
    if content["session"] == 0:
        raise PeerLost("the continuum gave no session")
    if not 0 < content["run"] < 1 << run_number.BITS:
        raise PeerLost(f"the continuum gave the run the number {content['run']}")
    rim = frames.unpack_array(content["rim"], columns=2)
    if len(rim) < 3:
        raise PeerLost(f"the continuum sent a rim of {len(rim)} nodes")
    conversation.session = content["session"]
    if "lane" in content and (connection := conversation.transport.enter(content["lane"])):
        peer = Peer(conversation.peer, conversation.rank, len(rim))
        conversation.transport.lanes = Lanes(conversation.session, [peer], messages.VELOCITY, messages.FORCE)
        conversation.transport.lanes.open(conversation.peer, connection)
    begin = content.get("resume")
    moment = None if begin is None else Moment(begin["session"], begin["stage"], begin["step"])
    surface = frames.unpack_array(content["surface"], columns=2) if "surface" in content else None
    return Joined(np.ascontiguousarray(rim), moment, content["run"], None if surface is None else np.ascontiguousarray(surface))
