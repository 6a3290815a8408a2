"""The linearised step of grid and windows in one process: its exact limit and the object that sets it.

Components in order: x, y of all gridpoints, then x, y, rotation of every window's bodies. Springs of a window add their stiffness
to the gridpoints of its rim and to its bodies; held components have infinite mass. Under local damping each side counts with
M / (1 + alpha), with its own alpha (coupler_protocol/criteria/stable_step.py, Eq (1)), so that the step is stable up to
omega^2 dt^2 = 4.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import scipy

from coupler_protocol.criteria.stable_step import Limit, highest, limit, stiffness_matrix
from coupler_protocol.scene.local_origin import in_the_scene


class Window(NamedTuple):
    """One window: gridpoints (K,) of its rim, and model, state and rim of its discs (dem_server)."""

    nodes: np.ndarray
    model: Any
    state: Any
    rim: Any


def operator(model: Any, state: Any, windows: Sequence[Window]) -> tuple[Any, np.ndarray]:
    """K (d, d) [N/m], sparse, and masses over 1 + alpha (d,) [kg] of the step of a grid (fdm_server) and its windows."""
    from dem_server.observe.stable_limit import bodies_of, springs_of
    from fdm_server.observe import stable_limit
    from fdm_server.step.present_shape import masses

    K = stable_limit.stiffness_matrix(model, stable_limit.zone_stiffness(model, state))
    mass = np.repeat(masses(model, state) + state.added_mass, 2)
    held = model.fixed.ravel() if state.driven is None else model.fixed.ravel() | (state.driven != 0.0).ravel()
    parts = [np.where(held, np.inf, mass / (1.0 + _grid_alpha(model)))]
    for window in windows:
        bodies = bodies_of(window.model, window.state)
        own = np.column_stack([bodies.mass, bodies.mass, bodies.inertia]).ravel()
        parts.append(own / (1.0 + _disc_alpha(window.model)))
        K = _joined(K, stiffness_matrix(springs_of(window.model, window.state, window.rim)), window.nodes, len(own))
    return K, np.concatenate(parts)


def _joined(K: Any, more: Any, nodes: np.ndarray, own: int) -> Any:
    """K with the stiffness of springs between the gridpoints `nodes` and `own` new components."""
    before = K.shape[0]
    place = np.concatenate([np.column_stack([2 * nodes, 2 * nodes + 1]).ravel(), before + np.arange(own)])
    more, size = scipy.sparse.coo_array(more), before + own
    row, column = more.coords
    wide = scipy.sparse.csr_array((more.data, (place[row], place[column])), shape=(size, size))
    return scipy.sparse.block_diag([K, scipy.sparse.csr_array((own, own))], format="csr") + wide


def _grid_alpha(model: Any) -> float:
    return model.law.damping or model.law.combined or 0.0


def _disc_alpha(model: Any) -> float:
    return 0.0 if model.law.damping is None else model.law.damping.local


def exact_limit(model: Any, state: Any, windows: Sequence[Window]) -> Limit:
    """Limit of the step (criteria.stable_step.limit) by Lanczos, with the object that moves most in its mode."""
    K, mass = operator(model, state, windows)
    omega2, mode = highest(K, mass)
    return limit(omega2, 0.0, state.dt, *_largest(model, state, windows, np.where(mode != 0.0, mass, 0.0) * mode**2))


def _largest(model: Any, state: Any, windows: Sequence[Window], energy: np.ndarray) -> tuple[str, np.ndarray]:
    """Name and position in the scene [m] of the object with the largest share of a mode's kinetic energy (d,)."""
    from dem_server.observe.stable_limit import bodies_of
    from fdm_server.step.present_shape import present

    points = 2 * len(model.grid.xy)
    share = energy[:points].reshape(-1, 2).sum(axis=1)
    best = int(np.argmax(share))
    rims = {int(n) for window in windows for n in window.nodes}
    found = share[best], "node" if best in rims else "gridpoint", present(model, state)[best]
    for window in windows:
        bodies = bodies_of(window.model, window.state)
        share = energy[points : points + 3 * len(bodies.mass)].reshape(-1, 3).sum(axis=1)
        points += 3 * len(bodies.mass)
        best = int(np.argmax(share))
        found = max(found, (share[best], bodies.name(best), bodies.xy[best]), key=lambda entry: entry[0])
    return found[1], in_the_scene(found[2], model.grid.origin)
