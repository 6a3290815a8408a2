"""Stones follow the distributions of the scene.

Stones of content 0.3 with a gap of 0.03 m, sizes lognormal of mean 0.25 m and sigma 0.35 between 0.12 and 0.6 m, flatness 1 to
1.8, in a window of 4 m by 4 m with an oblique side; statistics of their polygons over several seeds:

    content = sum of areas / area of the window
    mean size of the truncated distribution,     mean flatness 1.4 (root of the ratio of principal moments)
    Rayleigh's test of the azimuths: z = S (mean cos 2a)^2 + S (mean sin 2a)^2, of uniform ones exp(-z) is uniform on [0, 1]

Sizes are scaled slightly so that the content is exact. Tolerances are 3.5 standard errors for this number of stones.
"""

import numpy as np
import scipy.stats
import shapely

from coupler_protocol.geometry import moments
from coupler_protocol.scene.tables.stones import Stones
from dem_server.stones.mesostructure import draw
from verification.verdict_rows import row

NAME = "statistics"
WINDOW = np.array([[0.0, 0.0], [4.0, 0.0], [3.6, 4.0], [0.0, 4.0]])
MEAN, SIGMA, SMALLEST, LARGEST, CONTENT = 0.25, 0.35, 0.12, 0.6, 0.3
SIZE = {"mean": MEAN, "sigma": SIGMA, "min": SMALLEST, "max": LARGEST}


def stones_of(seed):
    """Content, and sizes, flatness and azimuths (S,) of the polygons of one seed; least gap."""
    table = Stones(content=CONTENT, size=SIZE, flatness=(1.0, 1.8), gap=0.03)
    outlines = draw(WINDOW, table, np.random.default_rng(seed)).outlines
    found = [moments(outline) for outline in outlines]
    area = np.array([m.area for m in found])
    value, axis = np.linalg.eigh(np.array([m.second for m in found]))
    long = axis[:, :, 1]
    shapes = shapely.polygons([shapely.linearrings(outline) for outline in outlines])
    tree = shapely.STRtree(shapes)
    a, b = tree.query(shapely.buffer(shapes, 0.029), predicate="intersects")
    touching = np.count_nonzero(a != b) + np.count_nonzero(~shapely.contains(shapely.Polygon(WINDOW).buffer(-0.029), shapes))
    content = area.sum() / shapely.Polygon(WINDOW).area
    return content, np.sqrt(4.0 * area / np.pi), np.sqrt(value[:, 1] / value[:, 0]), np.arctan2(long[:, 1], long[:, 0]), touching


def cut_off():
    """Mean and standard deviation [m] of the lognormal distribution between the limits."""
    mu = np.log(MEAN) - 0.5 * SIGMA**2
    low, high = (np.log(limit) - mu for limit in (SMALLEST, LARGEST))
    moment = [
        np.exp(k * mu + 0.5 * (k * SIGMA) ** 2)
        * np.diff(scipy.stats.norm.cdf([low / SIGMA - k * SIGMA, high / SIGMA - k * SIGMA]))[0]
        / np.diff(scipy.stats.norm.cdf([low / SIGMA, high / SIGMA]))[0]
        for k in (1, 2)
    ]
    return moment[0], np.sqrt(moment[1] - moment[0] ** 2)


def rows(fast):
    """Ten seeds (fast: three)."""
    found = [stones_of(seed) for seed in range(3 if fast else 10)]
    for seed, (content, *_) in enumerate(found[:3]):
        yield row(f"content, seed {seed}", content, CONTENT, 1e-9, "as asked for")
    near = sum(touching for *_, touching in found)
    yield row("stones nearer than 0.029 m to another or the edge", near, 0.0, 0.0, "as asked for")
    size, flatness, azimuth = (np.concatenate([part[k] for part in found]) for k in (1, 2, 3))
    count = len(size)
    mean, deviation = cut_off()
    yield row(f"mean size of {count} stones [m]", size.mean(), mean, 3.5 * deviation / mean / count**0.5, "cut-off lognormal")
    yield row("their standard deviation [m]", size.std(ddof=1), deviation, 3.5 / (2.0 * count) ** 0.5 * 1.5, "cut-off lognormal")
    yield row("mean flatness", flatness.mean(), 1.4, 3.5 * 0.8 / 12.0**0.5 / 1.4 / count**0.5, "uniform")
    chance = np.exp(-count * np.abs(np.exp(2j * azimuth).mean()) ** 2)
    yield row("chance of azimuths less even than these", chance, 1.0, [-0.999, 0.0], "Rayleigh's test")
