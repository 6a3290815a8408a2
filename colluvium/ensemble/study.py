"""A sweep: all points of a plan, each once, on the workers of a cluster.

Points that share their first stages wait for the first one of them, whose run they branch off: it computes these stages, and the
kernels that all need. Results stay in the folders of the points, which the hash of their scene names.
"""

import csv
import json
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

from colluvium.ensemble import point as one_point
from colluvium.ensemble.plan import SEED, Point
from colluvium.ensemble.scenes import shared_key, shared_stage
from coupler_protocol import exits

TABLE, PLAN = "points.csv", "plan.json"
LOOK = 0.5  # [s] between looks at the scheduler
LOST = 3  # workers that may die in a point until it counts as failed


class Found(NamedTuple):
    """A point and what it gave: see point.compute."""

    point: Point
    folder: Path
    told: dict[str, Any]

    @property
    def failed(self) -> str:
        """Why the run failed, "" if it did not."""
        return str(self.told.get("failed", ""))


class Sweep:
    """Points of a plan with their scenes, computed into `out`; quantities: texts of colluvium.accuracy.quantity, or FAILURE."""

    def __init__(
        self, points: Sequence[Point], scenes: Sequence[Any], quantities: Sequence[str], out: Path, branch: bool = True
    ) -> None:
        self.points, self.quantities, self.out = list(points), tuple(quantities), out
        self._digests = [scene.digest() for scene in scenes]
        self._jobs = [self._job(*both) for both in zip(points, scenes, self._digests, strict=True)]
        self._first = _firsts(scenes) if branch else [(i, None) for i in range(len(scenes))]

    def _job(self, point: Point, scene: Any, digest: str) -> one_point.Job:
        tables = scene.model_dump(mode="json", exclude_none=True)
        root = self.out.resolve()
        return one_point.Job(
            point.name, tables, self.quantities, str(root), str(root / "points" / digest[:16]), "", version("colluvium")
        )

    def folder(self, number: int) -> Path:
        """Folder of the point with this number."""
        return Path(self._jobs[number].folder)

    def done_before(self) -> dict[int, dict[str, Any]]:
        """Results of points that need not be computed, by number."""
        found = {}
        for number, digest in enumerate(self._digests):
            if told := one_point.finished(self.folder(number), digest, self.quantities):
                found[number] = told
        return found

    def compute(self, client: Any, report: Callable[[int, Found], None]) -> list[Found]:
        """Computes all points; report(left, found) is called when one ends. Returns them in their order.

        Raises EnvironmentFailed when the scheduler is gone, Interrupted after Ctrl-C; what is done is kept.
        """
        told = self.done_before()
        left = [number for number in range(len(self.points)) if number not in told]
        (self.out / one_point.STOP).unlink(missing_ok=True)
        try:
            for number, result in self._results(client, left, told):
                told[number] = result
                left.remove(number)
                report(len(left), self._found(number, result))
        except KeyboardInterrupt:
            (self.out / one_point.STOP).touch()  # workers end their runs, which save their State
            raise exits.Interrupted("interrupted: the same command continues") from None
        return [self._found(number, told[number]) for number in range(len(self.points))]

    def _found(self, number: int, told: dict[str, Any]) -> Found:
        return Found(self.points[number], self.folder(number), told)

    def _results(self, client: Any, left: Sequence[int], told: dict[int, Any]) -> Iterator[tuple[int, dict[str, Any]]]:
        """Yields (number, result) of points as they end; those that branch off begin after the first of their group."""
        waiting: dict[int, list[int]] = defaultdict(list)
        running: dict[Any, int] = {}
        for number in left:
            first = self._first[number][0]
            if first == number or first in told:
                running[self._submit(client, number)] = number
            else:
                waiting[first].append(number)
        while running:
            for future in self._ended(client, running):
                number = running.pop(future)
                yield number, _told(future)
                for follower in waiting.pop(number, ()):
                    running[self._submit(client, follower)] = follower

    def _submit(self, client: Any, number: int) -> Any:
        job = self._jobs[number]
        first, stage = self._first[number]
        if first != number and stage is not None:
            job = job._replace(origin=f"{self.folder(first)}@{stage}")
        return client.submit(one_point.compute, job, key=f"{self.folder(number).name}-{number}", pure=False)

    @staticmethod
    def _ended(client: Any, running: dict[Any, int]) -> list[Any]:
        """Futures that have ended, after at most LOOK seconds; raises EnvironmentFailed without a scheduler."""
        from distributed import wait

        try:
            with client.as_current():
                wait(list(running), timeout=LOOK, return_when="FIRST_COMPLETED")
        except TimeoutError:
            pass
        except Exception as error:  # Dask has many for a connection that is gone
            raise _gone(error) from None
        if client.status != "running":
            raise _gone(client.status)
        return [future for future in running if future.done()]


def _gone(why: Any) -> exits.EnvironmentFailed:
    return exits.EnvironmentFailed(
        f"the scheduler is gone ({why}): points that are done are kept, the same command continues with a scheduler that runs"
    )


def _told(future: Any) -> dict[str, Any]:
    """The result of a future, or its error as the failure of the point."""
    if future.status == "finished":
        return dict(future.result())
    if future.status in ("cancelled", "lost"):
        raise _gone(f"a point was {future.status}")
    error = future.exception()
    if isinstance(error, exits.Interrupted):
        raise error
    if isinstance(error, one_point.OtherVersionError):
        raise exits.EnvironmentFailed(str(error))
    words = "its workers died" if type(error).__name__ == "KilledWorker" else f"{type(error).__name__}: {error}"
    return {"failed": words, "values": {}, "lacking": {}}


def _firsts(scenes: Sequence[Any]) -> list[tuple[int, str | None]]:
    """For every scene, the number of the first one that shares its first stages, and the name of the last of these."""
    first: dict[str, int] = {}
    found: list[tuple[int, str | None]] = []
    for number, scene in enumerate(scenes):
        index = shared_stage(scene)
        if index is None:
            found.append((number, None))
        else:
            found.append((first.setdefault(shared_key(scene, index), number), scene.stage[index].name))
    return found


def write_plan(points: Sequence[Point], path: Path) -> None:
    """Writes the points of a plan as JSON."""
    rows = [{**point.values, SEED: point.seed} for point in points]
    path.write_text("[\n" + ",\n".join(map(json.dumps, rows)) + "\n]\n", encoding="utf-8")


def write_table(found: Sequence[Found], quantities: Sequence[str], path: Path) -> None:
    """Writes one row a point: values of the keys, seed, each quantity with its half width, steps, seconds, folder, failure.

    `pandas.read_csv(path)` reads it. With pyarrow installed, the same table is written as Parquet beside it.
    """
    rows = [_row(one, quantities, path.parent) for one in found]
    names = list(dict.fromkeys(name for row in rows for name in row))
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, names)
        writer.writeheader()
        writer.writerows(rows)
    try:
        from pyarrow import Table, parquet
    except ModuleNotFoundError:
        return
    columns = {name: [row.get(name) for row in rows] for name in names}
    parquet.write_table(Table.from_pydict(columns), path.with_suffix(".parquet"))


def _row(one: Found, quantities: Sequence[str], root: Path) -> dict[str, Any]:
    row: dict[str, Any] = {**one.point.values, SEED: one.point.seed}
    for text in quantities:
        value, half_width = one.told["values"].get(text, (None, None))
        row |= {text: value, f"{text}_half_width": half_width}
    row |= {key: one.told.get(key) for key in ("steps", "seconds", "tries")}
    why = (
        one.failed
        or one.told.get("ended")
        or "; ".join(f"{text}: {words}" for text, words in one.told.get("lacking", {}).items())
    )
    return row | {"folder": str(one.folder.relative_to(root.resolve())), "why_not": why}
