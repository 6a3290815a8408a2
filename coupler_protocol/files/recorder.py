"""Recording of frames and histories in a separate thread, so that the time loop need not wait.

The caller's cost is a copy of the arrays. HDF5 and gzip work without the interpreter lock, in parallel with the
next steps. At most `QUEUE_FRAMES` frames wait; a loop that records faster than the disk writes is slowed down,
so memory does not grow.

The thread has a lower priority than the loop. Where all cores compute, it takes the moments in which a side waits for the other
one, instead of time slices of the side that is waited for. A loop that waits for the thread leaves its core to it.
"""

import logging
import os
import queue
import sys
import threading
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from coupler_protocol.exits import RunEnded
from coupler_protocol.files.quantities import CRACKS, FIELDS, HISTORIES, quantity
from coupler_protocol.files.vtk_cells import TOPOLOGIES, as_stored
from coupler_protocol.files.vtkhdf import Frame, FrameInfo, VtkHdfFile

__all__ = ["FrameInfo", "Recorder"]

log = logging.getLogger(__name__)
QUEUE_FRAMES = 2
LOWER = 5  # added to the nice value: a third of the share of a thread that computes, enough on a busy machine
LOWEST = 19  # of the nice values of POSIX
_CLOSE = object()

Arrays = Mapping[str, np.ndarray]


class Recorder:
    """One VTKHDF file of one rank.

    `kind` is "continuum" or "discrete"; `attributes` are those of the file's root, `constants` are arrays for all frames,
    `axis` is what ParaView takes for the time of a frame: its "time" or its "step".
    `seconds` is the time that calls have taken, `writer_seconds` the time that the thread has worked.
    """

    def __init__(
        self,
        path: str | Path,
        kind: str,
        title: str = "",
        attributes: Mapping[str, Any] | None = None,
        constants: Arrays | None = None,
        axis: str = "time",
    ) -> None:
        if kind not in TOPOLOGIES:
            raise ValueError(f"kind {kind!r} is not one of {', '.join(TOPOLOGIES)}")
        self.seconds = 0.0
        self.writer_seconds = 0.0
        self._file = VtkHdfFile(Path(path), kind, {"title": title, **(attributes or {})}, constants or {}, axis)
        self._last: Frame | None = None
        self._histories: dict[str, tuple[list[int], list[float]]] = {}
        self._cracks: list[Arrays] = []
        self._failure: Exception | None = None
        self._queue: queue.Queue = queue.Queue(QUEUE_FRAMES)
        self._thread = threading.Thread(target=self._write, name=f"recorder {Path(path).name}", daemon=True)
        self._thread.start()

    def frame(
        self,
        info: FrameInfo,
        *,
        points: np.ndarray,
        cells: np.ndarray,
        point_fields: Arrays,
        cell_fields: Arrays,
    ) -> None:
        """Records one frame.

        continuum: points = reference coordinates (N, 2) [m], cells = gridpoints (Z, 4) of the zones,
        triangles with the last two equal. discrete: points = centres (N, 2) [m], cells = rows (C, 2) of the
        two discs of each contact. The arrays may be changed as soon as this returns.
        """
        start = time.perf_counter()
        frame = Frame(
            FrameInfo(int(info.step), float(info.time), str(info.stage), float(info.gravity_factor)),
            as_stored(points),
            np.array(cells, np.int64, order="C"),
            {name: as_stored(values) for name, values in point_fields.items()},
            {name: as_stored(values) for name, values in cell_fields.items()},
        )
        _check(frame, self._last)
        self._last = frame
        self._put(frame)
        self.seconds += time.perf_counter() - start

    def history(self, step: int, **values: float) -> None:
        """Records values of histories at a step; the next frame, `sync` or `close` writes them to the file."""
        self.histories([step], {name: [value] for name, value in values.items()})

    def histories(self, steps: list[int], values: Mapping[str, list[float]]) -> None:
        """Records values {name: list} of histories at several steps; see `history`."""
        for name, column in values.items():
            if name not in self._histories:
                quantity(HISTORIES, name)
                self._histories[name] = ([], [])
            noted = self._histories[name]
            noted[0].extend(steps)
            noted[1].extend(column)

    def cracks(self, columns: Arrays) -> None:
        """Records breaks of bonds: arrays (k, ..) of all names in quantities.CRACKS, by their steps; see `history`."""
        if set(columns) != set(CRACKS) or len({len(column) for column in columns.values()}) != 1:
            raise ValueError(f"cracks have columns of one length: {', '.join(CRACKS)}")
        self._cracks.append({name: np.array(column, order="C") for name, column in columns.items()})

    def sync(self) -> None:
        """Waits until everything recorded so far is in the file and on the disk."""
        start = time.perf_counter()
        self._put(None)
        self._queue.join()
        self._raise_failure()
        self.seconds += time.perf_counter() - start

    def close(self) -> None:
        """Writes everything that waits and closes the file. A second call does nothing.

        After a failure the file has everything up to the last frame or `sync` before it.
        """
        if not self._thread.is_alive():
            return
        self._queue.put((None, *self._take_rows()))
        self._queue.put(_CLOSE)
        self._thread.join()
        self._raise_failure()

    def __enter__(self) -> "Recorder":
        return self

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> None:
        """Closes the file; what goes wrong now must not hide the error that ends the run."""
        try:
            self.close()
        except Exception as second:
            if error is None:
                raise
            if str(second) != str(error):
                log.info("after the failure also: %s", second)

    def _put(self, frame: Frame | None) -> None:
        self._raise_failure()
        if not self._thread.is_alive():
            raise ValueError("this recorder is closed")
        self._queue.put((frame, *self._take_rows()))

    def _take_rows(self) -> tuple[dict[str, tuple[list[int], list[float]]], list[Arrays]]:
        taken = {name: rows for name, rows in self._histories.items() if rows[0]}
        self._histories.update({name: ([], []) for name in taken})
        cracks, self._cracks = self._cracks, []
        return taken, cracks

    def _raise_failure(self) -> None:
        if isinstance(self._failure, RunEnded):
            raise type(self._failure)(str(self._failure)) from self._failure
        if self._failure is not None:
            raise RuntimeError(f"recording failed: {self._failure}") from self._failure

    def _write(self) -> None:
        """Writes in the thread until closed. After a failure it takes frames and drops them, so that the caller never waits."""
        _lower_priority()
        while (item := self._queue.get()) is not _CLOSE:
            start = time.perf_counter()
            self._try(self._store, *item)
            self.writer_seconds += time.perf_counter() - start
            self._queue.task_done()
        self._try(self._file.close)
        if self._failure is not None:
            self._file.abandon()

    def _try(self, action: Callable[..., None], *args: Any) -> None:
        """Runs `action`; stores its exception, which the caller's next call raises."""
        if self._failure is None:
            try:
                action(*args)
            except Exception as failure:
                self._failure = failure

    def _store(self, frame: Frame | None, histories: dict[str, tuple[list[int], list[float]]], cracks: list[Arrays]) -> None:
        if cracks:  # of many looks, in one call a column
            self._file.append_cracks({name: np.concatenate([columns[name] for columns in cracks]) for name in CRACKS})
        for name, (steps, values) in histories.items():
            self._file.append_history(name, steps, values)
        if frame is None:
            self._file.to_disk()
        else:
            self._file.append(frame)


def _lower_priority() -> None:
    """Lowers the priority of this thread, where threads have priorities of their own."""
    if sys.platform == "linux":
        own = threading.get_native_id()
        os.setpriority(os.PRIO_PROCESS, own, min(os.getpriority(os.PRIO_PROCESS, own) + LOWER, LOWEST))


def _check(frame: Frame, last: Frame | None) -> None:
    """Raises ValueError for a frame that readers could not use, before any of it is written."""
    for fields, rows, what in (
        (frame.point_fields, len(frame.points), "points"),
        (frame.cell_fields, len(frame.cells), "cells"),
    ):
        for name, values in fields.items():
            quantity(FIELDS, name)
            if len(values) != rows:
                raise ValueError(f"field {name!r} has {len(values)} rows, but the frame has {rows} {what}")
    if last is None:
        return
    names, before = ({*f.point_fields, *f.cell_fields} for f in (frame, last))
    if names != before:
        raise ValueError(f"every frame has the same fields; added or missing: {', '.join(sorted(names ^ before))}")
    if frame.info.step < last.info.step or frame.info.time < last.info.time:
        raise ValueError(f"frames come in order of time: {frame.info} after {last.info}")
