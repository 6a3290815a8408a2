"""YADE (Debian: `apt-get install yade`): linear springs of Cundall and Strack, cohesive contacts as bonds."""

import json
from pathlib import Path

import numpy as np

from bench.peers.engine import WARM_UP, Outcome, behind, said_by, version_from

NAME = "YADE"
TRIAL = {False: {"behind": True}, True: {"behind": True}}
DIFFERENCES = (
    "real time instead of static mode, local damping .7 as ours",
    "three-dimensional spheres that keep to a plane, with masses and inertia of discs",
    "bonds: cohesive contacts without moments",
)
SCRIPT = Path(__file__).with_name("yade_script.py")  # what YADE's own Python runs


def version():
    """Release, or None."""
    return behind("version", version_from(["yade", "--version"], "ade version"))


def choices(bonded):
    """Settings worth trying: the margin of the collider's boxes, in smallest radii."""
    return {"margin": ["0.5", "0.3", "0.1"]}


def run(box, steps, settings, trial=False):
    """Take `steps` steps; `trial`: undamped, from the trial's velocities."""
    discs = np.column_stack([box.xy, box.radius, box.mass, box.velocity if trial else 0.0 * box.velocity])
    said = {
        "held": box.held, "normal": box.normal, "shear": box.shear, "friction": box.friction, "dt": box.dt, "steps": steps,
        "bonded": box.bonds is not None, "damping": 0.0 if trial else 0.7, "warm_up": 0 if trial else WARM_UP,
        "strength": box.strength, "margin": float(settings["margin"]),
    }  # fmt: skip
    files = {
        "box.json": json.dumps(said),
        "discs.txt": "\n".join(" ".join(f"{value:.17g}" for value in disc) for disc in discs),
        "script.py": SCRIPT.read_text(encoding="utf-8"),
    }
    _, (found, (seconds,)) = said_by(["yade", "-n", "-x", "-j1", "script.py"], files, ["discs.out", "seconds.out"])
    return Outcome(float(seconds[0]) / steps, found[:, :2], found[:, 2:])
