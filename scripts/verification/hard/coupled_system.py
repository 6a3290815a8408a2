"""Small bonded systems of grid and discs for the linearised step: no contact opens or slips, none carries a force at first."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from colluvium.forecast import linearised_step, step_limits
from coupler_protocol.criteria.stable_step import highest
from coupler_protocol.interface.ring import build_ring
from coupler_protocol.scene.reader import build_scene
from dem_server.coupling.rim import Rim
from dem_server.effects.bond import BONDED
from dem_server.model import build_model as build_discs
from dem_server.packing.packing import Packing
from dem_server.pairs import contacts
from dem_server.step.contact_pass import contact_forces
from dem_server.step.motion import move_free
from dem_server.step.neighbours import rebuild
from fdm_server.ground.removed_zones import cut_window
from fdm_server.mesh.grid import build_grid
from fdm_server.mesh.window_zones import rim_of, window_zones
from fdm_server.model import build_model, new_state
from fdm_server.step.gridpoint_pass import update_velocities
from fdm_server.step.zone_pass import advance

BULK, SHEAR = 1e8, 0.6e8  # of the zones [Pa]
MODULUS = BULK + 4.0 / 3.0 * SHEAR
STRONG = 1e30
BOX = {"kind": "box", "length": 8.0, "height": 8.0, "zone_size": 1.0}
RING = {"kind": "ring", "part": "quarter", "inner": 1.0, "outer": 6.0, "around": 8, "growth": 1.1}
SQUARE = [(2.0, 2.0), (6.0, 2.0), (6.0, 6.0), (2.0, 6.0)]
SECTOR = [(r * np.cos(a), r * np.sin(a)) for r, turn in ((2.3, 1), (4.0, -1)) for a in np.linspace(0.35, 1.2, 9)[::turn]]


class System(NamedTuple):
    """Grid and windows in one process."""

    model: object
    state: object
    windows: list

    def step(self, gravity=0.0):
        """One step of the coupled scheme; `gravity` [m/s2] acts on the discs alone."""
        model, state = self.model, self.state
        for window in self.windows:
            state.applied[window.nodes] = window.rim.nodal_forces(window.state)
        update_velocities(model, state, 0.0)
        for window in self.windows:
            move_free(window.model, window.state, gravity)
            window.rim.move(window.state, state.velocity[window.nodes])
        advance(model, state)
        for window in self.windows:
            contact_forces(window.model, window.state)

    def speed(self):
        """Largest velocity of a gridpoint or disc [m/step]."""
        return max(float(np.abs(v).max()) for v in (self.state.velocity, *(window.state.v for window in self.windows)))


def system(stiffness, size, damping, shear=0.4, oblique=False, **tables):
    """System with a window full of discs of `size` zones; stiffness: of contacts over moduli of zones; shear: ks over kn.

    tables: of the scene, instead of those below.
    """
    model, state, windows = step_limits.open_model(scene(stiffness, size, damping, shear, oblique, **tables))
    for window in windows:
        freeze(window)
        state.added_mass[window.nodes] = window.rim.stiffness_sums(window.model, window.state)
    return System(model, state, windows)


def with_few_discs(place, stiffness, size, damping, shear=0.4, frozen=True, **scene_of):
    """The same box with some discs in its window; place(ring) says where: (m, 2) [m], radii (m,) [m]. scene_of: of `scene`.

    frozen: contacts are bonded and carry no force.
    """
    case = scene(stiffness, size, damping, shear, **scene_of)
    grid = build_grid(case)
    model, mask = build_model(case, grid), window_zones(grid, case.window[0])
    model, state, _ = cut_window(model, new_state(model), mask)
    nodes = rim_of(grid, mask)
    ring = build_ring(grid.xy[nodes], size)
    discs, packed = build_discs(ring.xy, ring.radius, Packing(*place(ring)), case.discs)
    contact_forces(discs, packed)
    window = linearised_step.Window(nodes, discs, packed, Rim(ring, "work-consistent"))
    if frozen:
        freeze(window)
    state.added_mass[nodes] = window.rim.stiffness_sums(discs, packed)
    return System(model, state, [window])


def scene(stiffness, size, damping, shear=0.4, oblique=False, **tables):
    """Scene of a box or a sector of a ring with one window; tables: instead of those below."""
    spring = {"normal": 2.0 * stiffness * MODULUS, "shear": 2.0 * shear * stiffness * MODULUS}
    soil = {"density": 2000.0, "spring": spring, "bond": {"tension": STRONG, "shear": STRONG}}
    sides = ("left", "bottom", "inner", "outer") if oblique else ("left", "right", "bottom", "top")
    return build_scene({
        "format": 1,
        "seed": 1,
        "grid": RING if oblique else BOX,
        "material": [{"name": "rock", "density": 2700.0, "elastic": {"bulk": BULK, "shear": SHEAR}}],
        "boundary": [{"on": side, "fix": "xy"} for side in sides],
        "damping": {"local": damping},
        "window": [{"name": "hole", "polygon": SECTOR if oblique else SQUARE}],
        "discs": {"radius": size, "confinement": 1e-3 * stiffness * MODULUS, "damping": {"local": damping}, "soil": soil},
        "stage": [
            {"name": "equilibrium", "gravity": 0.0, "until": {"steps": 1}},
            {"name": "fill"},
            {"name": "couple", "until": {"steps": 1}},
        ],
    } | tables)  # fmt: skip


def freeze(window):
    """Bond all contacts and leave no force in them."""
    state, pairs = window.state, contacts(window.state)
    state.reference_gap[pairs.slot] += pairs.gap
    state.bond_state[pairs.slot] = BONDED
    state.shear[:] = 0.0
    rebuild(window.model, state)
    contact_forces(window.model, state)


def at_share(found, share):
    """The system with all masses changed by one factor such that its step is `share` of the exact limit, and the mode at it."""
    omega2, mode = highest(*linearised_step.operator(*found))
    factor = omega2 / (4.0 * share * share)
    found.state.added_mass[:] *= factor
    for window in found.windows:
        for body in (window.state.disc, *(() if window.state.clumps is None else (window.state.clumps.motion,))):
            body[:, 6:] *= factor
    return found._replace(model=replace(found.model, mass=found.model.mass * factor)), mode


def excite(found, mode, size, rng):
    """Set all velocities: the mode, its largest velocity of `size` [m/step], and a thousandth of that at random."""
    motion = size * (mode / np.abs(mode).max())
    points = 2 * len(found.model.grid.xy)
    found.state.velocity[:] = motion[:points].reshape(-1, 2)
    for window in found.windows:
        ring = window.model.ring
        own = motion[points : points + 3 * (window.model.count - ring)].reshape(-1, 3)
        points += own.size
        window.state.disc[ring:, 2:5] = own + 1e-3 * size * rng.standard_normal(own.shape)


def growth(found, steps, enough=1e5):
    """Largest speed in all steps over the largest of the first two; ends early where it is `enough`, before speeds are capped."""
    first = largest = 0.0
    for n in range(steps):
        found.step()
        if n < 2:
            first = max(first, found.speed())
        elif n < 1000 or n % 10 < 2:
            largest = max(largest, found.speed())
            if not largest < enough * first:
                return np.inf
    return largest / first
