"""A search for a factor of safety that ends with its parent process: `python -m colluvium.ensemble.search SCENE --out DIR`."""

import argparse
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from colluvium.running.processes import GRACE
from colluvium.safety import command as safety
from coupler_protocol import exits
from coupler_protocol.files import run_json
from coupler_protocol.process import command_line

NAME = "colluvium.ensemble.search"
LOOK = 0.2  # [s]


def run(scene: Path, out: Path, asked: Callable[[], bool]) -> int:
    """Searches in a process of its own; returns its exit code. asked: whether to stop."""
    words = [
        sys.executable,
        "-P",
        "-m",
        NAME,
        str(scene),
        "--out",
        str(out),
        "--at-once",
        "1",
        "--quiet",
        "--no-pictures",
        "--json",
    ]
    process = subprocess.Popen([*words, os.devnull], stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, start_new_session=True)
    try:
        while True:
            try:
                return process.wait(LOOK)
            except subprocess.TimeoutExpired:
                if asked():
                    process.send_signal(signal.SIGINT)
                    return process.wait(2.0 * GRACE)
    finally:
        process.kill()
        process.communicate()


def value_of(out: Path) -> tuple[float, float]:
    """(factor, half the width of its bracket) of a search: of grid and discs where there are discs; raises LookupError."""
    try:
        found = run_json.read_search(out / "fos.json")
    except (OSError, exits.RunEnded) as error:
        raise LookupError(str(error)) from None
    best: dict[str, Any] = found.get("coupled") or found["meshes"][-1]
    return float(best["value"]), 0.5 * (float(best["high"]) - float(best["low"]))


def main(argv: Sequence[str] | None = None) -> int:
    """Entry point; returns the exit code."""
    threading.Thread(target=_end_with_parent, name="tether", daemon=True).start()
    parser = argparse.ArgumentParser(prog=NAME)
    safety.add_command(parser.add_subparsers(required=True))
    options = parser.parse_args(["fos", *(sys.argv[1:] if argv is None else argv)])
    codes: list[int] = []
    ended = command_line.exit_code_of(NAME, lambda: codes.append(options.work(options)))
    return ended or next(iter(codes), exits.DONE)


def _end_with_parent() -> None:
    """Stops the search as Ctrl-C does once standard input closes."""
    while os.read(0, 4096):
        pass
    os.kill(os.getpid(), signal.SIGINT)


if __name__ == "__main__":
    sys.exit(main())
