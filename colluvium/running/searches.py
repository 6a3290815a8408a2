"""Searches for a factor of safety in processes of their own, of grid and discs where a scene couples them."""

import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from colluvium.running.processes import GRACE
from coupler_protocol import exits
from coupler_protocol.files import run_json

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
