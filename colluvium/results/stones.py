"""Outlines of the stones in a frame: each polygon moved like its discs.

The rigid motion with the best fit to the discs of a stone is their mean displacement and the rotation

    tan(turn) = sum p x q / sum p . q                                            (1)

with p, q their positions relative to their mean at the start and now (exact for clumps, least squares for clusters).
"""

from typing import TYPE_CHECKING

import numpy as np

from colluvium.results.rank_file import Fields

if TYPE_CHECKING:
    from colluvium.results.run import Run


def outlines(run: "Run", frame: int, rank: int = 1) -> list[np.ndarray]:
    """Polygons (V, 2) of all stones in a frame [m]; empty without stones."""
    placed = run.stones(rank)
    if not placed:
        return []
    discs = run.discs(frame, rank)
    return [_moved(outline, discs, discs.stone == k) for k, outline in enumerate(placed)]


def _moved(outline: np.ndarray, discs: Fields, own: np.ndarray) -> np.ndarray:
    if not own.any():
        return outline
    now = discs.xy[own]
    start = now - discs.displacement[own]
    p, q = start - start.mean(axis=0), now - now.mean(axis=0)
    cross = p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]
    turn = np.arctan2(cross.sum(), (p * q).sum())
    R = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    return (outline - start.mean(axis=0)) @ R.T + now.mean(axis=0)
