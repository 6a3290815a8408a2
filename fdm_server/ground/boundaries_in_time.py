"""Boundaries over the stages: those that act, those that begin, and the change of velocities and loads.

A velocity changes linearly from its previous value to that of its table in `over` steps: in step n of the stage (from 0)
with s = min(1, (n + 1)/over). A load changes with the share s of its ramp (load_steps.py):

    v = (1 - s) v_before + s v_after          f = (1 - s) f_before + s f_after

v_before is `State.driven`, f_before `State.loads`: a later stage continues from the values reached, and the first one from the
boundaries of the scene if both are for the same place.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from coupler_protocol.compiled.jit import jit
from coupler_protocol.scene.schedule import acting_boundaries, new_boundaries
from fdm_server.ground.even_loads import forces_of_even_loads
from fdm_server.ground.load_steps import Ramp, ramp_of
from fdm_server.ground.quiet_sides import WAVES, Dashpots, all_dashpots, keep_reaction
from fdm_server.ground.shaking import ARRIVING, Shaken, shaken
from fdm_server.mesh.grid_sides import edges_of, fixed_components, motion_of, points_in, sides_of
from fdm_server.mesh.zone_sides import boundary_edges
from fdm_server.step import present_shape


@jit
def drive_kernel(component, start, end, over, done, velocity, driven):
    """Sets the velocities (N,2) of the step after `done` steps of the stage, and `driven` (N,2); other arguments: of Drive."""
    v, prescribed = velocity.reshape(velocity.size), driven.reshape(driven.size)
    for i in range(len(component)):
        share = (done + 1) / over[i]
        now = start[i] + share * (end[i] - start[i]) if share < 1.0 else end[i]
        v[component[i]] = prescribed[component[i]] = now


@jit
def drive_sides(drive, done, velocity):
    """`drive_kernel` for a tuple of its arguments before `done` and `driven` after them, or None."""
    if drive is not None:
        component, start, end, over, driven = drive
        drive_kernel(component, start, end, over, done, velocity, driven)


class Drive(NamedTuple):
    """Velocities of n components of motion, flat positions in (N,2), that change over steps."""

    component: NDArray[np.int64]  # (n,)
    start: NDArray[np.float64]  # (n,) [m/step]
    end: NDArray[np.float64]  # (n,) [m/step]
    over: NDArray[np.int64]  # (n,)

    def apply(self, state, done):
        """Sets the velocities of the step after `done` steps of the stage."""
        drive_kernel(*self, done, state.velocity, state.driven)


class Load(NamedTuple):
    """Forces of one place on n gridpoints; place "": an excavation or surcharge, which has none in `State.loads`."""

    place: str
    start: NDArray[np.float64]  # (n,2) [N]
    end: NDArray[np.float64]  # (n,2) [N]
    ramp: Ramp

    def saved(self):
        """All of it, for a checkpoint inside of the stage."""
        return self._asdict() | {"ramp": self.ramp.saved()}

    @classmethod
    def of(cls, saved):
        """The Load that `saved` describes."""
        return cls(**(saved | {"ramp": Ramp.of(saved["ramp"])}))


def wave_forces(state, nodes):
    """Forces (n,2) [N] of dashpots and arriving waves on gridpoints, which change in every step; None without any."""
    parts = [force[nodes] for place, force in state.loads.items() if place.endswith((WAVES, ARRIVING))]
    return np.sum(parts, axis=0) if parts else None


class Push(NamedTuple):
    """Loads on n gridpoints, in addition to the constant forces `others` and to those of waves."""

    nodes: NDArray[np.int64]  # (n,)
    others: NDArray[np.float64]  # (n,2) [N]
    loads: tuple[Load, ...]

    def apply(self, state):
        """Sets the forces of the coming step, if they change."""
        if any(load.ramp.moves for load in self.loads):
            total = self.others.copy()
            for load in self.loads:
                force = load.ramp.between(load.start, load.end)
                if load.place:
                    state.loads[load.place][self.nodes] = force
                total += force
            waves = wave_forces(state, self.nodes)
            state.applied[self.nodes] = total if waves is None else total + waves

    def with_ramp(self, change, state):
        """The Push with the ForceRamp `change` of an excavation or surcharge as one more load, from the present forces on."""
        nodes = np.union1d(self.nodes, change.nodes)
        own, others = np.searchsorted(nodes, self.nodes), constant_forces(state, nodes)
        others[own] = self.others
        spread = [
            Load(load.place, *(_on(nodes, own, force) for force in (load.start, load.end)), load.ramp) for load in self.loads
        ]
        ramp = _on(nodes, np.searchsorted(nodes, change.nodes), change.end - change.start)
        return Push(nodes, others, (*spread, Load("", np.zeros_like(ramp), ramp, change.ramp)))


NO_PUSH = Push(np.zeros(0, dtype=np.int64), np.zeros((0, 2)), ())


def constant_forces(state, nodes):
    """Applied forces (n,2) [N] on gridpoints without those of waves."""
    waves = wave_forces(state, nodes)
    return state.applied[nodes] if waves is None else state.applied[nodes] - waves


def _on(nodes, own, force):
    """Forces on the gridpoints `nodes`, from those on nodes[own]; zero on the others."""
    spread = np.zeros((len(nodes), 2))
    spread[own] = force
    return spread


class Sides(NamedTuple):
    """Actions of boundaries in a stage; None for an absent action."""

    drive: Drive | None
    push: Push | None
    dashpots: tuple[Dashpots, ...]
    shaken: Shaken | None
    holders: dict[str, tuple[NDArray[np.int64], NDArray[np.int64]]]  # name: gridpoints held or moved in x and in y

    def saved(self):
        """Actions that depend on the State with which the stage began, for a checkpoint inside of the stage."""
        push = self.push and self.push._asdict() | {"loads": [load.saved() for load in self.push.loads]}
        return {"drive": self.drive and self.drive._asdict(), "push": push}

    def arguments(self, state, now):
        """Arguments of `drive_sides`, `absorb_all` and those of shaking.py: (drive, quiet, shaken); now [s]: of the stage."""
        drive = self.drive and (*self.drive, state.driven)
        quiet = tuple(side.arguments(state) for side in self.dashpots) or None
        return drive, quiet, self.shaken and self.shaken.arguments(state, now)

    @property
    def act(self):
        """Whether they do something in every step."""
        return self.drive is not None or self.push is not None or bool(self.dashpots) or self.shaken is not None


NOTHING = Sides(None, None, (), None, {})


def begin_stage(scene, index, model, state, gravity=0.0):
    """Returns the model with the components held in a stage, and its Sides; prepares `State.driven` and `State.loads`.

    gravity [m/s2]: of the previous step, for the reaction of a side that becomes quiet.
    """
    boundaries, new = acting_boundaries(scene, index), new_boundaries(scene, index)
    for boundary in new:
        if boundary.is_quiet:
            keep_reaction(model, state, boundary, gravity)
    attached = np.diff(model.start) > 0
    model = replace(model, fixed=fixed_components(model.grid, boundaries) | ~attached[:, None])
    earlier, own = new[: len(new) - len(scene.stage[index].boundary)], scene.stage[index].boundary
    drive = _drive(model, state, boundaries, _motions(earlier), _motions(own))
    ramps = [ramp_of(scene, index, model.law, b.over, b.ratio, index > 0 and b in own) for b in _loads(new)]
    push = _push(model, state, _loads(earlier), _loads(own), ramps)
    damped = all_dashpots(model, boundaries)
    return model, Sides(drive, push, damped, shaken(model, new, damped, state), holders(model.grid, boundaries))


def continued(scene, index, model, saved):
    """The Sides of a stage that `Sides.saved` describes; model: with the components held in the stage."""
    boundaries, push = acting_boundaries(scene, index), saved["push"]
    damped = all_dashpots(model, boundaries)
    return Sides(
        drive=saved["drive"] and Drive(**saved["drive"]),
        push=push and Push(**(push | {"loads": tuple(Load.of(load) for load in push["loads"])})),
        dashpots=damped,
        shaken=shaken(model, new_boundaries(scene, index), damped),
        holders=holders(model.grid, boundaries),
    )


def holders(grid, boundaries):
    """Gridpoints {name: (held in x, held in y)} of boundaries that hold or move; equal names are one."""
    found, sides = {}, sides_of(grid)
    for boundary in boundaries:
        for axis, velocity in motion_of(boundary):
            if velocity is not None:
                by_axis = found.setdefault(boundary.label, [np.zeros(0, dtype=np.int64)] * 2)
                by_axis[axis] = np.union1d(by_axis[axis], points_in(grid, sides, boundary))
    return {label: tuple(by_axis) for label, by_axis in found.items()}


def _motions(boundaries):
    return [b for b in boundaries if not b.loads]


def _loads(boundaries):
    return [b for b in boundaries if b.loads]


def _drive(model, state, boundaries, earlier, own):
    """The Drive of a stage in which boundaries begin: `earlier` of the scene, then `own` of the stage."""
    if state.driven is None:
        if not any(b.velocity is not None or (b.shaking is not None and not b.is_quiet) for b in boundaries):
            return None
        state.driven = np.zeros_like(state.velocity)
    end, over = state.driven.copy(), np.ones(state.driven.shape, dtype=np.int64)
    sides = sides_of(model.grid)
    for k, boundary in enumerate([*earlier, *own]):
        points = points_in(model.grid, sides, boundary)
        for axis, velocity in motion_of(boundary):
            if k >= len(earlier):
                state.driven[points, axis] = end[points, axis]  # velocity by the boundaries of the scene
            end[points, axis] = velocity or 0.0
            over[points, axis] = 1 if velocity is None else boundary.over or 1
    state.driven[~model.fixed] = 0.0
    moving = np.flatnonzero(model.fixed & ((end != 0.0) | (state.driven != 0.0)))
    if not len(moving):
        return None
    return Drive(moving, state.driven.reshape(-1)[moving].copy(), end.reshape(-1)[moving], over.reshape(-1)[moving])


def _push(model, state, earlier, own, ramps):
    """The Push of a stage in which loads begin: `earlier` of the scene, then `own` of the stage, with the Ramp of each."""
    last = {b.place: b for b in [*earlier, *own]}
    ramp = {b.place: ramp for b, ramp in zip([*earlier, *own], ramps, strict=True)}
    if not last:
        return None
    after = {place: load_forces(model, state, b) for place, b in last.items()}
    for place in last:
        state.loads.setdefault(place, np.zeros_like(state.applied))
    for before in earlier:
        if before is not last[before.place]:
            force = load_forces(model, state, before)
            state.applied += force - state.loads[before.place]
            state.loads[before.place] = force
    touched = [np.any((after[place] != 0.0) | (state.loads[place] != 0.0), axis=1) for place in last]
    nodes = np.flatnonzero(np.any(touched, axis=0))
    loads = tuple(Load(place, state.loads[place][nodes].copy(), after[place][nodes], ramp[place]) for place in last)
    others = constant_forces(state, nodes)
    for load in loads:
        others = others - load.start
    return Push(nodes, others, loads)


def load_forces(model, state, boundary):
    """Forces (N,2) [N] of a load on its side and range, in the present shape; no force acts on removed zones."""
    edges = edges_of(model.grid, boundary.on)
    there = {tuple(edge) for edge in boundary_edges(model.zones).tolist()}
    edges = edges[[tuple(edge) in there for edge in edges.tolist()]]
    xy = present_shape.present(model, state)
    along = xy[edges[:, 1]] - xy[edges[:, 0]]
    outward = np.column_stack([along[:, 1], -along[:, 0]])  # outward normal times length
    if boundary.stress is not None:
        s = boundary.stress
        push = np.column_stack([s.xx * outward[:, 0] + s.xy * outward[:, 1], s.xy * outward[:, 0] + s.yy * outward[:, 1]])
    else:
        push = (boundary.shear or 0.0) * along - (boundary.pressure or 0.0) * outward
    return forces_of_even_loads(xy, edges, push, boundary.x, boundary.y)
