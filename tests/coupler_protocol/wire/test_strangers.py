"""What strangers cost a continuum that steps: memory, descriptors, log, processor; no number of the steps changes, none is lost.

Each stranger of strangers.py at the gate of a continuum (besieged.py), each in a process of its own.
"""

import json
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from coupler_protocol.process.interrupt import StopRequest
from coupler_protocol.wire import admission
from coupler_protocol.wire.frames import StepFrame
from coupler_protocol.wire.link_tcp import RankTransport
from coupler_protocol.wire.lockstep import Conversation
from coupler_protocol.wire.messages import FORCE, GO, VELOCITY
from tests.coupler_protocol.wire.besieged import NUMBERS
from tests.scripted_peer import SESSION, clocks

HERE = Path(__file__).parent
MEMORY, DESCRIPTORS, LOG, SHARE = 64.0, 64, 100_000, 0.2  # MB, count, bytes, of a processor
STEPS, PAUSE = 400, 3e-3  # [s] between steps, so that strangers have a second or two
AT_THE_GATE = (
    "half_open",
    "garbage",
    *(pytest.param(name, marks=pytest.mark.long) for name in ("slow_loris", "zeromq", "claims")),
)
INSIDE = (
    *("finished", "messages", "parts", "large", "hellos"),
    *(pytest.param(name, marks=pytest.mark.long) for name in ("few_messages", "almost_large")),
)

pytestmark = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="reads /proc")


def started(script, *words):
    return subprocess.Popen(
        [sys.executable, HERE / script, *map(str, words)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )


def siege(kind, stranger, file=None, steps=STEPS):
    """What the continuum used for its steps, and how often the stranger acted; the answers are checked bit by bit."""
    processes = [started("besieged.py", kind, steps)]
    try:
        endpoint = processes[0].stdout.readline().strip()
        end = RankTransport(endpoint, admission.pass_of(endpoint, True, file, kind == "open"))
        talk = Conversation(end, 1, 0, clocks(10.0, 60.0), StopRequest())
        end.send(b"hello")
        talk.begin(SESSION)
        talk.receive((GO,))
        if stranger:
            processes.append(started("strangers.py", stranger, endpoint.rpartition(":")[2]))
            time.sleep(0.3)
        force, velocity = (StepFrame(k, SESSION, 1, 0, NUMBERS) for k in (FORCE, VELOCITY))
        numbers = np.random.default_rng(1).standard_normal((steps, NUMBERS))
        for row in numbers:
            force.values[:] = row
            talk.send_step(force)
            velocity.accept(talk.receive((VELOCITY,))[1])
            assert velocity.values.tobytes() == (-row).tobytes()
            time.sleep(PAUSE)
        used = json.loads(processes[0].stdout.readline())
        acts = processes[1].communicate("", timeout=20)[0] if stranger else "0"
        end.close()
        return used, int(acts)
    finally:
        for process in processes:
            process.kill()
            process.communicate()


@pytest.fixture(scope="module")
def undisturbed():
    """Share of a processor that the threads beside the steps use without strangers, by kind of gate."""
    return {kind: siege(kind, None)[0]["share"] for kind in ("local", "open")}


def check(used, acts, share):
    print({key: value for key, value in used.items() if key != "text"}, acts)
    assert acts >= 3, "the stranger could do nothing: the test says nothing"
    assert used["memory"] <= MEMORY
    assert used["descriptors"] <= DESCRIPTORS
    assert used["log"] <= LOG
    assert used["share"] <= share + SHARE
    assert used["refused"] == 0
    assert used["repeated"] <= 5  # once a second, who asks for the rank makes the continuum ask its holder
    assert "\x1b" not in used["text"]
    assert "Traceback" not in used["text"]


@pytest.mark.parametrize("stranger", AT_THE_GATE)
def test_who_does_not_pass_the_gate_costs_little(undisturbed, stranger):
    used, acts = siege("local", stranger)
    check(used, acts, undisturbed["local"])
    assert used["turned_away"] > 10


@pytest.mark.parametrize("stranger", INSIDE)
def test_who_passes_a_gate_for_everybody_costs_little_as_well(undisturbed, stranger):
    used, acts = siege("open", stranger)
    check(used, acts, undisturbed["open"])
