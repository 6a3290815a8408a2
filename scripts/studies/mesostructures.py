"""Draw the paper's Figure 7: stone contents of .30, .60, .45 and .45 in its window.

python scripts/studies/mesostructures.py [SCENE] [PNG]
"""

import sys

import numpy as np

from colluvium.figures.mesostructure import draw_side_by_side
from coupler_protocol.scene.reader import read_scene
from dem_server.stones.mesostructure import draw

CONTENTS = (0.30, 0.60, 0.45, 0.45)


def main(scene="configs/paper_slope.toml", png="mesostructures.png"):
    """One picture of four mesostructures of the scene's first window, each from a seed of its own."""
    scene = read_scene(scene)
    (dx, dy), window = scene.grid.zone_size, scene.window[0]
    (left, right), (low, high) = window.columns, window.rows
    x, y = np.array([left, right + 1]) * dx, np.array([low, high + 1]) * dy
    corners = np.array([[x[0], y[0]], [x[1], y[0]], [x[1], y[1]], [x[0], y[1]]])
    structures = []
    for number, content in enumerate(CONTENTS):
        found = draw(corners, scene.stones.model_copy(update={"content": content}), np.random.default_rng([scene.seed, number]))
        structures.append(found.outlines)
        print(f"C {found.area / ((x[1] - x[0]) * (y[1] - y[0])):.6f}, {len(found.size)} stones, {found.sweeps} sweeps")
    draw_side_by_side(corners, structures).savefig(png)


if __name__ == "__main__":
    main(*sys.argv[1:])
