"""Shaking at the cut-off frequency of the mesh.

The velocity of the base is a triangle ±V across it, one stage of a scene for each half period, in real time without damping.
*Column*: 40 zones of h = 0.5 m above the base, free at the top. The highest frequency of waves in it is

    sin(w_c dt/2) = c_S dt/h,

and the column is the chain of masses rho h^2 and springs G in leap-frog: it is compared with such a chain, written without the
code, at 0.5, 1 and 1.25 w_c. Speeds stay within four times V (a wave doubles at the free top). *Coupled*:
`tests/hard/shaking.toml`, a box with a window of bonded discs, shaken at w_c = 2 c_S/h: speeds stay bounded, both ledgers close,
and no watch warns."""

import tempfile
from math import asin, pi, sin

import numpy as np

import colluvium
from verification import as_a_run
from verification.hard.runs import ended
from verification.hard.watched import scene_of
from verification.verdict_rows import row

NAME = "shaking"
SOURCE = "closed form (leap-frog chain)"
DENSITY, BULK, SHEAR, H, ZONES = 2000.0, 1e8, 0.6e8, 0.5, 40
SPEED = (SHEAR / DENSITY) ** 0.5  # of shear waves [m/s]
V = 0.1  # of the base [m/s]
HALF = 20  # steps of half a period at w_c


def stages(axis, on, half, count, **more):
    """Stages that move the side `on` to and fro: the first quarter of a period, then `count` halves of `half` steps each."""
    found = []
    for number in range(count + 1):
        steps = half // 2 if number == 0 else half
        motion = {"on": on, "velocity": {"x": 0.0, "y": 0.0} | {axis: V * (-1) ** number}, "over": steps}
        stage = {"name": f"shake {number}", "kind": "load", "time": "real", "boundary": [motion], "until": {"steps": steps}}
        found.append(stage | {"damping": {"local": 0.0}} | more)
    return found


def column(half, count, factor):
    """The column, computed by the product; factor: step over the stable one."""
    return as_a_run.compute(
        as_a_run.tables(
            {"kind": "box", "length": ZONES * H, "height": H, "zone_size": H},
            as_a_run.material(BULK, SHEAR, DENSITY),
            stages("y", "left", half, count, step_factor=factor),
            {"left": "xy", "bottom": "x", "top": "x"},
            damping={"local": 0.0},
        )
    )


def chain(dt, half, count):
    """Displacements (ZONES + 1,) [m] of the chain after the same motion of its first node."""
    mass = np.full(ZONES + 1, DENSITY * H * H)
    mass[-1] *= 0.5
    u, v, before = np.zeros(ZONES + 1), np.zeros(ZONES + 1), 0.0
    for number in range(count + 1):
        steps, end = half // 2 if number == 0 else half, V * (-1) ** number
        for step in range(1, steps + 1):
            pull = SHEAR * np.diff(u)
            force = np.append(pull, 0.0) - np.append(0.0, pull)
            v += force * dt / mass
            v[0] = before + step / steps * (end - before)
            u += v * dt
        before = end
    return u


def steps_for(share):
    """Steps of half a period, and the step over the stable one, for a frequency of `share` w_c."""
    half = 2 * round(0.5 * HALF / share)
    wanted = H / SPEED * sin(pi / (2.0 * HALF))  # [s]: w_c dt = pi / HALF
    trial = column(2, 1, 0.1).state.dt / 0.1
    return half, wanted / trial


def coupled(halves):
    """Largest speed over V, largest error of each ledger over the largest kinetic energy, warnings, exit code."""
    tables = scene_of("shaking")
    cut_off, quiet = 2.0 * SPEED / H, len(tables["stage"])
    with tempfile.TemporaryDirectory() as folder:
        probe = tables | {"stage": [*tables["stage"], *stages("x", "bottom", 4, 1)]}
        dt = ended(probe, folder).info["stages"][quiet]["time_step"]
    half = 2 * round(0.5 * pi / (cut_off * dt))
    fastest = [0.0]

    def look(moment):
        if moment.stage.startswith("shake"):
            v = moment.state.v if moment.rank else moment.state.velocity
            fastest[0] = np.fmax(fastest[0], float(np.abs(v).max()))

    with tempfile.TemporaryDirectory() as folder:
        found = ended(tables | {"stage": [*tables["stage"], *stages("x", "bottom", half, halves)]}, folder, on_step=(10, look))
        begin = sum(stage["steps"] for stage in found.info["stages"][:quiet])
        with colluvium.open_run(folder) as run:

            def largest(name, rank):
                steps, values = run.history(name, rank)
                return float(np.abs(values[steps > begin]).max())

            errors = [largest("energy_error", rank) / largest("energy_kinetic", 0) for rank in (0, 1)]
    return fastest[0] / V, errors, found, half * dt * cut_off / pi


def rows(fast):
    """40 half periods of the column, 12 of the coupled box (fast: 12 and 3)."""
    count = 12 if fast else 40
    for share in (1.0,) if fast else (0.5, 1.0, 1.25):
        half, factor = steps_for(share)
        found = column(half, count, factor)
        dt = found.state.dt
        line = np.flatnonzero(found.model.grid.xy[:, 1] == 0.0)
        order = line[np.argsort(found.model.grid.xy[line, 0])]
        moved, expected = found.state.displacement[order, 1], chain(dt, half, count)
        frequency = pi / (half * dt) / (2.0 / dt * asin(SPEED * dt / H))
        name = f"column at {frequency:.4g} of the cut-off"
        error = np.abs(moved - expected).max() / np.abs(expected).max()
        yield row(f"{name}: displacement unlike the chain's, over the largest one", error, 0.0, 1e-9, SOURCE)
        speed = np.abs(found.state.velocity).max() / V
        yield row(f"{name}: largest speed at the end over that of the base", speed, 1.0, [-1e-6, 3.0], "bounded")
    speed, errors, found, near = coupled(3 if fast else 12)
    yield row("coupled: exit code", found.code, 0.0, 0.0, "as asked for")
    yield row("coupled: frequency over the cut-off", 1.0 / near, 1.0, 0.05, "as asked for")
    yield row("coupled: largest speed over that of the base", speed, 1.0, [-0.1, 4.0], "bounded")
    for side, error in zip(("grid", "discs"), errors, strict=True):
        yield row(
            f"coupled: energy of the {side} that nothing explains, over the kinetic energy", error, 0.0, 1e-4, "conservation"
        )
    warned = [w for w in found.info.get("warnings", []) if w["name"] in ("growth", "drift", "mismatch")]
    yield row("coupled: warnings of the watches", len(warned), 0.0, 0.0, "as asked for")
