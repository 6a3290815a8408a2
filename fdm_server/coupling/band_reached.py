"""Whether the band has come as far as a stage waits for (`until.band`), from what both sides know at a frame."""

import numpy as np

from coupler_protocol.criteria import shear_band, shear_band_states
from fdm_server.mesh.grid import areas
from fdm_server.observe import fields


def bin_length(scene, grid):
    """Length [m] of the bins in which windows say their strain: that of a zone; None where no stage waits for a band."""
    if not any(stage.until and stage.until.band for stage in scene.stage):
        return None
    return float(np.sqrt(np.median(areas(grid.xy, grid.zones))))


class BandWatch:
    """Looks for one state of the band ("enters", "through", "complete") at every frame of a stage."""

    def __init__(self, wanted, grid):
        self.wanted = wanted
        self._surface = shear_band.ground(grid.xy, grid.zones)

    def reached(self, model, state, rims):
        """Reason to end, or "". rims: of the windows that are open; they have heard the strain of their discs."""
        windows = [(rim.talk.rank, *rim.talk.strain()) for rim in rims]
        cells = shear_band.cells(model.grid.xy, model.zones, fields.shear_strain(model, state), windows)
        return f"band {self.wanted}" if shear_band_states.holds(self.wanted, cells, self._surface) else ""
