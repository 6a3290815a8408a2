"""Observed orders of convergence."""

import numpy as np


def order(sizes, errors):
    """Observed order p of error ~ size^p: slope of the straight line through the logarithms (None: fewer than two errors > 0)."""
    sizes, errors = np.asarray(sizes, dtype=np.float64), np.abs(np.asarray(errors, dtype=np.float64))
    use = (errors > 0.0) & np.isfinite(errors)
    if use.sum() < 2:
        return None
    return float(np.polyfit(np.log(sizes[use]), np.log(errors[use]), 1)[0])
