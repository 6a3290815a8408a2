"""Pressure of alternate signs in flowing ground: loads, factors of safety and amplitudes with both kinds of mixed discretisation.

    python scripts/studies/pressure_mode_study.py [--fast]

For `[grid] mixed = "zone"` and `"nodal"`: the pressure on rough strip footings over Prandtl's
(scripts/verification/continuum/footing.py); the amplitude of alternate signs (a - b + c - d)/4 in the mean stress of the four
zones around a gridpoint, as computed and averaged at gridpoints, over Prandtl's pressure (root mean square over the gridpoints
below the footing, down to its half-width); the work of averaging over that of the footing; factors of safety of slopes
(scripts/verification/continuum/slopes.py). --fast: the coarse footing alone.
"""

import argparse
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from verification import as_a_run
from verification.continuum import footing, slopes

from colluvium.results.smoothed_stress import pressure_mode, smoothed
from fdm_server.observe import fields

KINDS = ("zone", "nodal")
TRESCA, FRICTION = (0.0, (5.0, 3.0), 0.06, 5e-6), (20.0, (8.0, 5.0), 0.1, 1e-5)  # degrees, box [m], depth [m], velocity [m/step]


def of_footing(parts, mixed, friction, box, depth, velocity):
    """Pressure and amplitudes (as computed, smoothed) over Prandtl's pressure, work of averaging over that of the footing."""
    tables = footing.scene(parts, friction, box, depth, velocity)
    tables["grid"]["mixed"] = mixed
    tables["record"] = tables["record"] | {"energy": True}
    names = ["reaction_y:footing", "energy_external", *(["energy_averaging"] if mixed == "nodal" else [])]
    found = as_a_run.compute(tables, names)
    model, stress = found.model, fields.stress(found.model, found.state)
    xy, material = model.grid.xy, model.grid.material[model.zone]
    prandtl = footing.prandtl(friction) * footing.COHESION
    amplitudes = []
    for values in (stress, smoothed(xy, model.zones, material, stress)):
        points, amplitude = pressure_mode(model.zones, 0.5 * (values[:, 0] + values[:, 1]))
        below = (xy[points, 0] < 1.0) & (xy[points, 1] > box[1] - 1.0)
        amplitudes.append(float(np.sqrt(np.mean(amplitude[below] ** 2))) / prandtl)
    load = footing.pressure(-found.histories["reaction_y:footing"], parts) / footing.prandtl(friction)
    averaging = found.histories[names[-1]][-1] / found.histories["energy_external"][-1] if mixed == "nodal" else 0.0
    return load, *amplitudes, averaging


def of_slopes(mixed):
    """Yields names and factors of safety of slopes."""
    for name, size, flow in (
        ("dawson_slope", 1.25, "scene"),
        ("griffiths_lane", 1.0, "zero"),
        ("griffiths_lane", 1.0, "associated"),
    ):
        scene = slopes.read(name, zone_sizes=[size], flow=f'"{flow}"')
        yield f"{name}, flow {flow}, zones of {size:g} m", _factor(scene, mixed)
    for flow in ("zero", "associated"):
        yield f"ACADS 1(a), flow {flow}, zones of 1.25 m", _factor(slopes.acads(flow, 1.25), mixed)


def _factor(scene, mixed):
    scene = scene.model_copy(update={"grid": scene.grid.model_copy(update={"mixed": mixed})})
    return slopes.factors(scene)["meshes"][-1]["value"]


def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--fast", action="store_true", help="the coarse footing alone")
    fast = parser.parse_args(arguments).fast
    cases = [("Tresca, a/4", 4, TRESCA)]
    if not fast:
        cases += [("Tresca, a/8", 8, TRESCA), ("Tresca, a/16", 16, TRESCA), ("friction 20 degrees, a/4", 4, FRICTION)]
        cases += [("friction 20 degrees, a/8", 8, FRICTION)]
    print("| footing | mixed | load over Prandtl's | amplitude, zones | amplitude, smoothed | work of averaging |")
    print("|---|---|---|---|---|---|")
    for name, parts, case in cases:
        for mixed in KINDS:
            load, raw, smooth, work = of_footing(parts, mixed, *case)
            print(f"| {name} | {mixed} | {load - 1.0:+.2%} | {raw:.2%} | {smooth:.2%} | {work:.3%} |", flush=True)
    if not fast:
        print("\n| slope | zone | nodal |\n|---|---|---|")
        for (name, zone), (_, nodal) in zip(of_slopes("zone"), of_slopes("nodal"), strict=True):
            print(f"| {name} | {zone:.3f} | {nodal:.3f} |", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
