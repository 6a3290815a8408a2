"""Status of a process for people: `NAME.now.json` in its run directory, written every few seconds and at its end.

A reader never meets half a file, because it is renamed into its place. It is for people only: no run reads it.
"""

import json
import os
from contextlib import suppress
from pathlib import Path
from typing import Any

ENDING = "now.json"
RUNNING, WAITING, FINISHED, STOPPED, FAILED = "running", "waiting", "finished", "stopped", "failed"
ENDED = (FINISHED, STOPPED, FAILED)


def write(folder: str | Path, name: str, content: dict[str, Any]) -> None:
    """Writes the status of the process `name`. A folder that cannot be written is no reason to end a run."""
    path = Path(folder) / f"{name}.{ENDING}"
    new = path.with_name(f"{path.name}.new")
    with suppress(OSError):
        try:
            new.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
            os.replace(new, path)
        except OSError:
            new.unlink(missing_ok=True)
            raise


def read(path: str | Path) -> dict[str, Any]:
    """Content of a status file; {} for one that cannot be read."""
    with suppress(OSError, ValueError):
        content = json.loads(Path(path).read_text(encoding="utf-8"))
        if isinstance(content, dict):
            return content
    return {}


def in_folder(folder: str | Path) -> dict[str, dict[str, Any]]:
    """Status {name: content} of all processes that wrote into a folder, the grid first."""
    paths = sorted(Path(folder).glob(f"*.rank*.{ENDING}"), key=lambda path: int(path.name.split(".rank")[1].split(".")[0]))
    return {path.name.removesuffix(f".{ENDING}"): read(path) for path in paths}
