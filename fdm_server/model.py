"""Model: everything that is constant while steps are taken. State: everything that changes; a checkpoint is exactly State."""

from dataclasses import dataclass, field, replace
from functools import cache
from typing import Annotated, get_type_hints

import numpy as np
from numpy.typing import NDArray

from coupler_protocol.compiled import threads
from fdm_server.effects import Law, law_from
from fdm_server.effects.histories import OfLaws
from fdm_server.mesh.grid import Grid
from fdm_server.mesh.grid_sides import fixed_components
from fdm_server.step.blocks import LANES, Gather, Geometry, build_gather, build_geometry, to_blocks
from fdm_server.step.forces import CORNER_ROWS
from fdm_server.step.histories import GRIDPOINT, NEITHER, ZONE, begin_and_end_histories, reset_histories
from fdm_server.step.masses import static_masses, weight_masses
from fdm_server.step.nodal_pass import Nodal, build_nodal
from fdm_server.step.safety import check_zones
from fdm_server.step.stress import STRESS_ROWS
from fdm_server.step.thread_parts import Partition, build_partition


@dataclass(frozen=True, slots=True)
class Model:
    """The continuum: N gridpoints, Z zones of which A are active, in B blocks."""

    grid: Grid
    zone: NDArray[np.int64]  # (A,) active zones of the grid, in the order of the blocks
    geometry: Geometry
    start: NDArray[np.uint32]  # (N+1,) forces on gridpoint n are at place[start[n]:start[n + 1]]
    place: NDArray[np.uint32]  # (M,)
    partition: Partition  # distribution of a step among threads
    mass: NDArray[np.float64]  # (N,) [kg] scaled for a step of 1
    weight_mass: NDArray[np.float64]  # (N,) [kg] real, for gravity
    fixed: NDArray[np.bool_]  # (N,2) components held at zero velocity; both for gridpoints without zones
    density: NDArray[np.float64]  # (materials,) [kg/m3]
    material_law: Law  # parameters by material
    pattern: NDArray[np.int64]  # (B,) row of the parameters of a block; blocks of the same materials share it
    law: Law  # parameters by zone, (patterns, rows of 16)
    nodal: Nodal | None = None  # averages of volumetric strain at gridpoints; None: volumetric strain belongs to the zone
    step_factor: float | None = None  # share of the stable step taken in real time; None: static mode

    @property
    def in_real_time(self):
        """Whether steps take seconds, with real masses; else static mode."""
        return self.step_factor is not None

    @property
    def gather(self):
        """Gather for the sums of corner forces at gridpoints, for kernels."""
        return Gather(self.partition.order, self.partition.ready, self.start, self.place)

    @property
    def zones(self):
        """Gridpoints of the active zones (A,4)."""
        return self.grid.zones[self.zone]

    @property
    def extent(self):
        """Larger side [m] of the box around the grid."""
        return float(np.ptp(self.grid.xy, axis=0).max())

    @property
    def zone_density(self):
        """Density of the active zones (A,) [kg/m3]."""
        return self.density[self.grid.material[self.zone]]

    @property
    def modulus(self):
        """Constrained modulus of the active zones (A,) [Pa]."""
        return moduli(self.material_law)[self.grid.material[self.zone]]


@dataclass(slots=True, kw_only=True)
class State(OfLaws):
    """Everything that a step changes, values that may be set between steps (applied, added_mass), and histories of laws (OfLaws).

    The annotation of every field gives its place: zone (B, 16 R), gridpoint (N,) or (N,2), or neither. Functions that remove
    zones, save or copy a State use these places. Histories of laws that do not act are None.
    """

    velocity: Annotated[NDArray[np.float64], GRIDPOINT]  # (N,2) [m/s]
    displacement: Annotated[NDArray[np.float64], GRIDPOINT]  # (N,2) [m]
    force: Annotated[NDArray[np.float64], GRIDPOINT]  # (N,2) [N] of the zones on gridpoints
    applied: Annotated[NDArray[np.float64], GRIDPOINT]  # (N,2) [N] of all others on gridpoints
    added_mass: Annotated[NDArray[np.float64], GRIDPOINT]  # (N,) [kg] of contact springs attached to gridpoints
    stress: Annotated[NDArray[np.float64], ZONE]  # (B, 10 rows) [Pa] sm, zz; sd and xy of four triangles
    corner_force: Annotated[NDArray[np.float64], ZONE]  # (B, 8 rows) [N] of zones on their corners
    mass: Annotated[NDArray[np.float64] | None, GRIDPOINT] = (
        None  # (N,) [kg] static masses of the present shape; None: small strain
    )
    mass_age: Annotated[int, NEITHER] = 0  # steps since `mass` was computed
    driven: Annotated[NDArray[np.float64] | None, GRIDPOINT] = None  # (N,2) [m/step] prescribed velocities, 0 where none; or None
    loads: Annotated[dict[str, NDArray[np.float64]], GRIDPOINT] = field(default_factory=dict)  # (N,2) [N] by place, in `applied`
    dt: Annotated[float | None, NEITHER] = None  # [s] step in real time; None: static mode
    memory: Annotated[dict[str, NDArray[np.float64]], ZONE] = field(default_factory=dict)  # (B, 1 row) {history: of added laws}

    @property
    def in_real_time(self):
        """Whether steps are in seconds, with real masses; else static mode: a step of 1 with scaled masses."""
        return self.dt is not None

    def history(self, name):
        """Array of the history with this name."""
        return self.memory[name] if name in self.memory else getattr(self, name)


@cache
def places():
    """Places of the fields of State: {name: "zone", "gridpoint" or "neither"}."""
    return {name: place for name, hint in get_type_hints(State, include_extras=True).items() for place in hint.__metadata__}


def carried(state, zones):
    """A State for fewer zones: `zones` maps an array (B, 16 R) of all zones to that of the remaining ones; others are copied."""
    return State(
        **{name: _carried(getattr(state, name), zones if place == ZONE else np.copy) for name, place in places().items()}
    )


def _carried(value, change):
    if isinstance(value, dict):
        return {name: _carried(item, change) for name, item in value.items()}
    return change(value) if isinstance(value, np.ndarray) else value


def build_model(scene, grid):
    """Model of all zones of `grid` with the scene's materials, boundaries and damping."""
    density = np.array([m.density for m in scene.material], dtype=np.float64)
    fixed = fixed_components(grid, scene.boundary)
    return model_of(grid, np.arange(len(grid.zones)), density, law_from(scene), fixed)


def with_materials(model, state, scene):
    """The model with the effects of the materials of `scene`; stresses stay.

    Histories of laws that begin are zero, those of laws that end are dropped.
    """
    fresh = model_of(model.grid, model.zone, model.density, law_from(scene), model.fixed)
    begin_and_end_histories(fresh, state)
    return replace(fresh, step_factor=model.step_factor)


def model_of(grid, zone, density, material_law, fixed):
    """Model of the zones `zone` (A,) of the grid; gridpoints without a zone are held."""
    zones, material = grid.zones[zone], grid.material[zone]
    check_zones(grid.xy, zones, zone, grid.origin)
    attached = np.bincount(zones.ravel(), minlength=len(grid.xy)) > 0
    start, place = build_gather(zones, len(grid.xy))
    patterns, pattern = np.unique(to_blocks(material[:, None]), axis=0, return_inverse=True)
    return Model(
        grid=grid,
        zone=zone,
        geometry=build_geometry(grid.xy, zones),
        start=start,
        place=place,
        partition=build_partition(zones, len(grid.xy), threads.size()),
        mass=static_masses(grid.xy, zones, moduli(material_law)[material]),
        weight_mass=weight_masses(grid.xy, zones, density[material]),
        fixed=fixed | ~attached[:, None],
        density=density,
        material_law=material_law,
        pattern=pattern.ravel().astype(np.int64),
        law=_by_lane(material_law, patterns),
        nodal=None if material_law.nodal is None else build_nodal(zones, material),
    )


def moduli(material_law):
    """Constrained modulus (materials,) [Pa] of every material."""
    return material_law.elastic[:, :2].sum(axis=1)  # (K + G/3) + G


def _by_lane(law, patterns):
    """The law's parameters for the materials of 16 lanes (patterns, 16)."""

    def rows(by_material):
        return np.concatenate([p[patterns] for p in by_material.T], axis=1)

    laid = {name: rows(value) for name, value in law._asdict().items() if isinstance(value, np.ndarray)}
    added = law.added and tuple(type(one)(*(values[patterns] for values in one)) for one in law.added)
    return law._replace(added=added, **laid)


def new_state(model):
    """A model at rest without stress."""
    points, blocks = len(model.grid.xy), len(model.geometry.corner)
    state = State(
        velocity=np.zeros((points, 2)),
        displacement=np.zeros((points, 2)),
        force=np.zeros((points, 2)),
        applied=np.zeros((points, 2)),
        added_mass=np.zeros(points),
        stress=np.zeros((blocks, STRESS_ROWS * LANES)),
        corner_force=np.zeros((blocks, CORNER_ROWS * LANES)),
    )
    reset_histories(model, state, (ZONE, GRIDPOINT))
    return state
