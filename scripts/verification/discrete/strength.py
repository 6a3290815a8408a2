"""Strength of a hexagonal packing with friction, in biaxial compression.

Rows of equal discs lie in the gaps of the rows below, between four smooth walls. The side walls yield, so discs of one row
separate, and the normals between rows, at the angle alpha from the horizontal (slightly below 60 degrees), carry the whole
load. Each plane between rows cuts two contacts per disc spacing, each vertical plane one per row:

    sigma1 s / 2 = N sin(alpha) + T cos(alpha),   sigma3 h = N cos(alpha) - T sin(alpha),   T = N tan(phi) when all slip

with s the spacing in a row, h between rows, tan(alpha) = 2 h / s. Hence, which is Rowe's stress-dilatancy equation (1962)
sigma1 / sigma3 = tan(alpha) tan(phi + beta) with beta = alpha:

    sigma1 / sigma3 = tan(alpha) tan(alpha + phi),     3 for alpha = 60 degrees without friction

The scene reads seven rows from a file, the outer ones shorter, so that no corner depends on a single contact; floor and top
move by 2.5e-11 m a static step towards each other and the sides apart by twice that: so slowly that no waves reach the walls.
The ratio is largest when every contact between rows slips; after that the packing softens with alpha, and bands form."""

import numpy as np

from verification.discrete import scenes
from verification.verdict_rows import row

NAME = "strength"
R, ROWS, LONG = 0.03, 7, 8
ALPHA = np.radians(59.5)
SPACING, HEIGHT = 4.0 * R * np.cos(ALPHA), 2.0 * R * np.sin(ALPHA)
PRESS, SPEED, STEPS, EVERY = 2e-6, 2.5e-11, 12_000, 200  # overlap at the start over 2 R, speed of floor and top [m a step]
SOIL = {"density": 2000.0, "spring": {"normal": 5e7, "shear": 5e7}}


def lattice(alpha=ALPHA):
    """Centres (n, 2): rows of 7 and 8 discs by turns, the middle at the origin."""
    lines = []
    for k in range(ROWS):
        number = LONG - 1 + k % 2
        lines.append(np.column_stack([SPACING * (np.arange(number) - 0.5 * (number - 1)), np.full(number, k * HEIGHT)]))
    return np.vstack(lines) * (1.0 - PRESS)


def box(xy):
    """Four walls that touch the lattice: floor, right, top, left, and their velocities [m a step]."""
    (x0, y0), (x1, y1) = xy.min(axis=0) - R * (1.0 - PRESS), xy.max(axis=0) + R * (1.0 - PRESS)
    velocity = [[0.0, SPEED], [2.0 * SPEED, 0.0], [0.0, -SPEED], [-2.0 * SPEED, 0.0]]
    far = 0.1 * (y1 - y0)
    ends = ([[x0 - far, y0], [x1 + far, y0]], [[x1, y0 - far], [x1, y1 + far]])
    ends += ([[x1 + far, y1], [x0 - far, y1]], [[x0, y1 + far], [x0, y0 - far]])
    return [{"ends": e, "velocity": v} for e, v in zip(ends, velocity, strict=True)]


def peak(friction):
    """Largest sigma1 / sigma3 of the walls' forces, its closed form at that moment, and the share that slips then."""
    xy = lattice()
    soil = SOIL | ({"friction": {"coefficient": friction}} if friction else {})
    discs = {"soil": soil, "wall": box(xy), "damping": {"local": 0.7}}
    stage = {"name": "press", "kind": "discs", "until": {"steps": STEPS}}
    more = {"ring": {"spring": SOIL["spring"]}, "every": EVERY}
    with scenes.of_file(np.column_stack([xy, np.full(len(xy), R)]), "x,y,radius", [stage], discs, **more) as run:
        return max(measured(run, frame, friction) for frame in range(1, len(run.frames)))


def measured(run, frame, friction):
    """sigma1 / sigma3, its closed form, and the share of contacts that slip, of one frame."""
    discs, contacts = run.discs(frame), run.contacts(frame)
    force, (x, y) = np.abs(discs.wall_force), discs.xy.T
    low, left = y < y.min() + R, x < x.min() + 0.1 * R
    s1 = force[low, 1].sum() / np.count_nonzero(low) / SPACING
    s3 = force[left, 0].sum() / np.count_nonzero(left) / (2.0 * HEIGHT)
    branch = np.abs(np.diff(discs.xy[contacts.ends], axis=1)[:, 0])
    alpha = np.mean(np.arctan2(branch[:, 1], branch[:, 0]))
    slips = 1.0
    if friction:
        slips = np.mean(np.abs(contacts.shear_force) > 0.999 * friction * contacts.normal_force)
    return s1 / s3, np.tan(alpha) * np.tan(alpha + np.arctan(friction)), slips


def rows(fast):
    """Smooth, and three coefficients of friction."""
    source = "Rowe (1962), Proc. R. Soc. A 269, 500-527"
    for friction in (0.0, 0.2) if fast else (0.0, 0.1, 0.2, 0.4):
        found, expected, slips = peak(friction)
        yield row(f"largest sigma1 / sigma3, mu {friction:g}", found, expected, 2e-3, source)
        if friction:
            yield row(f"share of contacts that slip then, mu {friction:g}", slips, 1.0, 0.02, "closed form")
