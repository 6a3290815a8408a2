"""A slope computed under several laws, for tests that run it compiled and interpreted.

    python -m tests.fdm_server.step.computed_laws FOLDER CASE ...

Writes FOLDER/CASE.npz with all that the state holds, and prints {case: [unbalanced ratio, zones that have yielded]} as JSON.
"""

import json
import sys
from pathlib import Path

import numpy as np

from fdm_server.effects.damping import Damping
from fdm_server.effects.mohr_coulomb import MohrCoulomb
from fdm_server.effects.rayleigh import RayleighTable
from fdm_server.effects.softening import Softening
from fdm_server.ground.removed_zones import cut_window
from fdm_server.mesh.grid import build_grid
from fdm_server.mesh.window_zones import window_zones
from fdm_server.model import build_model, new_state, places
from fdm_server.observe.energy_ledger import Ledger
from fdm_server.step import clock
from fdm_server.step.gridpoint_pass import unbalanced_ratio, update_velocities
from fdm_server.step.present_shape import begin_large_strain
from fdm_server.step.zone_pass import advance
from tests.fdm_server.grid_cases import material, slope, window


def compute(case, folder):
    """Unbalanced ratio and number of yielded zones after some steps; a window is cut out on the way, but for the ledger."""
    scene = slope(2.0, [(0, 4), (4, 4), (12, 12), (20, 12)])
    kind, strain = case.split()
    softening = Softening(strain=[1e-4, 1e-3], cohesion=[1e3, 0.0], friction=[15, 12]) if kind == "softening" else None
    scene.material[0] = material(mohr_coulomb=MohrCoulomb(friction=20, cohesion=2e3, dilation=5), softening=softening)
    scene.damping = Damping(combined=0.5) if kind == "softening" else scene.damping
    model = build_model(scene, build_grid(scene))
    state = new_state(model)
    if kind == "rayleigh":
        model = clock.begin(model, state, Damping(rayleigh=RayleighTable(fraction=0.1, frequency=50.0)), 0.5)
    if strain == "large":
        begin_large_strain(model, state)
    ledger = Ledger(model, state) if kind == "ledger" else None
    values = {}
    for step in range(40 if ledger else 60):
        if ledger:
            ledger.copy_before_step(state)
            update_velocities(model, state, 9.81)
            ledger.book_motion(model, state, 9.81)
            values = {f"energy_{name}": value for name, value in ledger.values(model, state).items()}
            advance(model, state)
            ledger.book_strain(model, state)
            continue
        if step == 40:
            mask = window_zones(model.grid, window((5, 6), (1, 2)))
            model, state, reaction = cut_window(model, state, mask)
            state.applied += reaction.under(9.81)
        update_velocities(model, state, 9.81)
        advance(model, state)
    ratio, yielded = unbalanced_ratio(model, state, 9.81), int(np.count_nonzero(state.plastic))
    arrays = {n: v for n in places() if isinstance(v := getattr(state, n), np.ndarray | int | float)}
    np.savez(folder / f"{case}.npz", **arrays, **values)
    return float(ratio), yielded


if __name__ == "__main__":
    print(json.dumps({case: compute(case, Path(sys.argv[1])) for case in sys.argv[2:]}))
