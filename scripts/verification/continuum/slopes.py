"""Factors of safety of slopes by strength reduction, and the height of a vertical cut.

As computed by `colluvium fos`, middle of the final bracket: configs/dawson_slope.toml (45 degrees, H = 10 m, gamma = 20 kN/m3,
phi = psi = 20, c = 12.38 kPa; the log spiral of limit analysis gives 1), configs/griffiths_lane.toml (2:1, phi = 20, psi = 0,
c/(gamma H) = 0.05; limit analysis with psi = phi 1.368, Bishop 1.380) and configs/paper_slope.toml (8 m, 45 degrees, psi = 0,
tension 0.1 kPa; another implementation of the same method found 2.49). A mesh is a few per cent too strong with associated
flow; the value at zone size 0 is extrapolated from several meshes.

Flow rule: the second slope and ACADS 1(a) (2:1, H = 10 m, gamma = 20 kN/m3, phi = 19.6, c = 3 kPa; the referee's factor is 1.00,
by limit equilibrium) with psi = 0 and with psi = phi (`colluvium fos --flow both`). Limit analysis and limit equilibrium compare
with psi = phi; psi = 0 gives less.

Vertical cut: H = 4 m in clay, Tresca, c chosen so that gamma H/c = 3.779, between the bounds 3.772 and 3.786 of limit
analysis; its factor of safety is 1. The mesh adds about half a zone to the capacity of the toe, so the error is of first
order."""

import tempfile
from pathlib import Path

from colluvium import Scene
from coupler_protocol.process.progress import Progress
from fdm_server.fos.study import Study
from verification import as_a_run
from verification.verdict_rows import row

NAME = "slopes"
CONFIGS = Path(__file__).resolve().parents[3] / "configs"
DAWSON = "Dawson, Roth & Drescher (1999), Geotechnique 49(6)"
GRIFFITHS = "Griffiths & Lane (1999), Geotechnique 49(3); Bishop & Morgenstern (1960)"
ASSOCIATED = "limit analysis, in Griffiths & Lane (1999)"
ACADS = "Giam & Donald (1989), ACADS soil slope stability programs reviews: referee 1.00"
PAPER = "another implementation of the same method on the same grid"
CUT = "Pastor, Thai & Francescato (2000): 3.772 < gamma H/c < 3.786"
HEIGHT, COHESION, NUMBER = 4.0, 20e3, 3.779


def factors(scene):
    """Content of fos.json: meshes and, for several, the extrapolation."""
    with tempfile.TemporaryDirectory() as folder:
        return Study(scene, folder, Progress(0, "none"), _NeverStops()).run()


class _NeverStops:
    def check(self):
        """Nobody asks."""


def read(name, **fos):
    """A shipped scene with some keys of its table [fos] changed."""
    return Scene.read(CONFIGS / f"{name}.toml", [f"fos.{key}={value}" for key, value in fos.items()])


def cut(parts):
    """The vertical cut in ground of 3H x 2H on meshes with so many zones to its height."""
    gravity = NUMBER * COHESION / (2000.0 * HEIGHT)
    profile = [[0.0, HEIGHT], [HEIGHT, HEIGHT], [HEIGHT, 2 * HEIGHT], [3 * HEIGHT, 2 * HEIGHT]]
    grid = {"kind": "slope", "length": 3 * HEIGHT, "height": 2 * HEIGHT, "zone_size": HEIGHT / parts[0], "profile": profile}
    law = {"friction": 0.0, "cohesion": COHESION}
    return Scene(
        **as_a_run.tables(
            grid,
            as_a_run.material(100e6, 30e6, mohr_coulomb=law),
            [{"name": "equilibrium", "gravity": gravity, "until": {"ratio": 1e-5, "steps": 40_000}}],
            {"left": "x", "right": "x", "bottom": "xy"},
            fos={"bracket": [0.95, 1.1], "resolution": 0.004, "zone_sizes": [HEIGHT / n for n in parts]},
        )
    )


def acads(flow, size):
    """Slope 1(a) of the ACADS study with a flow rule, on zones of `size` [m]."""
    profile = [[0.0, 5.0], [10.0, 5.0], [30.0, 15.0], [50.0, 15.0]]
    grid = {"kind": "slope", "length": 50.0, "height": 15.0, "zone_size": size, "profile": profile, "fit": "face"}
    return Scene(
        **as_a_run.tables(
            grid,
            as_a_run.material(6.667e6, 4e6, mohr_coulomb={"friction": 19.6, "cohesion": 3e3}),  # E = 10 MPa, nu = .25
            [{"name": "equilibrium", "gravity": 10.0, "until": {"ratio": 1e-5, "steps": 60_000}}],
            {"left": "x", "right": "x", "bottom": "xy"},
            fos={"bracket": [0.9, 1.1], "flow": flow},
        )
    )


def rows(fast):
    """Four meshes of the first slope, one of the next three, three of the cut (fast: coarser ones)."""
    sizes = [10 / 8, 10 / 12, 10 / 16] if fast else [10 / 8, 10 / 12, 10 / 16, 10 / 24]
    found = factors(read("dawson_slope", zone_sizes=sizes))
    for mesh, parts in zip(found["meshes"], (8, 12, 16, 24), strict=False):
        yield row(f"45 degrees, zones of H/{parts}", mesh["value"], 1.0, [-0.01, 0.06 if parts == 8 else 0.04], DAWSON)
    extra = found["extrapolation"]
    yield row("45 degrees, zone size 0", extra["value"], 1.0, 0.01, DAWSON, extra["order"])
    lane = read("griffiths_lane", zone_sizes=[1.0])
    yield row("2:1, zones of H/10", factors(lane)["meshes"][-1]["value"], 1.37, 0.03 / 1.37, GRIFFITHS)
    associated = read("griffiths_lane", zone_sizes=[1.0], flow='"associated"')
    value = factors(associated)["meshes"][-1]["value"]
    yield row("the same with psi = phi", value, 1.368, [-0.01, 0.03], ASSOCIATED)
    for flow, words, tolerance in (("zero", "psi = 0", [-0.06, 0.0]), ("associated", "psi = phi", [-0.02, 0.02])):
        value = factors(acads(flow, 1.25 if fast else 1.0))["meshes"][-1]["value"]
        yield row(f"ACADS 1(a), zones of H/{8 if fast else 10}, {words}", value, 1.0, tolerance, ACADS)
    paper = read("paper_slope", bracket=[2.4, 2.6], resolution=0.01)
    yield row("slope of the paper", factors(paper)["meshes"][-1]["value"], 2.49, 0.03 / 2.49, PAPER)
    found = factors(cut((4, 8, 16) if fast else (8, 16, 32)))
    yield row("vertical cut, finest mesh", found["meshes"][-1]["value"], 1.0, [-0.01, 0.06], CUT)
    yield row("vertical cut, zone size 0", found["extrapolation"]["value"], 1.0, 0.02, CUT, found["extrapolation"]["order"])
