"""Search for the factor of a coupled slope: its grid alone, the coupled slope at rest, then trials, several at the same time.

Finished parts of an earlier search in the same folder are not computed again.
"""

import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from colluvium.running import processes
from colluvium.safety import scenes
from colluvium.safety.reduction import RULE
from colluvium.safety.trial import Base, run_trial
from coupler_protocol import exits
from coupler_protocol.files import locks, run_json, saved_moments
from coupler_protocol.scene.schedule import plan
from fdm_server.fos.bracket import Bracket, NoBracket
from fdm_server.fos.verdict import UNDECIDED

Say = Callable[[str], None]
AT_REST, TRIALS, FILE = "at_rest", "trials", "coupled.json"
AROUND = 0.9, 1.1  # first factors over the factor of the grid alone


def bring_to_rest(scene: Any, out: Path, say: Say) -> tuple[Any, dict[str, Any]]:
    """Computes the coupled slope at rest in `out`, or continues it; returns its scene and its tables."""
    tables = scenes.base_tables(scene)
    base = scenes.checked(tables)
    out.mkdir(parents=True, exist_ok=True)
    with locks.held(out, [processes.LOCK]):
        if saved_moments.finished(base, out, "fdm.rank0", True):
            say("the coupled slope at rest: computed before")
            return base, tables
        saved_moments.refuse_other_scene(base, out, "fdm.rank0")
        (out / "endpoint").unlink(missing_ok=True)  # of a process that was killed
        path = out / "scene.toml"
        path.write_text(processes.as_toml(tables), encoding="utf-8")
        say("the coupled slope: coming to rest")
        processes.checked(processes.run_files(path, out, len(base.window), ["--quiet"]))
    return base, tables


class Search:
    """The trials of a coupled slope in the folder `out`; alone: fos.json of its grid alone, at_once: trials at the same time."""

    def __init__(self, scene: Any, alone: dict[str, Any], out: Path, at_once: int, threads: int, say: Say) -> None:
        self.scene, self.alone, self.out, self.at_once, self.threads, self.say = (
            scene,
            alone["meshes"][-1],
            out,
            at_once,
            threads,
            say,
        )
        self.trials: list[dict[str, Any]] = []
        self._end = threading.Event()

    def run(self) -> dict[str, Any]:
        """All trials; returns the content of `coupled` of fos.json. Raises PhysicsFailed without a bracket."""
        begin = time.perf_counter()
        scene, tables = bring_to_rest(self.scene, self.out / AT_REST, self.say)
        leg, alone = plan(scene)[-1], self.alone
        base = Base(
            self.out / AT_REST, scene, tables, leg.gravity * leg.end, alone["settlement"], alone["span"], alone["budget"]
        )  # fmt: skip
        bracket = Bracket(scene.fos.resolution)
        first = alone["value"] * AROUND[0], alone["value"] * AROUND[1]
        with ThreadPoolExecutor(self.at_once) as pool:
            try:
                self._all_rounds(pool, base, bracket, first)
            except BaseException:
                self._end.set()  # the other trials end before the pool does
                raise
        found = {"value": bracket.middle, "low": bracket.low, "high": bracket.high}
        found |= {"undecided": bracket.undecided, "contradictions": bracket.contradictions}
        return found | self._about(base) | {"seconds": round(time.perf_counter() - begin, 3)}

    def _all_rounds(self, pool: ThreadPoolExecutor, base: Base, bracket: Bracket, first: tuple[float, float]) -> None:
        """Narrows the bracket to its resolution."""
        while factors := bracket.next_factors(first, self.at_once):
            try:
                bracket.refuse_endless(factors, first)
            except NoBracket as error:
                raise exits.PhysicsFailed(f"coupled trials: {error}") from None
            for row in self._round(pool, base, factors):
                bracket.tried[row["factor"]] = row["verdict"]

    def _round(self, pool: ThreadPoolExecutor, base: Base, factors: list[float]) -> list[dict[str, Any]]:
        """Rows of the factors of a round, in their order."""
        self.say(f"trials at the same time: {', '.join(f'{factor:.5g}' for factor in factors)}")
        tasks = [
            pool.submit(run_trial, base, f, self.out / TRIALS / f"{f:.8g}", self._end.is_set, self.threads) for f in factors
        ]  # fmt: skip
        rows = [task.result() for task in tasks]
        for row in rows:
            why = f" (stopped: {row['stopped']})" if "stopped" in row and row["verdict"] == UNDECIDED else ""
            self.say(f"factor {row['factor']:.5g} {row['verdict']} after {row['steps']} steps{why}")
        self.trials += rows
        run_json.write_json(self.out / FILE, self._about(base))
        return rows

    def _about(self, base: Base) -> dict[str, Any]:
        return {
            "rules": {"discs": RULE},
            "windows": [window.name for window in base.scene.window],
            "gravity": base.gravity,
            "span": base.span,
            "budget": base.budget,
            "settlement": base.settlement,
            "at_rest": run_json.read(base.folder / run_json.NAME)["stages"][-1]["ended_by"],
            "trials": self.trials,
        }
