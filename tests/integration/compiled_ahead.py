"""Runs a tiny coupled scene twice, with kernels compiled ahead and without; prints what was compiled when, as JSON.

    python -m tests.integration.compiled_ahead FOLDER NAME     NAME: of a scene of test_plain_steps.CASES

The cache is below FOLDER, so it is empty at first. No message is read before everything is compiled ahead that can be.
"""

import json
import os
import sys
import threading
from pathlib import Path


class Rows:
    """Names of compiled functions by "discs" or "grid", "before" or "after" a side has compiled ahead."""

    def __init__(self):
        self.depth, self.ahead, self.done = threading.local(), set(), []

    def add(self, event):
        """Notes a function that is compiled for itself, not as a part of another."""
        thread = threading.get_ident()
        if event.is_start:
            self.depth.number = getattr(self.depth, "number", 0) + 1
            if self.depth.number == 1:
                side = "grid" if threading.current_thread() is threading.main_thread() else "discs"
                self.done.append((side, thread in self.ahead, event.data["dispatcher"].py_func.__name__))
        else:
            self.depth.number -= 1


def main(folder, name):
    """Makes both runs."""
    os.environ["NUMBA_CACHE_DIR"] = str(folder / "cache")
    from numba.core import event

    from colluvium.running.threads import run
    from coupler_protocol.scene.reader import build_scene
    from coupler_protocol.wire import lanes
    from coupler_protocol.wire.lockstep import Conversation
    from dem_server.procedure import compile_ahead as of_discs
    from fdm_server.procedure import compile_ahead as of_grid
    from tests.integration.test_plain_steps import CASES, scene, with_motion

    rows, texts, receive_next = Rows(), set(), Conversation._next

    class Listener(event.Listener):
        def on_start(self, event):
            rows.add(event)

        def on_end(self, event):
            rows.add(event)

    def patient(self, meanwhile):
        for _ in meanwhile or ():
            pass
        if getattr(meanwhile, "__name__", "") == "coupled_kernels":
            rows.ahead.add(threading.get_ident())
        return receive_next(self, meanwhile)

    def note(row):
        if row["text"].startswith("compiling"):
            texts.add(row["text"])

    lanes.EARLIEST = 100  # the last stage is a long one
    Conversation._next = patient
    data = with_motion(scene(**CASES[name]), folder)
    for part in ("ahead", "apart"):
        (folder / part).mkdir()
        with event.install_listener("numba:compile", Listener()):
            run(build_scene(data), folder / part, report=note)
        of_grid.ENABLED = of_discs.ENABLED = False
    print(json.dumps({"compiled": rows.done, "texts": sorted(texts)}))


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2])
