"""One side is fifty times slower than the other: the same bits.

`tests/hard/box.toml`; in the last stage, one side pauses after every step for fifty times the time that it computes in a step
of the undisturbed run (run.json has it): first the grid, then the discs. Arrays unlike those of the undisturbed run are
counted."""

import tempfile
import time
from pathlib import Path

from verification.coupling.bits import differing
from verification.hard.runs import ended
from verification.hard.watched import scene_of
from verification.verdict_rows import row

NAME = "slow peer"
SLOWER, STAGE = 50, "load"


def rows(fast):
    """100 steps (fast: 20)."""
    tables = scene_of("box", load={"steps": 20 if fast else 100})
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        stage = ended(tables, folder / "straight", on_step=(1, lambda moment: None)).row(STAGE)
        for rank, side in enumerate(("grid", "discs")):
            pause = SLOWER * stage["seconds"][("continuum", "discrete")[rank]] / stage["steps"]

            def rest(moment, rank=rank, pause=pause):
                if moment.rank == rank and moment.stage == STAGE:
                    time.sleep(pause)

            slow = ended(tables, folder / side, on_step=(1, rest))
            what = f"the {side} {SLOWER} times slower"
            yield row(f"{what}: exit code", slow.code, 0.0, 0.0, "as asked for")
            count = differing(folder / side, folder / "straight", STAGE)
            yield row(f"{what}: arrays unlike those of the undisturbed run", count, 0.0, 0.0, "identity")
