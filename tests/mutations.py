"""Seeded mutations of everything that is read from outside: each case is refused in words, or means the same as before.

    python -m tests.mutations [--cases N] [--seed S] [KIND ...]

KIND: packets, handshakes, gates, conversations, scenes, discs, outlines, run_json, checkpoints. A case that crashes, computes
without end or is accepted with another meaning ends the program with its number; memory must not grow. tests/test_mutations.py
runs some thousands.
"""

import argparse
import contextlib
import copy
import json
import logging
import os
import random
import resource
import signal
import struct
import tempfile
import zlib
from pathlib import Path
from types import SimpleNamespace
from typing import NamedTuple

import msgpack
import numpy as np

from coupler_protocol.exits import EnvironmentFailed, PeerLost
from coupler_protocol.files import checkpoint, disc_csv, run_json
from coupler_protocol.problems import SceneError
from coupler_protocol.process.interrupt import StopRequest
from coupler_protocol.scene.moments import Moment
from coupler_protocol.scene.reader import build_scene, read_scene
from coupler_protocol.scene.scene import Link
from coupler_protocol.wire import frames, handshake, messages
from coupler_protocol.wire import gate_words as words
from coupler_protocol.wire.admission import Pass, SecretRule
from coupler_protocol.wire.clocks import Clocks
from coupler_protocol.wire.lockstep import Conversation, Hub
from dem_server.stones.outlines import OutlineError, read_outlines
from tests.commands import ROOT
from tests.coupler_protocol.wire import conversation as talk
from tests.coupler_protocol.wire import exchange
from tests.coupler_protocol.wire.test_frames import recorded

HANGS = 30.0  # [s] of the processor for one case
GROWTH = 64  # [MB] of memory for all cases of a kind
ODD = (
    None, True, False, 0, -1, 1, 2**31, 2**63, 2**64 - 1, 0.0, -0.0, 1e-308, 1e308, float("inf"), float("nan"), "", "x",
    "\0\x1b[2J\n", "9" * 400, b"", b"\0" * 9, [], {}, [[]], {"": {}}, [1.0, "a"],
)  # fmt: skip


# -- mutations -----------------------------------------------------------------------------------------------------------


def changed_bytes(data, rng):
    """The bytes with some of them flipped, cut, doubled, or taken from elsewhere."""
    data = bytearray(data)
    for _ in range(rng.choice((1, 1, 1, 2, 5))):
        at, size = rng.randrange(len(data) + 1), rng.choice((1, 1, 2, 8, 64))
        how = rng.randrange(5)
        if how == 0 and at < len(data):
            data[at] ^= 1 << rng.randrange(8)
        elif how == 1:
            del data[at : at + size]
        elif how == 2:
            data[at:at] = rng.randbytes(size)
        elif how == 3:
            data[at : at + size] = data[rng.randrange(len(data) + 1) :][:size]
        else:
            data = data[:at]
    return bytes(data)


def changed_value(value, rng):
    """Plain data with one item replaced, removed, added or renamed."""
    value = copy.deepcopy(value)
    place = value
    while True:
        keys = list(place) if isinstance(place, dict) else range(len(place))
        inner = [key for key in keys if isinstance(place[key], dict | list) and place[key]]
        if not inner or rng.random() < 0.3:
            break
        place = place[rng.choice(inner)]
    how = rng.randrange(4) if len(place) else 3
    key = rng.choice(list(keys)) if len(place) else None
    if how == 0:
        place[key] = rng.choice(ODD)
    elif how == 1:
        del place[key]
    elif how == 2 and isinstance(place[key], int | float) and not isinstance(place[key], bool):
        place[key] *= rng.choice((-1, 0, 1e-9, 0.5, 1 + 1e-15, 1e9))
    elif isinstance(place, dict):
        place[rng.choice(("x", "", "stage", "__class__", "kind", "seed"))] = rng.choice(ODD)
    else:
        place.insert(rng.randrange(len(place) + 1), rng.choice(ODD))
    return value


def resealed(frame):
    """The frame, at least a header, with the length and the checksum that it should have."""
    frame = bytearray(frame.ljust(40, b"\0"))
    struct.pack_into("<II", frame, 32, len(frame) - 40, 0)
    struct.pack_into("<I", frame, 36, zlib.crc32(frame))
    return bytes(frame)


# -- kinds of cases: a generator of functions of a random generator ----------------------------------------------------------


def packets(folder):
    """Frames: changed ones are refused; with a checksum that fits, content has the declared types or is refused."""
    known = [frame for frame in recorded().values() if len(frame) > 40]

    def case(rng):
        frame = rng.choice(known)
        wrong = changed_bytes(frame, rng)
        with contextlib.suppress(frames.WireError):
            frames.open_header(wrong)
            assert wrong == frame, "a changed frame was accepted"
        wrong = resealed(wrong)
        with contextlib.suppress(frames.WireError):
            kind, *_ = frames.open_header(wrong)
            if kind in messages.CONTENT:
                assert frames.content_of(wrong).keys() >= messages.CONTENT[kind].keys()
            else:
                into = exchange.step_frame(kind, exchange.ANSWER if kind == messages.FORCE else exchange.ORDER, exchange.FORCES)
                into.accept(wrong)
                assert np.isfinite(into.values).all()
        return wrong

    return case


class Said:
    """A transport over which given frames arrive, and nothing else."""

    lanes, local, port, endpoint, proves, trouble = None, False, 0, "a mutation", True, ""

    def __init__(self, arriving, sender=0):
        self.arriving, self.sent, self._sender, self._rank = list(arriving), [], sender, None

    def send(self, frame, rank=0):
        self.sent.append(bytes(frame))

    def receive(self, seconds):
        if not self.arriving:
            return None
        return self._sender if self._rank is None else self._rank, memoryview(self.arriving.pop(0))

    def admit(self, sender, rank):
        self._rank = rank

    def connected(self, rank=0):
        return True

    def departed(self, rank=0):
        return not self.arriving

    def enter(self, offer):
        assert isinstance(offer["port"], int)
        assert isinstance(offer["token"], bytes)


OURS = [Moment(7, 1, 300), Moment(7, 2, 900), Moment(7, 2, 0)]  # moments that this side has saved


def sealed_control(kind, session, content):
    """A control frame of rank 1 with any content; OverflowError: msgpack has no larger integers."""
    frame = bytearray(40) + msgpack.packb(content)
    frames.HEADER.pack_into(frame, 0, frames.MAGIC, messages.PROTOCOL_VERSION, kind, session, 1, 0, 0, 0, 0)
    return resealed(frame)


def changed_control(kind, session, right, rng):
    """The frame of a control message with changed content or changed bytes, with a checksum that fits."""
    if rng.random() < 0.3:
        return resealed(changed_bytes(sealed_control(kind, session, right), rng))
    return sealed_control(kind, session, changed_value(right, rng))


def handshakes(folder):
    """HELLO and WELCOME with other content: refused, or they mean the same; the continuum goes on from a moment it has saved."""
    link = Link(lane=False)
    stages = [SimpleNamespace(name=name) for name in ("a", "b", "c")]
    scene = SimpleNamespace(
        link=link, coupling=SimpleNamespace(exchange_every=1), resolved=lambda: exchange.SCENE, stage=stages,
        name_of_stage=lambda number: stages[number].name,
    )  # fmt: skip
    hello = {"package": handshake.version("colluvium"), "float": "<f8", "scene": exchange.SCENE}
    welcome = exchange.WELCOME_CONTENT | {"dt": 1.0, "exchange_every": 1, "lane": {"port": 5, "token": bytes(32)}}
    surface = {"surface": frames.pack_array(np.array([[3.0, 2.0], [2.0, 2.5]]))}

    def case(rng):
        own = OURS if rng.random() < 0.5 else []
        with contextlib.suppress(OverflowError):
            (heard if rng.random() < 0.5 else told)(rng, own)

    def heard(rng, own):
        right = hello | ({"checkpoints": [moment._asdict() for moment in own]} if own else {})
        frame = changed_control(messages.HELLO, 0, right, rng)
        transport = Said([frame], "stranger")
        transport.proves = rng.random() < 0.5
        try:
            choice = handshake.Choice(own, lambda moment: moment.step > 300)
            begin = handshake.welcome_all(Hub(transport, [1], Clocks(link), StopRequest()), scene, {1: exchange.RIM}, choice)
            same = frames.content_of(frame)
            assert [repr(same[key]) for key in hello] == [repr(hello[key]) for key in hello], "another HELLO was welcome"
            assert begin in (own or [None])
        except PeerLost:
            assert all(frames.kind_of(said) == messages.REJECT for said in transport.sent)

    def told(rng, own):
        right = welcome | ({"resume": own[1]._asdict()} if own else surface)
        transport = Said([changed_control(messages.WELCOME, exchange.SESSION, right, rng)])
        talk = Conversation(transport, 1, 0, Clocks(link), StopRequest())
        with contextlib.suppress(PeerLost):
            rim, begin, _, free = handshake.join(talk, scene, own)
            assert free is None or (free.shape[1] == 2 and np.isfinite(free).all())
            assert rim.shape[1] == 2
            assert len(rim) >= 3
            assert np.isfinite(rim).all()
            assert begin is None or all(isinstance(number, int) and number >= 0 for number in begin)
            talk.send_control(messages.PACKED, {})
            assert frames.open_header(transport.sent[-1])[:3] == (messages.PACKED, talk.session, 1)

    return case


def gates(folder):
    """GREETING, CLAIM and VERDICT at the gate: only the right bytes, or bytes that no proof covers, let a connection in."""
    secret, number, public = bytes(range(32)), bytes(range(16)), bytes(range(32, 64))
    tickets = [Pass(words.OPEN, b""), Pass(words.LOCAL, secret), Pass(words.KEYED, secret, number, public)]

    def case(rng):
        ticket, nonce = rng.choice(tickets), rng.randbytes(words.NONCE)
        greeting = words.greeting(ticket.kind, ticket.number, nonce)
        claim = words.claim(greeting, ticket.kind, ticket.number, ticket.public, nonce, ticket.secret)
        verdict = words.verdict(words.WELCOME, greeting, words.read_claim(claim), ticket.secret)
        right = [greeting, claim, verdict]
        said = list(right)
        place = rng.randrange(3)
        said[place] = changed_bytes(said[place], rng)[: len(right[place])]  # a reader takes no more
        if len(said[place]) < len(right[place]):
            said[place] += rng.randbytes(len(right[place]) - len(said[place]))
        with contextlib.suppress(words.ForeignError):
            kind, expected = words.read_greeting(said[0])
            heard = words.read_claim(said[1])
            found = SecretRule(ticket.kind, ticket.secret).judge(heard, greeting)
            assert (found.verdict == words.WELCOME) <= (said[1] == claim), "another claim was welcome"
            what, proved = words.read_verdict(said[2], said[0], claim, ticket.secret)
            welcome = (kind, expected, what) == (ticket.kind, ticket.number, words.WELCOME) and proved
            assert welcome <= (said[0] == greeting and said[2] == verdict), "another verdict was believed"

    return case


def conversations(folder):
    """A whole conversation in which one frame of the peer is another: the side ends with a result, or as the peer's fault."""
    record = talk.recorded()
    sides = (talk.speak_as_discs, talk.speak_as_grid)

    def case(rng):
        own = rng.randrange(2)
        arriving = [frame for side, frame in record if side != own]
        place = rng.randrange(len(arriving))
        wrong = changed_bytes(arriving[place], rng)
        arriving[place : place + rng.randrange(2)] = [resealed(wrong) if rng.random() < 0.8 else wrong]
        transport = Said(arriving, "new" if own else 0)
        first, second = talk.fixed()
        with first, second, contextlib.suppress(PeerLost):
            sides[own](transport)

    return case


def scenes(folder):
    """Tables of a scene with other values, keys and types: a scene, or all problems; a key that nobody knows is refused."""
    known = [read_scene(path).resolved() for path in sorted((ROOT / "configs").glob("quick_*.toml"))]
    text = (ROOT / "configs" / "quick_slope.toml").read_bytes()

    def case(rng):
        tables = changed_value(rng.choice(known), rng)
        with contextlib.suppress(SceneError):
            found = build_scene(tables)
            assert "x" not in tables
            json.dumps(found.resolved(), allow_nan=False)
        path = folder / "scene.toml"
        path.write_bytes(changed_bytes(text, rng))
        with contextlib.suppress(SceneError):
            read_scene(path)

    return case


def discs(folder):
    """CSV files of discs: finite numbers, or the lines that are wrong."""
    rows = "".join(
        f"{0.1 * n},{0.2 * n},0.05,0.0,1e-3,0.1,{'soil' if n % 3 else 'stone'},{-1 if n % 3 else n}\n" for n in range(20)
    )
    text = ("x,y,radius,vx,vy,spin,material,stone\n" + rows).encode()

    def case(rng):
        path = folder / "discs.csv"
        path.write_bytes(changed_bytes(text, rng))
        with contextlib.suppress(SceneError):
            found = disc_csv.read(path)
            assert all(np.isfinite(values).all() for values in (found.xy, found.radius, found.motion))
            assert (found.radius > 0.0).all()

    return case


def outlines(folder):
    """GeoJSON files: outlines of finite corners, or what is wrong."""
    text = (ROOT / "configs" / "mapped_stones.geojson").read_text(encoding="utf-8")
    tables = json.loads(text)
    tables["features"] = tables["features"][:4]

    def case(rng):
        path = folder / "stones.geojson"
        whole = json.dumps(tables).encode()
        with contextlib.suppress(TypeError):  # bytes are not JSON
            path.write_bytes(changed_bytes(whole, rng) if rng.random() < 0.5 else json.dumps(changed_value(tables, rng)).encode())
            with contextlib.suppress(OutlineError):
                assert all(np.isfinite(outline.corners).all() for outline in read_outlines(path, 1.0, (0.0, 0.0), False))

    return case


def run_jsons(folder):
    """run.json: an object with rows of stages, or the file is named."""
    tables = {"exit_code": 0, "reason": "all stages done", "stages": [{"name": "a", "steps": 3}], "warnings": [{"name": "x"}]}

    def case(rng):
        path = folder / "run.json"
        with contextlib.suppress(TypeError):
            whole = json.dumps(changed_value(tables, rng) if rng.random() < 0.5 else tables).encode()
            path.write_bytes(changed_bytes(whole, rng) if rng.random() < 0.7 else whole)
            with contextlib.suppress(EnvironmentFailed):
                assert all(isinstance(row, dict) for row in run_json.read(path).get("stages", []))

    return case


class State(NamedTuple):
    """A small State."""

    xy: np.ndarray
    time: float
    step: int


def checkpoints(folder):
    """Checkpoints: any change of the file is noticed."""
    path = folder / "a.h5"
    checkpoint.save(path, State(np.arange(8.0).reshape(4, 2), 0.5, 7), {"stage": "couple"})
    whole = path.read_bytes()

    def case(rng):
        wrong = changed_bytes(whole, rng)
        path.write_bytes(wrong)
        with contextlib.suppress(EnvironmentFailed):
            checkpoint.load(path)
            assert wrong == whole, "a changed checkpoint was accepted"

    return case


KINDS = {
    "packets": packets, "handshakes": handshakes, "gates": gates, "conversations": conversations, "scenes": scenes,
    "discs": discs, "outlines": outlines, "run_json": run_jsons, "checkpoints": checkpoints,
}  # fmt: skip


# -- running them ----------------------------------------------------------------------------------------------------------


def run(kind, cases, seed=0):
    """Runs cases seed ... seed + cases - 1 of a kind; raises AssertionError with the number of the case that failed."""

    def too_long(*_):
        raise TimeoutError(f"no end after {HANGS:g} s")

    before = signal.signal(signal.SIGPROF, too_long)
    with tempfile.TemporaryDirectory() as folder:
        case = KINDS[kind](Path(folder))
        try:
            for number in range(seed, seed + cases):
                signal.setitimer(signal.ITIMER_PROF, HANGS)
                try:
                    case(random.Random(f"{kind} {number}"))
                except Exception as error:
                    raise AssertionError(f"{kind}, case {number}: {type(error).__name__}: {error}") from error
                if number == seed + cases // 4:
                    begin = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        finally:
            signal.setitimer(signal.ITIMER_PROF, 0.0)
            signal.signal(signal.SIGPROF, before)
    grown = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - begin) / 1024
    assert grown < GROWTH, f"{kind}: memory grew by {grown:.0f} MB in {cases} cases"


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("kinds", nargs="*", metavar="KIND", help=", ".join(KINDS))
    parser.add_argument("--cases", type=int, default=1_000_000, help="of each kind (default 1,000,000)")
    parser.add_argument("--seed", type=int, default=0, help="number of the first case")
    options = parser.parse_args()
    logging.basicConfig(stream=open(os.devnull, "w"))  # noqa: SIM115 - written and read by nobody: what is refused is logged
    for name in options.kinds or KINDS:
        run(name, options.cases, options.seed)
        print(f"{name}: {options.cases} cases, all refused in words or unchanged", flush=True)
