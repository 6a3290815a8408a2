"""The files of one rank of a resumed run, read as one: `fdm.rank0.vtkhdf`, `fdm.rank0.part1.vtkhdf`, ...

Each part names the stages whose results it continued, or the step after which it continued inside of a stage. Later frames and
histories in the earlier files were computed again and do not count. (Before version 0.2 a part began with a frame of the restored
State, which replaces the same frame of the earlier file.)
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from colluvium.results.cracks import Cracks
from colluvium.results.rank_file import Fields, RankFile


class RankParts:
    """Several files with the interface of a RankFile; the parts are in the order in which they were written."""

    def __init__(self, paths: Sequence[Path]) -> None:
        self.parts = [RankFile(path) for path in paths]
        self.path, self.kind = self.parts[0].path, self.parts[0].kind
        self.run, self.scene, self.written = self.parts[-1].run, self.parts[-1].scene, self.parts[-1].written
        self.cut = self.parts[-1].cut  # of earlier parts, later frames were computed again
        self._limits: list[float] = []  # last step of each part that counts
        self._places: dict[tuple[str, int], tuple[int, int]] = {}  # (stage, step) -> part, frame in it
        for number, part in enumerate(self.parts):
            self._go_on_with(number, part)
        self.frames = [self.parts[part].frames[frame] for part, frame in self._places.values()]
        self._order = list(self._places.values())

    def points(self, frame: int) -> Fields:
        """Gridpoints or discs of a frame, as in RankFile."""
        part, row = self._order[frame]
        return self.parts[part].points(row)

    def zones(self, frame: int) -> Fields:
        """Zones of a frame, as in RankFile."""
        part, row = self._order[frame]
        return self.parts[part].zones(row)

    def contacts(self, frame: int) -> Fields:
        """Contacts of a frame, as in RankFile."""
        part, row = self._order[frame]
        return self.parts[part].contacts(row)

    def about(self, place: str, name: str) -> tuple[str, str]:
        """Unit and meaning of a field."""
        return next(part for part in self.parts if name in part.field_names(place)).about(place, name)

    def field_names(self, place: str) -> list[str]:
        """Names of the recorded fields of points ("PointData") or cells ("CellData")."""
        return list(dict.fromkeys(name for part in self.parts for name in part.field_names(place)))

    def constant(self, name: str) -> np.ndarray | None:
        """Array for all frames, or None."""
        return self.parts[-1].constant(name)

    def units(self) -> dict[str, str]:
        """Unit of every field and history."""
        return {name: unit for part in self.parts for name, unit in part.units().items()}

    def history_names(self) -> list[str]:
        """Names of the histories."""
        return list(dict.fromkeys(name for part in self.parts for name in part.history_names()))

    def history(self, name: str) -> tuple[np.ndarray, np.ndarray]:
        """Steps and values of a history."""
        pieces: list[tuple[np.ndarray, np.ndarray]] = []
        end = np.inf  # the last row of an earlier file may be the first of the next one
        for part, limit in reversed(list(zip(self.parts, self._limits, strict=True))):
            if name in part.history_names():
                steps, values = part.history(name)
                counts = (steps <= limit) & (steps < end)
                pieces.insert(0, (steps[counts], values[counts]))
                end = min(end, steps[0]) if len(steps) else end
        steps, values = (np.concatenate(column) for column in zip(*pieces, strict=True))
        return steps, values

    def cracks(self) -> Cracks:
        """All breaks of bonds, without those of steps that were computed again."""
        found = [part.cracks() for part in self.parts]
        kept = [one.where(one.step <= limit) for one, limit in zip(found, self._limits, strict=True)]
        return Cracks(*(np.concatenate(columns) for columns in zip(*kept, strict=True)))

    def close(self) -> None:
        """Closes the files; arrays that were read remain valid."""
        for part in self.parts:
            part.close()

    def _go_on_with(self, number: int, part: RankFile) -> None:
        """Removes frames that the part computed again, then adds its frames."""
        if part.kept_stages is not None or part.kept_step is not None:
            if part.kept_step is not None:
                last = part.kept_step
                self._places = {key: place for key, place in self._places.items() if key[1] <= last}
            else:
                self._places = {key: place for key, place in self._places.items() if key[0] in (part.kept_stages or ())}
                last = max((step for _, step in self._places), default=-1)
            self._limits = [min(limit, last) for limit in self._limits]
        self._limits.append(np.inf)
        self._places.update({(info.stage, info.step): (number, row) for row, info in enumerate(part.frames)})
