"""The ground that all trials of one mesh start from: the grid under its weight and loads, in elastic equilibrium.

An elastic equilibrium is one, whatever the way to it, and no trial's outcome depends on the trials before. Windows are
ignored (the grid alone is computed, in small strain); zones that a scene's excavations take away are gone.
"""

import copy
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from coupler_protocol.problems import unfit
from coupler_protocol.scene.scene import declared_effects
from fdm_server.effects import added_laws, law_from
from fdm_server.fos.flow_rule import with_flow
from fdm_server.fos.loading import apply_loads, boundaries, gravity_of, loads
from fdm_server.fos.reduction import reduced
from fdm_server.fos.verdict import SPANS_OF_SETTLING
from fdm_server.ground.excavation import all_held, excavations
from fdm_server.ground.initial_stress import initial_state
from fdm_server.mesh.grid import build_grid
from fdm_server.mesh.grid_sides import fixed_components
from fdm_server.mesh.hole_ring import ANGLES
from fdm_server.model import Model, State, model_of, new_state
from fdm_server.step.gridpoint_pass import unbalanced_ratio, update_velocities
from fdm_server.step.histories import reset_histories
from fdm_server.step.safety import check_motion
from fdm_server.step.zone_pass import advance

LOOK = 25  # steps between looks at the unbalanced ratio
SHORTEST = 100  # steps of a span
SETTLED = 0.1  # of the ratio at which trials rest
BUDGET, SETTLINGS = 60_000, 8  # steps of a trial, and how many times the steps of settling, where the scene says nothing


class Ground(NamedTuple):
    """Where trials start, on one mesh."""

    model: Model  # elastic
    state: State
    gravity: float  # [m/s2]
    settlement: float  # [m] root mean square displacement since zero stress
    steps: int  # from zero stress to the ratio at which trials rest
    span: int  # steps of a span of a trial
    budget: int  # steps of a trial at most


def zone_size(scene):
    """Size [m] in x of the zones, in a ring along the wall of the hole."""
    grid = scene.grid
    return grid.inner * ANGLES[grid.part] / grid.around if grid.kind == "ring" else grid.zone_size[0]


def with_zone_size(scene, size):
    """The scene with zones of `size` [m] (see `zone_size`) and of the same shape as before."""
    grid, before = scene.grid, zone_size(scene)
    if grid.kind == "ring":
        change = {"around": max(3, round(grid.around * before / size))}
    else:
        change = {"zone_size": (size, grid.zone_size[1] * size / before)}
    return scene.model_copy(update={"grid": grid.model_copy(update=change)})


def settle(scene, stop=lambda: None, say=lambda steps, ratio: None):
    """The Ground of a scene. stop() may end the work, say(steps, ratio) reports progress.

    Raises SceneError where the grid cannot be built, nothing can fail or nothing weighs; Unstable where numbers grow.
    """
    gravity = gravity_of(scene)
    if gravity == 0.0 and (scene.fos.by == "gravity" or not any(loads(scene))):
        raise unfit("stage", "nothing loads the ground", "add gravity = 9.81 to the first stage")
    if all(m.mohr_coulomb is None for m in scene.material):
        raise unfit("material", "no material has a strength", "add mohr_coulomb = { .. } to a material")
    _refuse_added_laws(scene)
    model = _model(scene, _elastic(scene.material))
    if not all_held(model.zones, model.fixed):
        why = "the grid has no support in x or in y: it would never come to rest"
        raise unfit("boundary", why, 'add [[boundary]] tables, for example on = "bottom", fix = "xy"')
    state = new_state(model)
    apply_loads(scene, model, state)
    steps = _settle(model, state, gravity, scene.fos.ratio, stop, say)
    settlement = weighted_length(model, state.displacement)
    if scene.initial_stress is not None:
        state = initial_state(scene, model, gravity)
        apply_loads(scene, model, state)
        _settle(model, state, gravity, scene.fos.ratio, stop, say)
    state.velocity[:] = 0.0
    state.displacement[:] = 0.0
    span = max(SHORTEST, LOOK * round(steps / SPANS_OF_SETTLING / LOOK))
    budget = scene.fos.steps or max(BUDGET, SETTLINGS * steps)
    return Ground(model, state, gravity, settlement, steps, span, budget)


def _refuse_added_laws(scene):
    """Raise SceneError where strength is to be divided by a factor that a law of another distribution knows nothing of."""
    for i, m in enumerate(scene.material if scene.fos.by != "gravity" else ()):
        for name in added_laws.declared():
            if getattr(m, name, None) is not None:
                why = f"material.{name} is not divided by the factor: it is a law of another distribution"
                raise unfit(f"material[{i}].{name}", why, 'use [fos] by = "gravity", or remove the table')


def begin_trial(scene, ground, factor):
    """Model and State that a trial begins with: strength divided by `factor`, or as it is where gravity is to grow."""
    materials = with_flow(scene).material
    materials = materials if scene.fos.by == "gravity" else reduced(materials, factor, scene.fos)
    model = _with_law(ground.model, scene, materials)
    state = copy.deepcopy(ground.state)
    reset_histories(model, state)
    return model, state


def _settle(model, state, gravity, ratio, stop, say):
    """Bring an elastic grid to rest at SETTLED times `ratio`; returns the steps it took to `ratio`."""
    steps, settled = 0, 0
    while True:
        update_velocities(model, state, gravity)
        advance(model, state)
        steps += 1
        if steps % LOOK == 0:
            stop()
            check_motion(model, state)
            now = unbalanced_ratio(model, state, gravity)
            say(steps, now)
            settled = settled or (steps if now <= ratio else 0)
            if now <= SETTLED * ratio:
                return settled


def weighted_length(model, motion):
    """Root mean square of the lengths of `motion` (N,2), weighted by the gridpoints' real masses."""
    return float(np.sqrt((model.weight_mass[:, None] * motion**2).sum() / model.weight_mass.sum()))


def damping_of(scene):
    """The damping of trials: the scene's, or local damping where that is none for static steps."""
    table = scene.damping
    return table if table is not None and (table.local or table.combined or table.kind) else declared_effects()["damping"]()


def _model(scene, materials):
    grid = build_grid(scene)
    fixed = fixed_components(grid, boundaries(scene))
    dug = np.zeros(len(grid.zones), dtype=np.bool_)
    for mask in excavations(scene, grid, lambda _: fixed, ()).values():
        dug |= mask
    density = np.array([m.density for m in materials], dtype=np.float64)
    settling = damping_of(scene) if damping_of(scene).kind is None else declared_effects()["damping"]()
    return model_of(grid, np.flatnonzero(~dug), density, _law(scene, materials, settling), fixed)


def _with_law(model, scene, materials):
    """The model with other strengths of its materials; stiffness, and masses with it, are the same."""
    fresh = model_of(model.grid, model.zone, model.density, _law(scene, materials, damping_of(scene)), model.fixed)
    return replace(fresh, geometry=model.geometry, mass=model.mass)


def _law(scene, materials, damping):
    return law_from(scene.model_copy(update={"material": materials, "damping": damping}))


def _elastic(materials):
    """Materials with all that limits their stress left out."""
    places = (place.partition(".") for place in declared_effects())
    limits = {key: None for table, _, key in places if table == "material" and key != "elastic"}
    return [m.model_copy(update=limits) for m in materials]
