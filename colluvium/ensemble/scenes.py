"""Scenes of the points of a sweep, and which of them share their first stages.

Until discs fill the windows, the State of the grid depends on no key of the discs: points that differ only in stones, discs or
seed branch off from one run of the grid (restart.py says what may differ).
"""

import copy
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from colluvium.ensemble.plan import Point
from coupler_protocol.files import restart
from coupler_protocol.problems import Problem, SceneError
from coupler_protocol.scene.reader import build_scene, override, read_data
from coupler_protocol.scene.stage_kinds import number_of

MOST_TOLD = 10  # points whose scenes are refused


class Scenes:
    """Scenes made from the one at `path` with overrides `given`."""

    def __init__(self, path: str | Path, given: Sequence[str]) -> None:
        self.path = Path(path)
        self._data, self._lines = read_data(path)
        override(self._data, given, self._lines)

    @property
    def seed(self) -> int:
        """Seed of the scene, from which seeds of a sweep count on."""
        seed = self._data.get("seed")
        return seed if isinstance(seed, int) and not isinstance(seed, bool) and seed >= 0 else 1

    def of(self, point: Point) -> Any:
        """The scene of a point; raises SceneError."""
        data, lines = copy.deepcopy(self._data), dict(self._lines)
        for table in point.left_out:
            data.pop(table, None)
        override(data, point.changes, lines)
        return build_scene(data, str(self.path), lines, self.path.parent)

    def checked(self, points: Sequence[Point]) -> list[Any]:
        """The scenes of points; raises SceneError with the problems of all points, each said once."""
        scenes: list[Any] = []
        problems: dict[tuple[str, str], Problem] = {}
        of_values: dict[str, Any] = {}
        for point in points:
            values = repr(point.values)
            try:
                scene = of_values.get(values)
                if scene is None:
                    scene = of_values[values] = self.of(point)
                scenes.append(scene if scene.seed == point.seed else scene.model_copy(update={"seed": point.seed}))
            except SceneError as error:
                for problem in error.problems:
                    place = f"{problem.file} ({', '.join(f'{k}={v}' for k, v in point.values.items())})"
                    problems.setdefault((problem.key, problem.reason), replace(problem, file=place))
        if problems:
            raise SceneError(list(problems.values())[:MOST_TOLD])
        return scenes


def shared_stage(scene: Any) -> int | None:
    """Number of the last stage that points with other discs share, None if there is none worth a branch."""
    if scene.grid is None:
        return None
    filled = number_of(scene.stage, fills=True)
    before = range(len(scene.stage) if filled is None else filled)
    kept = [i for i in before if not scene.stage[i].discard]
    return kept[-1] if filled is not None and kept else None


def shared_key(scene: Any, index: int) -> str:
    """Hash of all by which the States at the end of a shared stage differ."""
    return restart.identity(scene, index)
