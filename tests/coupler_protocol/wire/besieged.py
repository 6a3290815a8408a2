"""A continuum in a process of its own that answers steps while strangers are at its gate: `python besieged.py KIND`.

Prints its endpoint, then, after the step whose first force is LAST, what it used as JSON. KIND: local, open, keyed.
"""

import io
import json
import logging
import os
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from coupler_protocol.compiled import ahead
from coupler_protocol.process.interrupt import StopRequest
from coupler_protocol.wire import admission, messages, pumping
from coupler_protocol.wire.frames import StepFrame
from coupler_protocol.wire.link_tcp import HubTransport
from coupler_protocol.wire.lockstep import Hub
from tests.scripted_peer import SESSION, clocks

NUMBERS = 40
LAST = 1e6  # no force of the steps before is so large
ANY = "tcp://127.0.0.1:0"


def memory(key):
    """VmRSS or VmHWM of this process [MB]."""
    rows = Path("/proc/self/status").read_text().splitlines()
    return int(next(row for row in rows if row.startswith(key)).split()[1]) / 1000.0


def descriptors():
    """Number of open descriptors."""
    return len(os.listdir("/proc/self/fd")) - 1


def main(kind):
    written = io.StringIO()
    logging.basicConfig(stream=written, level=logging.INFO)
    rule = admission.rule_of(ANY, True, os.environ.get("COLLUVIUM_KEYS") if kind == "keyed" else None, kind == "open")
    transport = HubTransport(ANY, rule)
    print(transport.endpoint, flush=True)
    hub = Hub(transport, (1,), clocks(10.0, 60.0), StopRequest())
    while (received := transport.receive(1.0)) is None:
        pass
    transport.admit(received[0], 1)
    talk = hub.conversations[1]
    talk.begin(SESSION)
    talk.send_control(messages.GO, {"gravity": 9.81, "step": 0, "time": 0.0, "stage": 0})
    force, velocity = (StepFrame(k, SESSION, 1, 0, NUMBERS) for k in (messages.FORCE, messages.VELOCITY))
    until = time.monotonic() + 120.0
    while ahead.ENABLED and not pumping.ready():  # what compiled code takes is no cost of strangers
        assert time.monotonic() < until
        time.sleep(0.01)
    begin, open_now, most = memory("VmRSS"), descriptors(), 0
    wall, helpers = time.perf_counter(), time.process_time() - time.thread_time()
    while force.values[0] != LAST:
        force.accept(talk.receive((messages.FORCE,))[1])
        velocity.values[:] = -force.values
        talk.send_step(velocity)
        most = max(most, descriptors())
    wall, helpers = time.perf_counter() - wall, time.process_time() - time.thread_time() - helpers
    used = {"memory": memory("VmHWM") - begin, "descriptors": most - open_now, "log": len(written.getvalue())}
    used |= {"seconds": wall, "share": helpers / wall, "refused": talk.refused, "repeated": talk.repeated}
    used |= {"text": written.getvalue()}
    print(json.dumps(used | {"turned_away": sum(transport._guard.turned_away.values())}), flush=True)
    sys.stdin.read()
    os._exit(0)


if __name__ == "__main__":
    main(sys.argv[1])
