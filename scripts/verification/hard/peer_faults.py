"""A peer that is killed, and messages that are lost, doubled, late, changed or hold NaN.

`tests/hard/box.toml`, on the link (`link.lane` = false). *Messages*: of every 20 FORCE and every 20 VELOCITY one is lost, one
arrives twice, one arrives after the one before it once more, and in one a bit is changed: arrays unlike those of the
undisturbed run are counted. *NaN*: a number in a message whose checksum is right; both sides end with exit code 5, name the
message, and save. *Killed*: the process of the grid, then that of the discs, kills itself (SIGKILL) in the middle of the last
stage; the other one ends with exit code 5 after `link.give_up` and saves, and the same command then completes the run with the
same bits. `tests/integration/test_lane_faults.py` has the same faults on a lane, `tests/integration/test_lan_faults.py` those
of a network."""

import json
import subprocess
import sys
import tempfile
import zlib
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from coupler_protocol.exits import PEER
from coupler_protocol.wire import messages
from coupler_protocol.wire.frames import CRC_AT, HEADER, kind_of
from coupler_protocol.wire.link_inproc import InprocTransport
from verification.coupling.bits import DISCS, GRID, differing
from verification.hard.runs import ended, saved
from verification.hard.watched import scene_of
from verification.verdict_rows import row

NAME = "peer faults"
SOURCE, LAST = "as asked for", "load"
KINDS = {"FORCE": messages.FORCE, "VELOCITY": messages.VELOCITY}
EVERY = 20
PATIENCE = 5.0  # link.give_up [s] of killed processes: before the launcher asks the other side to stop
PLUGIN = """import os, signal
from pathlib import Path

EVERY = 5
DONE = Path({done!r})

def on_step(moment):
    if moment.stage == {stage!r} and moment.rank == {rank} and moment.step >= {step} and not DONE.exists():
        DONE.touch()
        os.kill(os.getpid(), signal.SIGKILL)
"""


def changed(frame):
    """The frame with one other bit in its last number."""
    found = bytearray(frame)
    found[-3] ^= 16
    return bytes(found)


def with_nan(frame):
    """The frame whose last number is NaN, with the right checksum."""
    found = bytearray(frame)
    found[-8:] = np.float64("nan").tobytes()
    found[CRC_AT : HEADER.size] = bytes(4)
    found[CRC_AT : HEADER.size] = zlib.crc32(found).to_bytes(4, "little")
    return bytes(found)


def many(number, frame, last):
    """Frames that arrive in place of the one with this number of its kind; last: the frame before it."""
    faults = {5: [], 10: [frame, frame], 15: [last, frame], 0: [changed(frame)]}
    return faults.get(number % EVERY, [frame])


@contextmanager
def meddled(treat):
    """Transports in this process whose frames become treat(kind, number of that kind, frame, last); gives the list of faults.

    A message that is sent again is not counted once more, so that it arrives.
    """
    real, seen, done = InprocTransport.send, {}, []

    def send(transport, frame, rank=0):
        kind, frame = kind_of(frame), bytes(frame)
        number, before = seen.get(kind, (0, b""))
        if kind not in KINDS.values() or frame[HEADER.size :] == before[HEADER.size :]:
            return real(transport, frame, rank)
        seen[kind] = number + 1, frame
        sent = treat(kind, number + 1, frame, before)
        if sent != [frame]:
            done.append((kind, number + 1))
        for one in sent:
            real(transport, one, rank)
        return None

    InprocTransport.send = send
    try:
        yield done
    finally:
        InprocTransport.send = real


def tables():
    """Tables of the scene without a lane."""
    found = scene_of("box")
    found["link"]["lane"] = False
    return found


def in_messages(folder, straight):
    """Rows of faults on the link."""
    with meddled(lambda _, *frames: many(*frames)) as done:
        found = ended(tables(), folder / "meddled")
    yield row("messages: faults", len(done), 2 * 10 * 4, 0.2, SOURCE)
    yield row("messages: ends with an error", found.error is not None, 0.0, 0.0, SOURCE)
    yield row("messages: arrays unlike those of the undisturbed run", differing(folder / "meddled", straight, LAST), 0.0, 0.0,
              "identity")  # fmt: skip
    for name, wrong in KINDS.items():

        def treat(kind, number, frame, last, wrong=wrong):
            return [with_nan(frame)] if (kind, number) == (wrong, 130) else [frame]

        with meddled(treat):
            found = ended(tables(), folder / name)
        yield row(f"NaN in {name}: exit code", found.code, PEER, 0.0, SOURCE)
        named = f"{name} holds a number that is not finite" in found.said
        yield row(f"NaN in {name}: the message names it", named, 1.0, 0.0, SOURCE)
        yield row(f"NaN in {name}: sides that saved", saved(folder / name, "stopped"), 2.0, 0.0, SOURCE)


def killed(folder, straight):
    """Rows of killed processes."""
    scene, data = folder / "scene.json", scene_of("box")
    data["link"]["give_up"] = PATIENCE
    scene.write_text(json.dumps(data), encoding="utf-8")
    for rank, (victim, left) in enumerate((("grid", DISCS), ("discs", GRID))):
        out, plugin = folder / victim, folder / f"{victim}.py"
        plugin.write_text(PLUGIN.format(done=str(folder / f"{victim}.killed"), stage=LAST, rank=rank, step=350), encoding="utf-8")
        words = [sys.executable, "-m", "colluvium.cli", "run", scene, "--out", out, "--quiet", "--plugin", plugin]
        first = subprocess.run([str(word) for word in words], capture_output=True, text=True)
        yield row(f"killed {victim}: exit code of the run", first.returncode, PEER, 0.0, SOURCE)
        there = (out / f"{left}.stopped.h5").exists()
        yield row(f"killed {victim}: the other side has saved", there, 1.0, 0.0, SOURCE)
        again = subprocess.run([str(word) for word in words], capture_output=True, text=True)
        yield row(f"killed {victim}: exit code of the same command after it", again.returncode, 0.0, 0.0, SOURCE)
        yield row(f"killed {victim}: arrays unlike those of the undisturbed run", differing(out, straight, LAST), 0.0, 0.0,
                  "identity")  # fmt: skip


def rows(fast):
    """Seconds (fast: without killed processes, of which tests/integration/test_killed_processes.py has trials)."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        ended(scene_of("box"), folder / "straight")
        yield from in_messages(folder, folder / "straight")
        if not fast:
            yield from killed(folder, folder / "straight")
