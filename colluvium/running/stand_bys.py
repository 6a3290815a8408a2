"""Servers that stand by while this process reads and checks their scene (coupler_protocol.process.stand_by)."""

import re
import subprocess
import sys
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from types import TracebackType

from coupler_protocol.process import stand_by

Server = subprocess.Popen[str]


def start(module: str, words: Sequence[str]) -> Server:
    """Starts a module of this project as a child with three pipes."""
    return subprocess.Popen(
        [sys.executable, "-P", "-m", module, *words],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,  # Ctrl-C reaches only the launcher, which stops both sides
    )


def expected(scene: str | Path) -> list[str]:
    """Servers that a scene file will need, as far as its text tells before it is read; a wrong guess costs a process."""
    try:
        text = Path(scene).read_text(encoding="utf-8") if Path(scene).is_file() and Path(scene).suffix == ".toml" else ""
    except (OSError, UnicodeDecodeError):  # for the reader of scenes to report
        return []
    grid, windows = (re.search(rf"^\s*\[+{table}\b", text, re.MULTILINE) for table in ("grid", "window"))
    return [name for name, needed in (("fdm_server", grid), ("dem_server", windows or (text and not grid))) if needed]


class StandBys:
    """One server of each module. At the end of the `with` block, those that got no order are killed: they have begun nothing."""

    def __init__(self, modules: Sequence[str]) -> None:
        self._waiting = {module: start(module, [stand_by.OPTION]) for module in modules}

    def order(self, module: str, words: Sequence[str]) -> Server | None:
        """The server of a module, which gets its arguments; None if there is none, or if it has failed."""
        server = self._waiting.pop(module, None)
        if server is None or server.stdin is None:
            return None
        try:
            server.stdin.write(stand_by.as_line(words))
            server.stdin.flush()
        except OSError:
            _discard(server)
            return None
        return server

    def __enter__(self) -> "StandBys":
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        for server in self._waiting.values():
            _discard(server)
        self._waiting.clear()


def _discard(server: Server) -> None:
    """Ends a server that has begun nothing."""
    server.kill()
    server.wait()
    for pipe in (server.stdin, server.stdout, server.stderr):
        if pipe is not None:
            with suppress(OSError):  # an order that could not be written
                pipe.close()
