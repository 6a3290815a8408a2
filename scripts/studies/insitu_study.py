"""How near virtual strain brings a window to a given stress: fields of the window of configs/paper_slope.toml, soil and stones.

    python scripts/studies/insitu_study.py [--fast] [--slopes] [--json FILE]

Fields of ground of 2700 kg/m3, all but the last two inside the cone of friction of Table 2: level ground with K0 = .571;
ground whose principal axes are turned by 30 degrees everywhere; ground with linearly varying shear; level ground with K = .36,
which needs the bonds; one with K = .25, beyond the estimated strength of the bonded discs (packing_strength.py), which needs
further rounds.

xx, yy, xy: rms error in circles of .25 m over the mean |yy|, before stones are made and at the end (lines: the same forces at
the end counted along straight branches between centroids, yy); side: largest difference of the sum of the ring's contact
forces on a side of the window from the field's force on it, over the latter; segment: rms of the same over segments, over
their rms force; broken: bonds that break in 300 steps after they were made.

--slopes: instead of these fields, the stress of the zones of four slopes at rest (a face of 30 degrees and the L of
configs/quick_notch.toml among them), taken over by discs with the bonds of the scene and without bonds. xx, yy, xy: errors
against the zones' stress; sine: mobilised sine of the zones, of their stress within the estimated strength, of the discs;
rounds: all, and those among them that aimed at the zones' own stress, of 300 steps each; slips: share of the contacts that are
not bonded and at their limit of friction."""

import argparse
import json
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from shapely.geometry import box

import colluvium
from coupler_protocol.interface.ring import build_ring
from coupler_protocol.scene.reader import read_scene
from dem_server.effects.bond import BONDED
from dem_server.insitu import virtual_strain
from dem_server.insitu.contact_stress import circle_stress
from dem_server.insitu.hat_bins import bins_over
from dem_server.insitu.takeover import take_over
from dem_server.insitu.zone_stress import tractions
from dem_server.model import build_model
from dem_server.observe import unbalanced_ratio
from dem_server.packing import packing
from dem_server.packing.alone_window import rim_of
from dem_server.packing.coupled_window import drawn_stones, packed_window
from dem_server.pairs import body_centres, contacts
from dem_server.step.contact_pass import contact_forces
from dem_server.stones import bodies, mesostructure
from fdm_server.mesh import window_zones
from fdm_server.observe.fields import zone_field

CONFIGS = Path(__file__).resolve().parents[2] / "configs"
SCENE = CONFIGS / "paper_slope.toml"
GRAVITY, DENSITY, TOP = 9.81, 2700.0, 12.0
UNIT = DENSITY * GRAVITY
SEEDS, STEPS = 3, 300
HEAD = (
    f"{'field':<10}{'':<7}seed  before: xx   yy   xy   after: xx   yy   xy  lines  side  segment  broken   ratio"
    "     Z  projected  beyond friction   [errors in %]"
)


def level(x, y, K):
    """Level ground at y = TOP."""
    yy = -UNIT * (TOP - y)
    return K * yy, yy, 0.0 * yy


def turned(x, y, K=0.571, degrees=30.0):
    """S (c - m.x) with principal axes at 30 degrees; m = -S^-1 UNIT e_y puts it in equilibrium with the weight."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    R = np.array([[c, -s], [s, c]])
    S = -R @ np.diag([K, 1.0]) @ R.T
    m = np.linalg.solve(S, [0.0, -UNIT])
    depth = 60e3 - m[0] * (x - 12.0) - m[1] * (y - 10.667)
    return S[0, 0] * depth, S[1, 1] * depth, S[0, 1] * depth


def sheared(x, y):
    """Shear that varies along x and y, and the normal stresses that balance it and the weight."""
    p, q = 0.12 * UNIT, 0.08 * UNIT
    yy = -(UNIT - p) * (TOP - y) - 20e3
    return 0.6 * (yy + 20e3) - 20e3 - q * (x - 12.0), yy, 8e3 + p * (x - 12.0) + q * (y - 8.0)


FIELDS = {
    "K0 .571": lambda x, y: level(x, y, 0.571),
    "turned 30": turned,
    "sheared": sheared,
    "K .36": lambda x, y: level(x, y, 0.36),
    "K .25": lambda x, y: level(x, y, 0.25),
}


FACE_30 = (
    "grid.length=26.0",
    'grid.fit="face"',
    "grid.profile=[[0.0,4.0],[3.3333333,4.0],[17.1897397,12.0],[26.0,12.0]]",
    "window.band.columns=[18,22]",
    "window.band.rows=[6,11]",
)
SLOPES = {
    "quick_slope": ("quick_slope.toml", ()),
    "paper_slope": ("paper_slope.toml", ()),
    "30 degrees": ("quick_slope.toml", FACE_30),
    "L": ("quick_notch.toml", ()),
}
HEAD_OF_SLOPES = (
    f"{'slope':<12}{'bonds':<6}   xx   yy   xy [%]   sine: zones  estimate  discs   rounds (further)  broken   slips   ratio"
)


def zones_at_rest(scene):
    """Nodes (K, 2) and zones (z, 7) of the scene's window at the end of its stage of kind equilibrium, the grid alone."""
    begin = [stage for stage in scene.stage if stage.kind == "equilibrium"]
    alone = scene.model_copy(update={"window": [], "discs": None, "stones": None, "ring": None, "stage": begin})
    found = []

    def look(moment):
        grid = moment.model.grid
        mask = window_zones.window_zones(grid, scene.window[0])
        found[:] = grid.xy[window_zones.rim_of(grid, mask)], zone_field(moment.model, moment.state, mask)

    with TemporaryDirectory(prefix="colluvium-") as folder:
        colluvium.run(alone, Path(folder) / "run", on_stage=look)
    return found


def slope_case(scene, nodes, target):
    """One row of the table of slopes: the window of `scene` takes over the zones `target` and is left for STEPS steps."""
    found = drawn_stones(scene, 1, nodes)
    model, state, _, _ = packed_window(scene, 1, nodes, found)
    estimate = virtual_strain.mobilised_sine(virtual_strain.aim_of(model, state, target).stress)
    body = scene.stones and scene.stones.body
    model, told = take_over(model, state, target, GRAVITY, found, body, scene.discs.density_matching)
    pairs = contacts(state)
    limit = model.law.friction.coefficient[pairs.kind] * pairs.normal_force
    slips = (pairs.bond_state != BONDED) & (np.abs(pairs.shear_force) >= 0.999 * limit)
    virtual_strain.relax(model, state, GRAVITY, STEPS)
    kept = ("zones_xx", "zones_yy", "zones_xy", "sine_zones", "sine_discs", "rounds", "further_rounds", "ratio")
    return {key: told[key] for key in kept} | {
        "sine_estimate": estimate,
        "broken": state.broken_tension + state.broken_shear,
        "slips": float(slips.mean()),
    }


def line_of_slope(name, bonds, row):
    """A row of the printed table of slopes."""
    errors = "".join(f"{100 * row[key]:5.1f}" for key in ("zones_xx", "zones_yy", "zones_xy"))
    sines = f"{row['sine_zones']:18.3f}{row['sine_estimate']:10.3f}{row['sine_discs']:7.3f}"
    rest = f"{row['rounds']:9d} ({row['further_rounds']}){row['broken']:14d}{100 * row['slips']:8.1f} %  {row['ratio']:.1e}"
    return f"{name:<12}{bonds:<6}{errors}{sines}{rest}"


def slopes(names):
    """Yields name, whether with bonds, and `slope_case` of the slopes `names`."""
    for name in names:
        file, changes = SLOPES[name]
        scene = read_scene(CONFIGS / file, changes)
        nodes, target = zones_at_rest(scene)
        for bonds in (True, False):
            discs = scene.discs if bonds else scene.discs.model_copy(update={"soil": _without_bond(scene.discs.soil)})
            yield name, bonds, slope_case(scene.model_copy(update={"discs": discs}), nodes, target)


def _without_bond(grain):
    return grain.model_copy(update={"bond": None})


def window(scene):
    """Nodes (K, 2) of the scene's window of zones."""
    (dx, dy), w = scene.grid.zone_size, scene.window[0]
    corners = box(w.columns[0] * dx, w.rows[0] * dy, (w.columns[1] + 1) * dx, (w.rows[1] + 1) * dy)
    return rim_of(np.array(corners.exterior.coords)[:-1], dx)


def ring_errors(model, state, corners, field):
    """Largest error of a side's force, over that force; rms error of a segment's, over the rms force."""
    R = model.ring
    rim = state.x[:R]
    wanted = -tractions(rim, lambda points: np.column_stack(field(*points.T)))  # on the ring, from the discs
    piece = 0.5 * (state.force[:R] + np.roll(state.force[:R], -1, axis=0))  # of the piece from a disc to the next
    middle = rim + 0.5 * (np.roll(rim, -1, axis=0) - rim)
    low, high = corners.min(axis=0), corners.max(axis=0)
    side = np.argmin(np.column_stack([middle - low, high - middle]), axis=1)
    per = R // len(corners)
    return (
        max(_error(piece[side == s].sum(axis=0), wanted[side == s].sum(axis=0)) for s in range(4)),
        _error(piece.reshape(-1, per, 2).sum(axis=1), wanted.reshape(-1, per, 2).sum(axis=1)),
    )


def _error(found, wanted):
    return float(np.linalg.norm(found - wanted) / np.linalg.norm(wanted))


def zones(nodes, field):
    """The field as that of zones (z, 7) of a quarter of a metre in the window."""
    points, share = (grid := bins_over(nodes, 2.0)).points, grid.share
    return np.column_stack([points, np.full(len(points), share), *field(*points.T), np.full(len(points), DENSITY)])


def case(scene, field, stony, seed):
    """One row of the table: a window filled, brought to the field, made of stones, bonded, and left for STEPS steps."""
    nodes, discs = window(scene), scene.discs
    ring = build_ring(nodes, discs.radius)
    packed = packing.pack(nodes, ring.xy, ring.radius, discs, np.random.default_rng([seed, 1]))
    model, state = build_model(ring.xy, ring.radius, packed, discs, scene.ring)
    contact_forces(model, state)
    target, found = zones(nodes, field), None
    if stony:
        found = mesostructure.draw(nodes, scene.stones, np.random.default_rng([seed, 1, *b"stones"]))
        bodies.assign_discs(model, state, found.outlines, discs.stone.density)
    aim = virtual_strain.final_aim(virtual_strain.aim_of(model, state, target), True)  # errors are those against the zones
    before = []

    def note(text, fraction=None):
        if state.clumps is None:  # stones are made last
            before.append(virtual_strain.stress_error(state, aim))

    model, told = take_over(model, state, target, GRAVITY, found, scene.stones.body, note=note)
    pairs = contacts(state)
    lines = circle_stress(body_centres(state)[pairs.disc_a], pairs, aim.centres, aim.radius)
    lines = np.sqrt(((lines - aim.stress)[:, 1] ** 2).mean()) / np.abs(aim.stress[:, 1]).mean()
    virtual_strain.relax(model, state, GRAVITY, STEPS)
    side, segment = ring_errors(model, state, nodes, field)
    return {
        "before": before[-1].tolist(),
        "after": [told["error_xx"], told["error_yy"], told["error_xy"]],
        "lines": float(lines),
        "side": side,
        "segment": segment,
        "broken": state.broken_tension + state.broken_shear,
        "ratio": told["ratio"],
        "ratio_later": unbalanced_ratio.unbalanced_ratio(model, state, GRAVITY),
        "coordination": told["coordination"],
        "projected": told["projected"],
        "beyond_friction": told["beyond_friction"],
        "further_rounds": told["further_rounds"],
        "imbalance": [told["imbalance_x"], told["imbalance_y"]],
    }


def line_of(name, stony, seed, row):
    """A row of the printed table."""
    before, after = ("".join(f"{100 * e:5.1f}" for e in row[key]) for key in ("before", "after"))
    rest = f"{100 * row['lines']:7.1f}{100 * row['side']:6.1f}{100 * row['segment']:9.1f}{row['broken']:8d}  {row['ratio']:.1e}"
    shares = f"{row['coordination']:6.2f}{100 * row['projected']:8.1f} %{100 * row['beyond_friction']:13.1f} %"
    return f"{name:<10}{'stones' if stony else 'soil':<7}{seed:>4}  {before:>19}  {after:>18}{rest}{shares}"


def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--fast", action="store_true", help="one seed")
    parser.add_argument("--slopes", action="store_true", help="the stress of slopes at rest (--fast: of one)")
    parser.add_argument("--json", metavar="FILE", help="write the rows as a list")
    options = parser.parse_args(arguments)
    rows = rows_of_slopes(options.fast) if options.slopes else rows_of_fields(options.fast)
    if options.json:
        Path(options.json).write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    return 0


def rows_of_slopes(fast):
    """Computes and prints the table of slopes."""
    rows = []
    print(HEAD_OF_SLOPES)
    for name, bonds, row in slopes(list(SLOPES)[:1] if fast else SLOPES):
        rows.append({"slope": name, "bonds": bonds, **row})
        print(line_of_slope(name, "yes" if bonds else "no", row), flush=True)
    return rows


def rows_of_fields(fast):
    """Computes and prints the table of fields."""
    scene, rows = read_scene(SCENE), []
    print(HEAD)
    for name, field in FIELDS.items():
        for stony in (False, True):
            for seed in range(1 if fast else SEEDS):
                row = case(scene, field, stony, seed)
                rows.append({"field": name, "stones": stony, "seed": seed, **row})
                print(line_of(name, stony, seed, row), flush=True)
    return rows


if __name__ == "__main__":
    raise SystemExit(main())
