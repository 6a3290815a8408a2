"""How often the 95 % intervals of a, a_n and their directions contain the true values: many packings of one kind, as a table.

    python scripts/studies/fabric_study.py [--seeds N] [--cases NAME ..] [--fast] [--json FILE]

Packings at 100 kPa in a ring that is held, then 1,000 steps with friction; bonds and stones as in the paper's Table 2.
*loaded*: the ring is shortened along y, and lengthened by half of that along x, in 40 increments. *thinned*: an isotropic
packing of which a contact is kept with a probability of (1 + A cos 2(theta - 60 deg)) / (1 + A), and its force is multiplied by
1 + A cos 2(theta - 60 deg), so that a = a_n = A exactly.

True values: 0 for isotropic packings, A for thinned ones; for loaded packings, and for discs of one size, which form crystals
along the sides, the mean of the vectors a exp(2 i theta_a) and a_n exp(2 i theta_n) over the seeds.

scatter: standard deviation of a component of the vector over seeds, over sqrt(2 / N), that of N independent contacts. within:
share of the seeds whose interval contains the true a, theta_a, a_n, theta_n (an isotropic packing has no direction); in brackets
for a and a_n with contacts taken as independent. isotropic: share in which a, and a_n, cannot be told from an isotropic packing.
--fast: 12 packings of 0.7 m."""

import argparse
import json
from functools import lru_cache
from pathlib import Path
from types import SimpleNamespace
from typing import NamedTuple

import numpy as np

from colluvium.results.fabric import directions, fit_fabric
from coupler_protocol.interface.ring import build_ring
from coupler_protocol.scene.reader import read_scene
from dem_server.effects import RING
from dem_server.insitu.takeover import bond
from dem_server.model import build_model
from dem_server.packing.alone_window import rim_of
from dem_server.packing.growth import run
from dem_server.packing.packing import pack
from dem_server.pairs import contacts
from dem_server.step.contact_pass import contact_forces
from dem_server.step.neighbours import rebuild
from dem_server.stones import bodies, mesostructure

SCENE = Path(__file__).resolve().parents[2] / "configs" / "paper_slope.toml"
RADIUS, SEEDS = 0.03, 50
STEPS, INCREMENTS, STEPS_EACH = 1000, 40, 100
AXIS = 60.0  # of thinned packings [deg]
QUANTITIES = ("a", "a_n")
HEAD = (
    "packings",
    "contacts",
    "true a, a_n",
    "scatter of a, a_n",
    "within: a",
    "theta_a",
    "a_n",
    "theta_n",
    "isotropic: a, a_n",
)


class Case(NamedTuple):
    """One kind of packing. side, height [m]; shortened: strain of the ring along y; thinned: A of a thinned packing."""

    name: str
    side: float
    height: float = 0.0  # 0: a square
    packing: str = "relaxed"
    spread: float = 0.25
    stones: bool = False
    bonded: bool = False
    shortened: float = 0.0
    thinned: float = 0.0

    @property
    def isotropic(self):
        """Whether the true values are 0."""
        return not (self.shortened or self.thinned or self.spread == 0.0)


CASES = (
    Case("graded, 1 m", 1.0),
    Case("graded, 2 x 5.667 m", 2.0, 5.667),
    Case("inward, 1.4 m", 1.4, packing="inward"),
    Case("stones, 2 m", 2.0, stones=True),
    Case("one size, 1 m", 1.0, spread=0.0),
    Case("one size, 1.4 m", 1.4, spread=0.0),
    Case("loaded, 1.4 m", 1.4, shortened=0.01),
    Case("loaded, bonded, stones, 1.4 m", 1.4, bonded=True, stones=True, shortened=0.004),
    Case("thinned, 0.1, 1 m", 1.0, thinned=0.1),
    Case("thinned, 0.3, 1 m", 1.0, thinned=0.3),
)
FAST = Case("graded, 0.7 m", 0.7), Case("thinned, 0.3, 0.7 m", 0.7, thinned=0.3)


@lru_cache
def tables():
    """The scene with the paper's Table 2."""
    return read_scene(SCENE)


def packed(case, seed):
    """Model and State of one packing."""
    scene, corners = tables(), np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]) * (case.side, case.height or case.side)
    materials = {}
    for name in ("soil", "stone"):
        material = getattr(scene.discs, name)
        materials[name] = material if case.bonded else material.model_copy(update={"bond": None})
    chosen = {"radius": RADIUS, "spread": case.spread, "packing": case.packing, "target": "stress", **materials}
    discs = scene.discs.model_copy(update=chosen)
    nodes = rim_of(corners, 4.0 * RADIUS)
    ring = build_ring(nodes, RADIUS)
    model, state = build_model(
        ring.xy,
        ring.radius,
        pack(nodes, ring.xy, ring.radius, discs, np.random.default_rng([seed, 1])),
        discs,
        insitu=case.stones,
    )
    contact_forces(model, state)
    if case.stones:
        found = mesostructure.draw(nodes, scene.stones, np.random.default_rng([seed, 2]))
        bodies.assign_discs(model, state, found.outlines, discs.stone.density)
        model = bodies.form_stones(model, state, found.outlines, "clump")
    if case.bonded:
        bond(model, state)
    run(model, state, STEPS)
    if case.shortened:
        shorten(model, state, case.shortened)
    return model, state


def shorten(model, state, strain):
    """Moves the ring by `strain` along y and by half of it outwards along x, and lets the discs come to rest."""
    ring = state.x[: model.ring]
    middle = 0.5 * (ring.min(axis=0) + ring.max(axis=0))
    for _ in range(INCREMENTS):
        ring[:] = middle + (ring - middle) * (1.0 + np.array([0.5, -1.0]) * strain / INCREMENTS)
        rebuild(model, state)
        contact_forces(model, state)
        run(model, state, STEPS_EACH)
    run(model, state, STEPS)


def counted(model, state):
    """The contacts as `run.fabric` counts them."""
    fields = {"xy": state.x.copy(), "control": (model.material == RING).astype(int)}
    if state.stone is not None:
        fields["stone"] = state.stone
    pairs = contacts(state)
    ends = np.column_stack((pairs.disc_a, pairs.disc_b))
    return directions(_Fields(fields), SimpleNamespace(ends=ends, normal_force=pairs.normal_force))


class _Fields(dict):
    """Arrays of the discs by name, as of a frame that was read."""

    __getattr__ = dict.__getitem__


def thin(found, size, rng):
    """A part of isotropic contacts with a = a_n = `size` along AXIS."""
    wave = 1.0 + size * np.cos(2.0 * (found.theta - np.radians(AXIS)))
    kept = rng.random(len(wave)) < wave / (1.0 + size)
    return found._replace(theta=found.theta[kept], force=(found.force * wave)[kept], bodies=found.bodies[kept])


def fabrics(case, seed):
    """Fabric of one packing, with intervals from blocks and with contacts taken as independent."""
    found = counted(*packed(case, seed))
    if case.thinned:
        found = thin(found, case.thinned, np.random.default_rng([seed, 3]))
    return fit_fabric(*found), fit_fabric(found.theta, found.force)


def vectors(found, name):
    """a exp(2 i theta_a) or a_n exp(2 i theta_n) of each fabric."""
    return np.array([getattr(one, name) * np.exp(2j * np.radians(getattr(one, direction_of(name)))) for one in found])


def direction_of(name):
    """Name of the direction of a or a_n."""
    return f"theta_{name[2:] or name}"


def within(found, name, true):
    """Shares of the fabrics whose interval contains the absolute value, and the direction, of the vector `true`."""
    size, angle = abs(true), np.degrees(np.angle(true)) / 2.0
    intervals = np.array([getattr(one, f"{name}_interval") for one in found])
    off = np.array([getattr(one, direction_of(name)) - angle for one in found])
    error = np.array([getattr(one, f"{direction_of(name)}_error") for one in found])
    turned = np.abs((off + 90.0) % 180.0 - 90.0)
    return float(((intervals[:, 0] <= size) & (size <= intervals[:, 1])).mean()), float((turned <= error).mean())


def measured(case, seeds):
    """Numbers of one case."""
    both = [fabrics(case, seed) for seed in seeds]
    found, independent = ([pair[k] for pair in both] for k in (0, 1))
    number = float(np.mean([one.contacts for one in found]))
    row = {"case": case.name, "seeds": len(found), "contacts": number}
    for name in QUANTITIES:
        vector = vectors(found, name)
        true = 0.0 if case.isotropic else case.thinned * np.exp(2j * np.radians(AXIS)) if case.thinned else vector.mean()
        sigma = np.sqrt((np.abs(vector - vector.mean()) ** 2).sum() / (2.0 * (len(found) - 1)))
        size, direction = within(found, name, true)
        row[name] = {
            "true": float(abs(true)),
            "mean": float(np.abs(vector).mean()),
            "sigma": float(sigma),
            "scatter": float(sigma / np.sqrt(2.0 / number)),
            "half_width": float(np.mean([getattr(one, f"{name}_interval")[1] - getattr(one, name) for one in found])),
            "within": size,
            "direction_within": direction,
            "independent": within(independent, name, true)[0],
            "isotropic": float(np.mean([getattr(one, name) <= getattr(one, f"{name}_noise") for one in found])),
        }
    return row


def line_of(row):
    """A row of the table."""
    a, a_n = (row[name] for name in QUANTITIES)
    directions = [f"{one['direction_within']:.2f}" if one["true"] else "-" for one in (a, a_n)]
    return [
        row["case"],
        f"{row['contacts']:.0f}",
        f"{a['true']:.2f}, {a_n['true']:.2f}",
        f"{a['scatter']:.2f}, {a_n['scatter']:.2f}",
        f"{a['within']:.2f} ({a['independent']:.2f})",
        directions[0],
        f"{a_n['within']:.2f} ({a_n['independent']:.2f})",
        directions[1],
        f"{a['isotropic']:.2f}, {a_n['isotropic']:.2f}",
    ]


def main(arguments=None):
    """Run the study; returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=SEEDS, metavar="N", help=f"packings of each kind (default {SEEDS})")
    parser.add_argument("--cases", nargs="+", choices=[case.name for case in CASES], metavar="NAME", help="default: all")
    parser.add_argument("--fast", action="store_true", help="12 packings of 0.7 m")
    parser.add_argument("--json", type=Path, metavar="FILE", help="all numbers")
    options = parser.parse_args(arguments)
    cases = FAST if options.fast else [case for case in CASES if case.name in (options.cases or [case.name])]
    print(f"| {' | '.join(HEAD)} |\n|{' --- |' * len(HEAD)}")
    rows = []
    for case in cases:
        rows.append(measured(case, range(1, (12 if options.fast else options.seeds) + 1)))
        print(f"| {' | '.join(line_of(rows[-1]))} |", flush=True)
    if options.json:
        options.json.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
