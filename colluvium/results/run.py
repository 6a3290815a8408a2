"""Results of a run by rank, frame and name: `run = open_run("runs/slope"); run.zones(-1).stress`.

A run directory contains one VTKHDF file for each rank (and one more each time it was resumed), `run.json` and the resolved scene
`scene.json`; any of them may be missing. Frames are counted over all ranks: frame i is one moment (a step of a stage), of which
one side may have no record.
"""

import re
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from colluvium.results import joined
from colluvium.results.fabric import Fabric, contact_fabric
from colluvium.results.rank_file import Fields, NotRecordedError, RankFile
from colluvium.results.rank_parts import RankParts
from colluvium.results.ring_motion import RingMotion, ring_motion
from coupler_protocol.files import run_json
from coupler_protocol.files.quantities import PER_STEP
from coupler_protocol.files.vtkhdf import FrameInfo
from coupler_protocol.scene.stage_kinds import named

if TYPE_CHECKING:
    from colluvium.results.cracks import Cracks
    from colluvium.results.force_chains import ForceChains
    from colluvium.results.stress_force_fabric import StressForceFabric

_RANK_FILE = re.compile(r".+\.rank(\d+)(?:\.part(\d+))?\.vtkhdf")
_PLACES = {  # of a file's fields: the method of Run that gives them
    "continuum": {"PointData": "gridpoints", "CellData": "zones"},
    "discrete": {"PointData": "discs", "CellData": "contacts"},
}
WHOLE = 0.9  # of a region: a mean stress over a region that discs fill less is doubted
_ROOM = {"continuum": "zones, gridpoints", "discrete": "discs, contacts"}


def open_run(path: str | Path, other_path: str | Path | None = None) -> "Run":
    """Opens a run directory, or the two directories of a run whose servers wrote to different ones, on one machine or two.

    Of two directories, frames that only one side reached are left out (`Run.cut` says so). Raises EnvironmentFailed if they are
    not the two sides of one run.
    """
    return Run([Path(folder) for folder in (path, other_path) if folder is not None])


class Run:
    """The results of one run. Negative frames count from the end; rank 0 is the continuum.

    cut: why later frames were left out: of two directories, or of a file that was being written when its machine stopped; or "".
    """

    def __init__(self, folders: list[Path]) -> None:
        self.folders = folders
        self._closed = False
        found = [_files_of(folder) for folder in folders]
        if len(folders) > 1:
            joined.check(folders, found)
        merged = {rank: file for files in reversed(found) for rank, file in files.items()}  # of the first folder that has them
        self.files = dict(sorted(merged.items()))
        if not self.files:
            raise FileNotFoundError(f"no file NAME.rankN.vtkhdf in {' or '.join(map(str, folders))}")
        self.info = _first_json(folders, "run.json")
        for row in self.info.get("stages", ()):
            if "time" in row:  # the name in runs of discs alone before version 0.2
                row["seconds_simulated"] = row.pop("time")
        self.scene = _first_json(folders, "scene.json")
        end, cut = joined.cut(self.files) if len(folders) > 1 else (None, "")
        self.cut = "; ".join(filter(None, (cut, *(file.cut for file in self.files.values()))))
        self.stages = self._order_stages(end)
        self.frames, self._rows = self._join_frames(end)

    def __repr__(self) -> str:
        name = self.info.get("title") or self.scene.get("title") or ""
        ranks = ", ".join(f"rank {rank} {file.kind}" for rank, file in self.files.items())
        end = self.info.get("reason") or "no run.json: not finished, or killed"
        parts = [f"{len(self.frames)} frames of {', '.join(self.stages) or 'no stage'}", ranks, end]
        parts += [self.cut] if self.cut else []
        if self.frames:
            parts[0] += f" up to step {self.frames[-1].step:,}"
        closed = "closed " if self._closed else ""
        return f"<{closed}Run {' and '.join(map(str, self.folders))}: {'; '.join([name, *parts] if name else parts)}>"

    def gridpoints(self, frame: int, rank: int = 0) -> Fields:
        """Gridpoints: displacement, velocity (N, 2), .. and `xy`, the coordinates before any displacement [m]."""
        return self._file(rank, "continuum").points(self._row(frame, rank))

    def zones(self, frame: int, rank: int = 0) -> Fields:
        """Zones: stress (Z, 4) as xx, yy, zz, xy, .. and `corners` (Z, 4) gridpoints, `xy` centres [m]."""
        return self._file(rank, "continuum").zones(self._row(frame, rank))

    def smoothed_stress(self, frame: int, rank: int = 0) -> np.ndarray:
        """Stresses (Z, 4) [Pa] of the zones, averaged at their gridpoints: without the alternate signs of incompressible flow.

        `zones(frame).stress` has the values as computed; colluvium.results.smoothed_stress has the equation.
        """
        from colluvium.results.smoothed_stress import smoothed

        zones = self.zones(frame, rank)
        material = zones.group if "group" in zones else np.zeros(len(zones.corners), dtype=np.int64)
        return smoothed(self.gridpoints(frame, rank).xy, zones.corners, material, zones.stress)

    def discs(self, frame: int, rank: int = 1) -> Fields:
        """Discs: radius, displacement, .. and `xy`, the centres in this frame [m]."""
        return self._file(rank, "discrete").points(self._row(frame, rank))

    def contacts(self, frame: int, rank: int = 1) -> Fields:
        """Contacts: normal_force, shear_force, .. and `ends` (C, 2), the rows of the two discs in `discs(frame)`."""
        return self._file(rank, "discrete").contacts(self._row(frame, rank))

    def bodies(self, frame: int) -> list[Fields]:
        """Gridpoints and discs of all ranks that recorded a frame."""
        return [self.files[rank].points(row) for rank, row in sorted(self._rows[frame].items())]

    def fabric(self, frame: int, rank: int = 1, kind: str | None = None) -> Fabric:
        """Statistics of contact normals and forces, of all contacts or of one kind (colluvium.results.fabric.KINDS).

        Contacts of the ring's control discs and inside one stone are left out.
        """
        return contact_fabric(self.discs(frame, rank), self.contacts(frame, rank), kind)

    def stress_force_fabric(self, frame: int, rank: int = 1, kind: str | None = None) -> "StressForceFabric":
        """Fabric, normal and tangential forces with goodness of fit, and the stress-force-fabric identity (docs/measuring.md)."""
        from colluvium.results.stress_force_fabric import stress_force_fabric

        return stress_force_fabric(self.discs(frame, rank), self.contacts(frame, rank), kind)

    def force_chains(self, frame: int, rank: int = 1) -> "ForceChains":
        """Chains of bodies under more than the mean stress: links, number, share of bodies, direction (docs/measuring.md)."""
        from colluvium.results.force_chains import force_chains

        return force_chains(self.discs(frame, rank), self.contacts(frame, rank))

    def cracks(self, rank: int = 1) -> "Cracks":
        """Every break of a bond of a window: step, time, place, normal, size, discs, materials, mode, kind of bond."""
        return self._file(rank, "discrete").cracks()

    def average_stress(self, frame: int, region: Any, rank: int = 1) -> np.ndarray:
        """Mean stress xx, yy, xy (3,) [Pa] of the discs in a circle (x, y, radius) or polygon (P, 2) [m], tension positive.

        Walls count for the discs inside that they touch; colluvium.results.averages has the equation. NaN if no disc is inside;
        a warning if part of the region lies outside of the discs, because the mean is over all of its area.
        """
        from colluvium.results import averages

        discs = self.discs(frame, rank)
        found = averages.average_stress(discs, self.contacts(frame, rank), region)
        if not np.isnan(found).any() and (share := averages.share_reached(discs, region)) < WHOLE:
            warnings.warn(f"discs fill {share:.0%} of the region: the mean stress counts the rest as 0", stacklevel=2)
        return found

    def discs_inside(self, frame: int, region: Any, rank: int = 1) -> int:
        """Number of discs that share area with a circle (x, y, radius) or polygon (P, 2) [m]."""
        from colluvium.results import averages

        return averages.discs_inside(self.discs(frame, rank), region)

    def porosity(self, frame: int, region: Any, rank: int = 1, solid_stones: bool = False) -> float:
        """Porosity [-] of a circle (x, y, radius) or polygon (P, 2) [m]; 1 without discs.

        Gaps between the discs of a stone count as voids. With solid stones, each stone is the polygon that gives its mass.
        """
        from colluvium.results import averages
        from colluvium.results.stones import outlines

        return averages.porosity(self.discs(frame, rank), region, outlines(self, frame, rank) if solid_stones else None)

    def ring_motion(self, frame: int, rank: int = 1) -> RingMotion:
        """Opening and slip between a window's ring and the first free discs since its first frame."""
        first = next(i for i in range(len(self.frames)) if self.has(i, rank))
        return ring_motion(*((self.discs(i, rank), self.contacts(i, rank)) for i in (first, frame)))

    def stones(self, rank: int = 1) -> list[np.ndarray]:
        """Polygons (V, 2) of the stones as they were placed [m]; colluvium.results.stones moves them with their discs."""
        file = self._file(rank, "discrete")
        corners, start = file.constant("stone_corners"), file.constant("stone_start")
        return [] if corners is None or start is None else np.split(corners, start[1:-1])

    def window_surface(self, rank: int = 1) -> np.ndarray | None:
        """(S, 2) [m] ground surface between the last and the first control disc of a window that reaches it; None for others."""
        return self._file(rank, "discrete").constant("window_surface")

    def stones_table(self, rank: int = 1) -> dict[str, Any]:
        """The table of the scene for the stones of a window: its own, or that of all windows; {} for none."""
        return self._window(rank).get("stones") or self.scene.get("stones") or {}

    def name_of(self, rank: int) -> str:
        """Name of a window."""
        return str(self._window(rank).get("name", f"rank {rank}"))

    def _window(self, rank: int) -> dict[str, Any]:
        tables = self.scene.get("window") or []
        return tables[rank - 1] if 1 <= rank <= len(tables) else {}

    def history(self, name: str, rank: int | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Steps and values of a history of one rank; rank None: the continuum, or the discs if they are alone."""
        rank = self._first() if rank is None else rank
        file = self._file(rank)
        if name not in file.history_names():
            elsewhere = [str(r) for r, other in self.files.items() if name in other.history_names()]
            hint = f" (rank {', '.join(elsewhere)} has it)" if elsewhere else ""
            raise NotRecordedError(f"rank {rank} has no history {name!r}{hint}; it has {', '.join(file.history_names())}")
        return file.history(name)

    def histories(self, rank: int | None = None) -> list[str]:
        """Names of the histories of one rank; rank None: as in `history`."""
        return self._file(self._first() if rank is None else rank).history_names()

    def fields(self) -> list[tuple[int, str, str, str, str]]:
        """Table of all recorded fields: rank, method that has them, name, unit, meaning."""
        found = []
        for rank, file in self.files.items():
            for place, room in _PLACES[file.kind].items():
                found += [(rank, room, name, *file.about(place, name)) for name in file.field_names(place)]
        return found

    def has_history(self, name: str, rank: int | None = None) -> bool:
        """Whether a rank has recorded a history; rank None: as in `history`."""
        rank = self._first() if rank is None else rank
        return rank in self.files and name in self.files[rank].history_names()

    def units(self, name: str, frame: int | None = None) -> str:
        """Unit of a field or history; in the stage of a frame: rates of a static stage are per step, not per second."""
        known = {key: unit for file in self.files.values() for key, unit in file.units().items()}
        if name not in known:
            raise NotRecordedError(f"nothing named {name!r} was recorded; there are {', '.join(sorted(known))}")
        static = frame is not None and self.in_real_time(self.frames[frame].stage) is False
        return PER_STEP.get(known[name], known[name]) if static else known[name]

    def last_frame(self, stage: str) -> int:
        """Number of the last frame of a stage."""
        found = [i for i, frame in enumerate(self.frames) if frame.stage == stage]
        if not found:
            raise NotRecordedError(f"no frame of a stage {stage!r}; stages with frames: {', '.join(self.stages)}")
        return found[-1]

    def stages_where(self, **wanted: Any) -> list[str]:
        """Names of the stages with frames whose kind has these values of coupler_protocol.scene.stage_kinds.Kind.

        Example: run.stages_where(couples=True). As in a scene, a stage without a kind has the kind of its name.
        """
        kinds = {stage["name"]: stage.get("kind", stage["name"]) for stage in self.scene.get("stage", ())}
        return [name for name in self.stages if kinds.get(name, name) in named(**wanted)]

    def in_real_time(self, stage: str) -> bool | None:
        """Whether a stage computed in real time, with steps in seconds; None if scene.json does not have the stage."""
        from coupler_protocol.scene.tables.stages import is_real

        tables = {table["name"]: table for table in self.scene.get("stage", ())}
        return is_real(tables[stage].get("time", "")) if stage in tables else None

    def has(self, frame: int, rank: int) -> bool:
        """Whether a rank recorded anything at a frame."""
        return rank in self._rows[frame]

    @property
    def windows(self) -> list[int]:
        """Ranks of the discrete side that recorded a frame."""
        return [rank for rank, file in self.files.items() if file.kind == "discrete" and file.frames]

    def recorded(self, rank: int) -> bool:
        """Whether a rank recorded any frame."""
        return rank in self.files and bool(self.files[rank].frames)

    def close(self) -> None:
        """Closes the files; arrays that were read remain valid."""
        for file in self.files.values():
            file.close()
        self._closed = True

    def __enter__(self) -> "Run":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _order_stages(self, end: int | None) -> list[str]:
        """Stages with frames up to the step `end`, in the order of the scene, or else of their first steps."""
        planned = [stage["name"] for stage in self.scene.get("stage", ())]
        first: dict[str, tuple[int, int]] = {}
        for rank, file in self.files.items():
            for info in file.frames:
                if end is not None and info.step > end:
                    break
                first[info.stage] = min(first.get(info.stage, (info.step, rank)), (info.step, rank))
        return sorted(first, key=lambda s: (planned.index(s) if s in planned else len(planned), first[s]))

    def _join_frames(self, end: int | None) -> tuple[list[FrameInfo], list[dict[int, int]]]:
        """All moments in order, up to the step `end`, and for each the row in the file of every rank that recorded it."""
        rows: dict[tuple[int, int], dict[int, int]] = {}
        for rank, file in self.files.items():
            for row, frame in enumerate(file.frames):
                if end is not None and frame.step > end:
                    break
                rows.setdefault((frame.step, self.stages.index(frame.stage)), {})[rank] = row
        moments = [rows[key] for key in sorted(rows)]
        return [self.files[min(moment)].frames[moment[min(moment)]] for moment in moments], moments

    def _first(self) -> int:
        return min(self.files)

    def _file(self, rank: int, kind: str | None = None) -> RankFile | RankParts:
        if rank not in self.files or (kind and self.files[rank].kind != kind):
            there = "; ".join(f"rank {r} has {_ROOM[file.kind]}" for r, file in self.files.items())
            raise NotRecordedError(f"rank {rank} has no {_ROOM[kind] if kind else 'file'} here: {there}")
        return self.files[rank]

    def _row(self, frame: int, rank: int) -> int:
        if not -len(self.frames) <= frame < len(self.frames):
            raise IndexError(f"frame {frame} of {len(self.frames)}")
        if not self.has(frame, rank):
            info = self.frames[frame]
            own = [i for i in range(len(self.frames)) if self.has(i, rank)]
            span = f"its frames lie between {own[0]} and {own[-1]}" if own else "it has no frame"
            raise NotRecordedError(f"rank {rank} recorded nothing at frame {frame} (step {info.step}, {info.stage}); {span}")
        return self._rows[frame][rank]


def _files_of(folder: Path) -> dict[int, RankFile | RankParts]:
    """Files of every rank in a folder, parts in order."""
    ranks: dict[int, dict[int, Path]] = {}
    for path in folder.glob("*.vtkhdf"):
        if match := _RANK_FILE.fullmatch(path.name):
            ranks.setdefault(int(match[1]), {})[int(match[2] or 0)] = path
    ordered = {rank: [parts[number] for number in sorted(parts)] for rank, parts in ranks.items()}
    return {rank: RankFile(paths[0]) if len(paths) == 1 else RankParts(paths) for rank, paths in ordered.items()}


def _first_json(folders: list[Path], name: str) -> dict[str, Any]:
    found = [folder / name for folder in folders if (folder / name).is_file()]
    return run_json.read(found[0]) if found else {}
