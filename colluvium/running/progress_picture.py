"""Display of the progress of all processes: a live table on a terminal, plain lines elsewhere."""

import sys
import time
from contextlib import suppress
from typing import Any

from coupler_protocol.process.progress import as_line


class PlainPicture:
    """Lines of text for each process every few seconds and at the end of each stage."""

    def __init__(self, interval: float = 2.0) -> None:
        self.interval = interval
        self._next: dict[int, float] = {}
        self._stage: dict[int, str] = {}
        self._begin = time.monotonic()

    def __enter__(self) -> "PlainPicture":
        return self

    def __exit__(self, *_: object) -> None:
        return None

    def __call__(self, row: dict[str, Any]) -> None:
        """Shows one report."""
        now, rank = time.monotonic(), row["rank"]
        fresh = row["stage"] != self._stage.get(rank) or row["text"].startswith("done")
        if fresh or now >= self._next.get(rank, 0.0):
            self._next[rank], self._stage[rank] = now + self.interval, row["stage"]
            with suppress(OSError):  # the terminal has gone: no reason to end a run
                print(f"{now - self._begin:7.1f} s  {as_line(row)}", file=sys.stderr, flush=True)


class LivePicture:
    """A table with one line for each process, redrawn in place."""

    def __init__(self) -> None:
        from rich.console import Console
        from rich.live import Live

        self.rows: dict[int, dict[str, Any]] = {}
        self._begin = time.monotonic()
        self.live = Live(console=Console(stderr=True), refresh_per_second=8, transient=False)

    def __enter__(self) -> "LivePicture":
        self.live.__enter__()
        return self

    def __exit__(self, *error: Any) -> None:
        self.live.__exit__(*error)

    def __call__(self, row: dict[str, Any]) -> None:
        """Shows one report."""
        self.rows[row["rank"]] = row
        self.live.update(self._table())

    def _table(self) -> Any:
        from rich.table import Table

        table = Table(title=f"{time.monotonic() - self._begin:.0f} s", title_justify="left")
        for name in ("process", "stage", "step", "gravity", "ratio", ""):
            table.add_column(name, justify="right" if name in ("step", "gravity", "ratio") else "left")
        for rank, row in sorted(self.rows.items()):
            steps = f"{row['step']}/{row['of']}" if row["of"] else str(row["step"] or "")
            factor = "" if row["factor"] is None else f"{row['factor']:.2f}"
            ratio = "" if row["ratio"] is None else f"{row['ratio']:.1e}"
            name = "continuum" if rank == 0 else f"discs {rank}"
            table.add_row(name, row["stage"], steps, factor, ratio, row["text"])
        return table


def picture(quiet: bool) -> "PlainPicture | LivePicture | None":
    """LivePicture if standard error is a terminal, else PlainPicture; None if `quiet`."""
    if quiet:
        return None
    return LivePicture() if sys.stderr.isatty() else PlainPicture()
