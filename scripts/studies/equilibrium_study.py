"""Fewer steps to equilibrium: masses and dampings beside the default, the steps they take and the factors of safety they give.

    python scripts/studies/equilibrium_study.py [--fast] [--json FILE]

Masses: classical (fdm_server/step/masses.py); row sums of the elastic stiffness (Gershgorin's bound) with the same reserve;
and lighter ones, to show what they do. Dampings: local .8 (default) and .5; kinetic (velocities to zero at peaks of the
kinetic energy, Barnes 1999, Int. J. Space Struct. 14); viscous with the factor of Rayleigh's quotient, found anew every step
(Underwood 1983, Dynamic relaxation). The rows stand in docs/design/0005-steps-to-equilibrium.md."""

import argparse
import json
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.sparse import coo_array

from coupler_protocol.scene.reader import read_scene
from fdm_server.fos.bracket import NoBracket, search
from fdm_server.fos.ground import begin_trial, settle, with_zone_size
from fdm_server.fos.trial import run_trial
from fdm_server.model import new_state
from fdm_server.step.blocks import TRIANGLES, triangle_double_areas
from fdm_server.step.gridpoint_pass import kinetic_energy, unbalanced_ratio, update_velocities
from fdm_server.step.safety import Unstable
from fdm_server.step.zone_pass import advance

CONFIGS = Path(__file__).resolve().parents[2] / "configs"
RATIO, MOST = 1e-5, 80_000
BLOCK = [[12.0, 3.0], [16.0, 3.0], [16.0, 7.0], [12.0, 7.0]]  # a thousand times stiffer


def stiffness_rows(model):
    """Sums of |K_ij| over j (N,2) [N/m] of the elastic grid, K as the kernels have it (two overlays, one pressure a zone)."""
    xy, zones = model.grid.xy, model.zones
    double = triangle_double_areas(xy, zones)
    area = 0.5 * (double[:, 0] + double[:, 1])
    bulk, shear = model.material_law.elastic[model.grid.material[model.zone]][:, :2].T  # K + G/3, G
    element = np.zeros((len(zones), 8, 8))
    dilation = np.zeros((len(zones), 8))
    for t, corners in enumerate(TRIANGLES):
        a, b, c = (xy[zones[:, k]] for k in corners)
        safe = np.where(double[:, t] > 0.0, double[:, t], np.inf)
        turned = [np.column_stack([q[:, 1] - r[:, 1], r[:, 0] - q[:, 0]]) for q, r in ((b, c), (c, a), (a, b))]
        gradient = np.stack(turned, axis=1)
        gradient = gradient / safe[:, None, None]  # (Z, corner, axis)
        difference, gamma = np.zeros((2, len(zones), 8))
        for place, corner in enumerate(corners):
            difference[:, corner] += gradient[:, place, 0]
            difference[:, 4 + corner] -= gradient[:, place, 1]
            gamma[:, corner] += gradient[:, place, 1]
            gamma[:, 4 + corner] += gradient[:, place, 0]
            dilation[:, corner] += 0.5 * double[:, t] / (2.0 * area) * gradient[:, place, 0]
            dilation[:, 4 + corner] += 0.5 * double[:, t] / (2.0 * area) * gradient[:, place, 1]
        weight = 0.25 * double[:, t] * shear
        element += weight[:, None, None] * (_outer(difference) + _outer(gamma))
    element += (area * bulk)[:, None, None] * _outer(dilation)
    dofs = np.concatenate([2 * zones, 2 * zones + 1], axis=1)
    i, j = np.repeat(dofs, 8, axis=1).ravel(), np.tile(dofs, (1, 8)).ravel()
    matrix = coo_array((element.ravel(), (i, j)), shape=(2 * len(xy), 2 * len(xy))).tocsr()  # sums up before signs go
    return np.abs(matrix).sum(axis=1).reshape(-1, 2)


def _outer(v):
    return v[:, :, None] * v[:, None, :]


def row_sum_masses(model, reserve):
    """Masses (N,) [kg] for a step of 1: omega^2 <= max rows/m stays below 4/reserve; local damping needs reserve 1 + alpha."""
    rows = stiffness_rows(model).max(axis=1)
    return np.where(rows > 0.0, 0.25 * reserve * rows, model.mass)


class Kinetic:
    """No damping, but at every peak of the kinetic energy all velocities begin anew from zero."""

    def __init__(self):
        self.before = 0.0

    def __call__(self, model, state, gravity):
        update_velocities(_undamped(model), state, gravity)
        energy = kinetic_energy(model, state)
        if energy < self.before:
            state.velocity[:] = 0.0
            energy = 0.0
        self.before = energy


class Viscous:
    """v' = ((2 - c) v + 2 F/m)/(2 + c), c = 2 sqrt(lambda), lambda = v.dF / v.m v over the last step (Rayleigh's quotient)."""

    def __init__(self):
        self.force, self.c = None, 0.2

    def __call__(self, model, state, gravity):
        force = state.force + state.applied
        force[:, 1] -= gravity * model.weight_mass
        force[model.fixed] = 0.0
        if self.force is not None:
            power = -np.sum(state.velocity * (force - self.force))
            inertia = np.sum(model.mass[:, None] * state.velocity**2)
            if inertia > 0.0:
                self.c = 2.0 * np.sqrt(np.clip(power / inertia, 0.0, 1.0))
        self.force = force
        state.velocity *= (2.0 - self.c) / (2.0 + self.c)
        state.velocity += 2.0 / (2.0 + self.c) * force / model.mass[:, None]


def _undamped(model):
    return replace(model, law=model.law._replace(damping=None))


class Variant(NamedTuple):
    """Masses and damping to compare."""

    name: str
    masses: Callable  # of a Model: (N,) [kg]
    alpha: float  # of local damping, where that acts
    damping: Callable  # makes the light half of a step


def classical(model):
    """The masses of fdm_server/step/masses.py."""
    return model.mass


VARIANTS = (
    Variant("classical masses, local .8 (default)", classical, 0.8, lambda: update_velocities),
    Variant("classical masses, local .5", classical, 0.5, lambda: update_velocities),
    Variant("classical masses, kinetic", classical, 0.8, Kinetic),
    Variant("classical masses, viscous", classical, 0.8, Viscous),
    Variant("row sums, reserve 2, local .8", lambda m: row_sum_masses(m, 2.0), 0.8, lambda: update_velocities),
    Variant("row sums, reserve 2, kinetic", lambda m: row_sum_masses(m, 2.0), 0.8, Kinetic),
    Variant("row sums, reserve 2, viscous", lambda m: row_sum_masses(m, 2.0), 0.8, Viscous),
    Variant("classical masses x .3, local .8", lambda m: 0.3 * m.mass, 0.8, lambda: update_velocities),
    Variant("classical masses x .2, local .8", lambda m: 0.2 * m.mass, 0.8, lambda: update_velocities),
)


def prepared(scene, variant):
    """The scene with a variant's local damping, and its Ground (elastic start by the default) with the variant's masses."""
    ground = settle(scene)
    damping = scene.damping.model_copy(update={"local": variant.alpha})
    model = replace(ground.model, mass=variant.masses(ground.model))
    return scene.model_copy(update={"damping": damping}), ground._replace(model=model)


def steps_to_rest(scene, variant):
    """Steps from zero stress under full gravity and with all strengths to RATIO at five looks in a row; None: not in MOST."""
    scene, ground = prepared(scene, variant)
    model, _ = begin_trial(scene, ground, 1.0)
    state, move = new_state(model), variant.damping()
    below = 0
    for step in range(1, MOST + 1):
        move(model, state, ground.gravity)
        advance(model, state)
        if step % 10 == 0:
            ratio = unbalanced_ratio(model, state, ground.gravity)
            if not np.isfinite(ratio):
                return None
            below = below + 1 if ratio <= RATIO else 0
            if below == 5:
                return step
    return None


def factor(scene, variant):
    """The Bracket of the factor of safety and the steps of all its trials, None where no factor rests or none fails."""
    scene, ground = prepared(scene, variant)
    steps = 0

    def oracle(f):
        nonlocal steps
        trial = run_trial(scene, ground, f, accelerate=variant.damping())
        steps += trial.steps
        return trial.verdict

    try:
        return search(oracle, scene.fos.bracket, scene.fos.resolution), steps
    except (NoBracket, Unstable):
        return None, steps


def scenes(fast):
    """{name: scene} of what is brought to rest and of what is searched."""
    size = 2.0 / 3.0 if fast else 1.0 / 3.0
    paper = with_zone_size(read_scene(CONFIGS / "paper_slope.toml", ["fos.bracket=[2.4,2.6]"]), size)
    rock = paper.material[0].model_copy(
        update={
            "name": "rock",
            "region": BLOCK,
            "elastic": type(paper.material[0].elastic)(bulk=5e11, shear=1.5e11),
            "mohr_coulomb": None,
            "tension": None,
        }
    )
    contrast = paper.model_copy(update={"material": [*paper.material, rock]})
    dawson = with_zone_size(read_scene(CONFIGS / "dawson_slope.toml", ["fos.resolution=0.002"]), 10 / (8 if fast else 12))
    return {"slope": paper, "contrast 1000": contrast}, {"Dawson": dawson, "paper slope": paper}


def main(argv=None):
    """Print one row a variant."""
    p = argparse.ArgumentParser(description=__doc__.partition(":")[0])
    p.add_argument("--fast", action="store_true", help="coarse meshes")
    p.add_argument("--json", metavar="FILE", type=Path, help="write the rows to FILE")
    options = p.parse_args(argv)
    to_rest, searched = scenes(options.fast)
    rows = []
    for variant in VARIANTS:
        begin, row = time.perf_counter(), {"variant": variant.name}
        for name, scene in to_rest.items():
            row[f"steps, {name}"] = steps_to_rest(scene, variant)
        for name, scene in searched.items():
            bracket, steps = factor(scene, variant)
            row[f"factor, {name}"] = None if bracket is None else round(bracket.middle, 4)
            row[f"undecided, {name}"] = None if bracket is None else len(bracket.undecided)
            row[f"steps of the search, {name}"] = steps
        row["seconds"] = round(time.perf_counter() - begin, 1)
        rows.append(row)
        print(json.dumps(row), flush=True)
    if options.json:
        options.json.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
