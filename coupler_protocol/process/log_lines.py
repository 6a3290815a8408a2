"""Lines of a log: each has time, level, run, rank, machine, stage and step, also each line of a text with several.

    2026-11-30 14:02:11,301 INFO [run 3f2a9c1e77b0, rank 1, office, stage couple, step 1250] continues from ...

The step is that of the run. Before the handshake a discrete process does not know the run: its number is then "-".
"""

import logging
import platform

from coupler_protocol.process.progress import Progress


class PlacedFormatter(logging.Formatter):
    """Puts the place of a process in front of every line."""

    def __init__(self, progress: Progress) -> None:
        super().__init__("%(message)s")
        self._progress, self._host = progress, platform.node()

    def format(self, record: logging.LogRecord) -> str:
        """The lines of a record."""
        where = self._progress
        place = f"run {where.run}, rank {where.rank}, {self._host}, stage {where.stage}, step {where.steps}"
        head = f"{self.formatTime(record)} {record.levelname} [{place}] "
        return "\n".join(head + line for line in super().format(record).split("\n"))
