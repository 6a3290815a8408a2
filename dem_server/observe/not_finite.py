"""The first disc with numbers that are NaN or infinite, in words."""

import numpy as np

from coupler_protocol.geometry import NOWHERE, spot
from dem_server.model import FX, FY, MOMENT, SPIN, VX, X, Y

COLUMNS = ("position", slice(X, Y + 1)), ("velocity", slice(VX, SPIN + 1))


def first_not_finite(model, state, origin=NOWHERE):
    """Text of what is not finite, of which disc and where, "" if all discs are sound. The place: of the last list of pairs.

    origin (2,) [m]: point of the scene from which positions count.
    """
    parts = [(name, state.disc[:, columns]) for name, columns in COLUMNS]
    parts.append(("force", state.load[:, [FX, FY, MOMENT]]))
    for name, values in parts:
        wrong = np.flatnonzero(~np.isfinite(values).all(axis=1))
        if len(wrong):
            disc, others = int(wrong[0]), f", and of {len(wrong) - 1} more," if len(wrong) > 1 else ""
            kind = "control disc" if disc < model.ring else "disc"
            return f"the {name} of {kind} {disc} near {spot(state.listed_at[disc], origin)}{others} is NaN or infinite"
    return ""
