"""Watch for the state of the band that ends a stage (`until.band`), from zones and bins at frames."""

import numpy as np

from coupler_protocol.criteria import shear_band, shear_band_states
from fdm_server.mesh.grid import areas
from fdm_server.observe import fields


def bin_length(scene, grid):
    """Length [m] of the bins for the strain of windows, that of a zone; None if no stage ends by a band."""
    if not any(stage.until and stage.until.band for stage in scene.stage):
        return None
    return float(np.sqrt(np.median(areas(grid.xy, grid.zones))))


class BandWatch:
    """Watch for one state of the band ("enters", "through", "complete") at every frame of a stage."""

    def __init__(self, wanted, grid):
        self.wanted = wanted
        self._surface = shear_band.ground(grid.xy, grid.zones)

    def reached(self, model, state, rims):
        """Reason to end, or "". rims: of the open windows; the last FORCE of each contained the strain of its discs."""
        windows = [(rim.talk.rank, *rim.talk.strain()) for rim in rims]
        cells = shear_band.cells(model.grid.xy, model.zones, fields.shear_strain(model, state), windows)
        return f"band {self.wanted}" if shear_band_states.holds(self.wanted, cells, self._surface) else ""
