"""What every engine's file offers, and how it is started: one process, one thread, in a folder that is thrown away.

A file of an engine has NAME, DIFFERENCES (of its set-up from ours, in words), TRIAL (by whether there are bonds: how our own
discs must start the trial to be comparable, see box.py), `version()` (None if it is not installed), `choices(bonded)`
(settings worth trying, the usual one first; {} if it has no such bonds) and `run(box, steps, settings, trial)`, which returns
an Outcome.
"""

import os
import subprocess
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import numpy as np

WARM_UP = 50  # steps before the timed ones
RADII = 0.0225  # smallest radius of the boxes [m], the unit of all skins


class Outcome(NamedTuple):
    """Seconds of one step; positions (n, 2) [m] at the end, velocities (n, 2) [m/s] half a step before it."""

    seconds: float
    xy: np.ndarray
    velocity: np.ndarray


class PeerError(RuntimeError):
    """An engine that is there but did not do what it was asked."""


def said_by(words, files, wanted=(), skip=0):
    """Run `words` in a folder that holds `files` (name: text).

    Returns what it said, and the `wanted` arrays it wrote, each after `skip` lines. Raises PeerError.
    """
    with TemporaryDirectory() as folder:
        for name, text in files.items():
            (Path(folder) / name).write_text(text, encoding="utf-8")
        single = {name: "1" for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")}
        root = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}  # containers
        said = {"capture_output": True, "text": True, "errors": "replace"}  # engines speak in other encodings too
        done = subprocess.run(words, cwd=folder, env=os.environ | single | root, check=False, **said)
        missing = [name for name in wanted if not (Path(folder) / name).exists()]
        if done.returncode or missing:
            said = (done.stdout + done.stderr).strip().splitlines()[-3:]
            raise PeerError(f"{Path(words[0]).name}: exit {done.returncode}; " + " | ".join(said))
        return done.stdout, [np.loadtxt(Path(folder) / name, ndmin=2, skiprows=skip) for name in wanted]


def behind(word, said):
    """What stands behind `word` in `said`, up to a comma; None if nothing was said."""
    return said and said.partition(word)[2].split(",")[0].strip(" :-")


def version_from(words, marker):
    """The first line with `marker` that a program says of itself; None if there is no such program. Its logs are thrown away."""
    try:
        with TemporaryDirectory() as folder:
            done = subprocess.run(words, cwd=folder, capture_output=True, text=True, timeout=60, check=False)
    except OSError:
        return None
    return next((line.strip() for line in (done.stdout + done.stderr).splitlines() if marker in line), None)
