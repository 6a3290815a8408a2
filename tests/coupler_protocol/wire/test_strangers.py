"""What strangers cost a continuum that steps: memory, descriptors, log, processor; no number of the steps changes, none is lost.

Each stranger of strangers.py at the gate of a continuum (besieged.py), each in a process of its own.
"""

import itertools
import json
import subprocess
import sys
import threading
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
from tests.coupler_protocol.wire.besieged import LAST, NUMBERS
from tests.coupler_protocol.wire.strangers import ENOUGH
from tests.scripted_peer import SESSION, clocks

HERE = Path(__file__).parent
MEMORY, DESCRIPTORS, LOG, SHARE = 64.0, 64, 100_000, 0.2  # MB, count, bytes, of a processor
STEPS, MOST_STEPS = 400, 20_000
PAUSE = 3e-3  # [s] between steps
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


def siege(kind, stranger, file=None):
    """What the continuum used until STEPS steps after the stranger had acted ENOUGH times; the answers are checked."""
    processes = [started("besieged.py", kind)]
    endpoint = processes[0].stdout.readline().strip()
    end = RankTransport(endpoint, admission.pass_of(endpoint, True, file, kind == "open"))
    try:
        talk = Conversation(end, 1, 0, clocks(10.0, 60.0), StopRequest())
        end.send(b"hello")
        talk.begin(SESSION)
        talk.receive((GO,))
        acted = threading.Event()
        if stranger:
            processes.append(started("strangers.py", stranger, endpoint.rpartition(":")[2]))
            threading.Thread(target=wait_for_acts, args=(processes[1].stdout, acted)).start()
        else:
            acted.set()
        force, velocity = (StepFrame(k, SESSION, 1, 0, NUMBERS) for k in (FORCE, VELOCITY))
        beside, random = 0, np.random.default_rng(1)
        for step in range(MOST_STEPS):
            beside += acted.is_set()
            last = beside > STEPS or step == MOST_STEPS - 1
            force.values[:] = row = random.standard_normal(NUMBERS) if not last else np.full(NUMBERS, LAST)
            talk.send_step(force)
            velocity.accept(talk.receive((VELOCITY,))[1])
            assert velocity.values.tobytes() == (-row).tobytes()
            if last:
                break
            time.sleep(PAUSE)
        assert acted.is_set(), "the stranger could do too little: the test says nothing"
        return json.loads(processes[0].stdout.readline())
    finally:
        end.close()
        for process in processes:
            process.kill()
            process.wait()


def wait_for_acts(told, acted):
    """Sets the event once a stranger has told of ENOUGH acts."""
    acts = sum(1 for _ in itertools.islice(told, ENOUGH))
    if acts == ENOUGH:
        acted.set()


@pytest.fixture(scope="module")
def undisturbed():
    """Share of a processor that the threads beside the steps use without strangers, by kind of gate."""
    return {kind: siege(kind, None)["share"] for kind in ("local", "open")}


def check(used, share):
    print({key: value for key, value in used.items() if key != "text"})
    assert used["memory"] <= MEMORY
    assert used["descriptors"] <= DESCRIPTORS
    assert used["log"] <= LOG
    assert used["share"] <= share + SHARE
    assert used["refused"] == 0
    assert used["repeated"] <= used["seconds"] + 1.0  # once a second, who asks for the rank makes the continuum ask its holder
    assert "\x1b" not in used["text"]
    assert "Traceback" not in used["text"]


@pytest.mark.parametrize("stranger", AT_THE_GATE)
def test_who_does_not_pass_the_gate_costs_little(undisturbed, stranger):
    used = siege("local", stranger)
    check(used, undisturbed["local"])
    assert used["turned_away"] > 10


@pytest.mark.parametrize("stranger", INSIDE)
def test_who_passes_a_gate_for_everybody_costs_little_as_well(undisturbed, stranger):
    used = siege("open", stranger)
    check(used, undisturbed["open"])
