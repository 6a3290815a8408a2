"""Model: all that stays the same while steps are taken. State: all that changes, and exactly a checkpoint."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from coupler_protocol.compiled import threads
from fdm_server.effects import Law, law_from
from fdm_server.mesh.grid import Grid
from fdm_server.mesh.grid_sides import fixed_components
from fdm_server.step.blocks import LANES, Geometry, build_gather, build_geometry, to_blocks
from fdm_server.step.forces import CORNER_ROWS
from fdm_server.step.masses import static_masses, weight_masses
from fdm_server.step.safety import check_zones
from fdm_server.step.stress import STRESS_ROWS
from fdm_server.step.thread_parts import Partition, build_partition


@dataclass(frozen=True, slots=True)
class Model:
    """The continuum: N gridpoints, of whose Z zones A are active, in B blocks."""

    grid: Grid
    zone: NDArray[np.int64]  # (A,) active zones of the grid, in the order of the blocks
    geometry: Geometry
    start: NDArray[np.uint32]  # (N+1,) forces on gridpoint n stand at place[start[n]:start[n + 1]]
    place: NDArray[np.uint32]  # (M,)
    partition: Partition  # how threads share a step
    mass: NDArray[np.float64]  # (N,) [kg] scaled for a step of 1
    weight_mass: NDArray[np.float64]  # (N,) [kg] real, what gravity acts on
    fixed: NDArray[np.bool_]  # (N,2) components held at zero velocity; both where no zone is left
    density: NDArray[np.float64]  # (materials,) [kg/m3]
    material_law: Law  # parameters by material
    pattern: NDArray[np.int64]  # (B,) row of the parameters of a block; blocks of the same materials share it
    law: Law  # parameters by zone, (patterns, rows of 16)
    step_factor: float | None = None  # share of the stable step taken in real time; None: static mode

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


@dataclass(slots=True)
class State:
    """What a step changes and what others may set between steps (applied, added_mass)."""

    velocity: NDArray[np.float64]  # (N,2) [m/s]
    displacement: NDArray[np.float64]  # (N,2) [m]
    force: NDArray[np.float64]  # (N,2) [N] of the zones on gridpoints
    applied: NDArray[np.float64]  # (N,2) [N] of all others on gridpoints
    added_mass: NDArray[np.float64]  # (N,) [kg] of contact springs hung on gridpoints
    stress: NDArray[np.float64]  # (B, 10 rows) [Pa] sm, zz; sd and xy of four triangles
    corner_force: NDArray[np.float64]  # (B, 8 rows) [N] of zones on their corners
    plastic: NDArray[np.int64] | None  # (B, 1 row) plastic state; None where nothing yields
    mass: NDArray[np.float64] | None = None  # (N,) [kg] scaled for a step of 1 in the present shape; None: small strain
    mass_age: int = 0  # steps since `mass` was computed
    driven: NDArray[np.float64] | None = None  # (N,2) [m/step] prescribed velocities, 0 where none; None: nothing is driven
    loads: dict[str, NDArray[np.float64]] = field(default_factory=dict)  # (N,2) [N] of boundaries by place, part of `applied`
    plastic_shear: NDArray[np.float64] | None = None  # (B, 1 row) [-] plastic shear strain of zones; None where nothing softens
    previous_force: NDArray[np.float64] | None = None  # (N,2) [N] unbalanced a step ago; None without combined damping
    dt: float | None = None  # [s] step in real time; None: static mode


def build_model(scene, grid):
    """Model of all zones of `grid` with the scene's materials, boundaries and damping."""
    density = np.array([m.density for m in scene.material], dtype=np.float64)
    fixed = fixed_components(grid, scene.boundary)
    return model_of(grid, np.arange(len(grid.zones)), density, law_from(scene), fixed)


def model_of(grid, zone, density, material_law, fixed):
    """Model of the zones `zone` (A,) of the grid; gridpoints without a zone are held."""
    zones, material = grid.zones[zone], grid.material[zone]
    check_zones(grid.xy, zones, zone)
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
    )


def moduli(material_law):
    """Constrained modulus (materials,) [Pa] of every material."""
    return material_law.elastic[:, :2].sum(axis=1)  # (K + G/3) + G


def _by_lane(law, patterns):
    """The law's parameters for the materials of 16 lanes (patterns, 16)."""

    def rows(by_material):
        return None if by_material is None else np.concatenate([p[patterns] for p in by_material.T], axis=1)

    return law._replace(
        elastic=rows(law.elastic),
        mohr_coulomb=rows(law.mohr_coulomb),
        tension=rows(law.tension),
        softening=rows(law.softening),
    )


def new_state(model):
    """A model at rest without stress."""
    points, blocks = len(model.grid.xy), len(model.geometry.corner)
    return State(
        velocity=np.zeros((points, 2)),
        displacement=np.zeros((points, 2)),
        force=np.zeros((points, 2)),
        applied=np.zeros((points, 2)),
        added_mass=np.zeros(points),
        stress=np.zeros((blocks, STRESS_ROWS * LANES)),
        corner_force=np.zeros((blocks, CORNER_ROWS * LANES)),
        plastic=np.zeros((blocks, LANES), dtype=np.int64) if model.law.plastic else None,
        plastic_shear=None if model.law.softening is None else np.zeros((blocks, LANES)),
        previous_force=None if model.law.combined is None else np.zeros((points, 2)),
    )
