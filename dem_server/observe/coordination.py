"""Porosity and coordination number of discs."""

import numpy as np

from coupler_protocol.geometry import polygon_area
from coupler_protocol.interface.ring import inner_share
from dem_server.model import outline
from dem_server.pairs import contacts


def coordination(model, state, inside=None):
    """Mean number of contacts of free discs, and share of them with fewer than three; `inside` (n,) selects discs."""
    pairs = contacts(state)
    number = np.bincount(np.concatenate([pairs.disc_a, pairs.disc_b]), minlength=model.count)
    chosen = np.arange(model.count) >= model.ring
    if inside is not None:
        chosen &= inside
    return float(number[chosen].mean()), float((number[chosen] < 3).mean())


def porosity(model, state):
    """Porosity of the window [-]: free discs and inner shares of the control discs over the enclosed area, from 1."""
    solid = np.pi * state.radius**2
    solid[: model.ring] *= inner_share(state.x[: model.ring], model.surface)
    return 1.0 - float(solid.sum()) / polygon_area(outline(model, state))
