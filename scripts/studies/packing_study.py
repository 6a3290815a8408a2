"""Packings of a 2.0 x 5.8 m window at 100 kPa: both ways of packing, three sizes of discs, as a table in Markdown.

    python scripts/studies/packing_study.py [--radius R ...] [--seeds N] [--json FILE]

Discs of the paper's soil, radii uniform in R (1 ± 0.25), inside a ring on nodes 1/3 m apart. Packed, then 1,000 steps with
friction. Coordination and the share of discs with fewer than three contacts count discs more than 4 R away from the ring; the
anisotropy a of the contact normals leaves out contacts of the ring; the stress error is that of the mean pressure. Seconds are
those of the packing alone, kernels compiled before.
"""

import argparse
import json
import time
from types import SimpleNamespace

import numpy as np
import shapely

from coupler_protocol.geometry import polygon_area
from coupler_protocol.interface.ring import build_ring
from dem_server.effects.damping import Damping
from dem_server.effects.friction import Friction
from dem_server.effects.spring import Spring
from dem_server.model import build_model
from dem_server.observe.coordination import coordination, porosity
from dem_server.packing.alone_window import rim_of
from dem_server.packing.growth import pressure, run
from dem_server.packing.packing import pack
from dem_server.pairs import contacts
from dem_server.step.contact_pass import contact_forces

WIDTH, HEIGHT, SEGMENT, PRESSURE = 2.0, 5.8, 1.0 / 3.0, 100e3
RADII = (0.05, 0.03, 0.02)
COLUMNS = {
    "seconds": "{:.1f}",
    "discs": "{:.0f}",
    "coordination": "{:.2f}",
    "porosity": "{:.4f}",
    "fewer than 3 contacts": "{:.1%}",
    "anisotropy a": "{:.3f}",
    "stress error": "{:+.2%}",
}


def discs_of(how, radius):
    """The `discs` table of a scene."""
    soil = SimpleNamespace(density=2000.0, spring=Spring(normal=5e7, shear=2e7), friction=Friction(coefficient=0.55))
    table = {"radius": radius, "spread": 0.25, "packing": how, "porosity": 0.16, "confinement": PRESSURE, "target": "stress"}
    return SimpleNamespace(soil=soil, stone=None, stiffness="disc", damping=Damping(local=0.7), **table)


def measured(how, radius, seed):
    """Numbers of one packing, by COLUMNS."""
    nodes = rim_of([[0.0, 0.0], [WIDTH, 0.0], [WIDTH, HEIGHT], [0.0, HEIGHT]], SEGMENT)
    ring, discs = build_ring(nodes, radius), discs_of(how, radius)
    begin = time.perf_counter()
    packing = pack(nodes, ring.xy, ring.radius, discs, np.random.default_rng(seed))
    seconds = time.perf_counter() - begin
    model, state = build_model(ring.xy, ring.radius, packing, discs, insitu=False)
    contact_forces(model, state)
    run(model, state, 1000)
    pairs = contacts(state)
    inner = shapely.contains_xy(shapely.Polygon(nodes).buffer(-4.0 * radius), state.x)
    touching, few = coordination(model, state, inner)
    free = (pairs.disc_a >= model.ring) & (pairs.disc_b >= model.ring)
    angle = np.arctan2(pairs.branch[free, 1], pairs.branch[free, 0])
    fabric = 2.0 * abs(np.exp(2j * angle).mean())
    error = pressure(pairs, polygon_area(nodes)) / PRESSURE - 1.0
    values = seconds, len(packing.radius), touching, porosity(model, state), few, fabric, error
    return dict(zip(COLUMNS, map(float, values), strict=True))


def range_of(rows, name):
    """Smallest and largest of a column over seeds as text; one number where they print alike."""
    low, high = (COLUMNS[name].format(f(row[name] for row in rows)) for f in (min, max))
    return low if low == high else f"{low} to {high}"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--radius", type=float, nargs="+", default=RADII, metavar="R", help="mean radii [m]")
    parser.add_argument("--seeds", type=int, default=3, metavar="N", help="seeds 1 to N (default 3)")
    parser.add_argument("--json", metavar="FILE", help="all numbers")
    options = parser.parse_args()
    measured("relaxed", 0.1, 0), measured("inward", 0.1, 0)  # compiles
    print(f"| packing | radius [m] | {' | '.join(COLUMNS)} |\n|---|---|{'---|' * len(COLUMNS)}")
    found = []
    for radius in options.radius:
        for how in ("relaxed", "inward"):
            rows = [measured(how, radius, seed) for seed in range(1, options.seeds + 1)]
            print(f"| {how} | {radius:g} | {' | '.join(range_of(rows, name) for name in COLUMNS)} |", flush=True)
            found += [{"packing": how, "radius": radius, "seed": seed} | row for seed, row in enumerate(rows, start=1)]
    if options.json:
        with open(options.json, "w", encoding="utf-8") as file:
            json.dump(found, file, indent=1)


if __name__ == "__main__":
    main()
