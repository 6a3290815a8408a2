"""A scene for the laboratory, and curves of given materials."""

import numpy as np

from colluvium.lab.curves import COLUMNS, Curve
from coupler_protocol.scene.reader import build_scene

SOIL = {
    "density": 2000.0,
    "spring": {"normal": 5e7, "shear": 2e7},
    "friction": {"coefficient": 0.55},
    "bond": {"tension": 1.5e3, "shear": 3.5e3},
}
STONE = SOIL | {"spring": {"normal": 5e8, "shear": 5e8}}
STONES = {"content": 0.4, "size": {"mean": 0.2, "sigma": 0.3, "min": 0.12, "max": 0.4}}


def scene_of(lab, discs=None, **more):
    """A scene of discs alone with the table `lab`."""
    tables = {
        "format": 1,
        "seed": 1,
        "window": [{"name": "box", "polygon": [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]}],
        "discs": {"radius": 0.03, "soil": SOIL} | (discs or {}),
        "lab": lab,
        "stage": [{"name": "fill"}, {"name": "rest", "kind": "discs", "until": {"steps": 10}}],
    }
    return build_scene(tables | more)


def curve_with(turn=None, **columns):
    """A Curve with these columns, the others zero."""
    length = len(columns["strain"])
    found = {name: np.asarray(columns.get(name, np.zeros(length)), dtype=float) for name in COLUMNS}
    return Curve(found, length - 1 if turn is None else turn)
