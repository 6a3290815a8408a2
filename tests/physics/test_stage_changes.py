"""Changes of laws from a stage on: what a changed friction, strength, bond, damping or stiffness does, against closed forms."""

from math import cos, radians, sin, sqrt, tan

import numpy as np
import pytest
from run_cases import compute, stage
from verification.discrete import scenes

from fdm_server.effects.mohr_coulomb import passive_ratio

G, R, KN = 9.81, 0.03, 5e7
STONE = {"density": 2000.0, "spring": {"normal": KN, "shear": 2e7}, "friction": {"coefficient": 0.6}}
SLOPE = radians(20.0)


def sledge(folder, *stages):
    """The run of a rigid body of two discs on a wall of 20 degrees, which it can only slide down."""
    normal, along = np.array([sin(SLOPE), cos(SLOPE)]), np.array([cos(SLOPE), -sin(SLOPE)])
    rows = [",".join(map(repr, [*(R * normal - shift * along).tolist(), R])) + ",0" for shift in (0.0, 4.0 * R)]
    (folder / "discs.csv").write_text("\n".join(["x,y,radius,stone", *rows]) + "\n")
    wall = [{"ends": [(-along).tolist(), (3.0 * along).tolist()]}]
    table = {"wall": wall, "soil": STONE, "stone": STONE, "file": str(folder / "discs.csv"), "damping": {"local": 0.7}}
    return scenes.of_tables(scenes.tables([*stages], table, every=100000))


def real(name, seconds, **more):
    return {"name": name, "kind": "discs", "time": "real", "step_factor": 0.2, "until": {"time": seconds}} | more


def friction(value):
    return {"stone": {"friction": {"coefficient": value}}}


def test_a_block_slides_once_its_friction_is_below_the_slope(tmp_path):
    """tan 20 deg = 0.364: it holds at 0.6 and 0.37, slides at 0.3 by g (sin - mu cos) t^2 / 2: damping has ended before."""
    rest = {"name": "rest", "kind": "discs", "gravity": G, "until": {"ratio": 1e-9, "steps": 20000}}
    undamped = friction(0.37) | {"damping": False}
    stages = [rest, real("holds", 0.2, discs=undamped), real("slides", 0.2, discs=friction(0.3)), real("on", 0.2)]
    with sledge(tmp_path, *stages) as run:
        way = {name: np.hypot(*run.discs(run.last_frame(name)).displacement[0]) for name in ("rest", "holds", "slides", "on")}
        assert way["holds"] - way["rest"] < 1e-6
        a = G * (sin(SLOPE) - 0.3 * cos(SLOPE))
        assert way["slides"] - way["holds"] == pytest.approx(0.5 * a * 0.2**2, rel=1e-3)
        assert way["on"] - way["holds"] == pytest.approx(0.5 * a * 0.4**2, rel=1e-3)  # the change lasts
        changes = [row.get("changes") for row in run.info["stages"]]
        assert changes[:2] == [None, None]
        assert changes[2]["what"] == ["discs: damping ends", "discs.stone: friction.coefficient 0.6 -> 0.37"]
        assert changes[4] is None


def column(load, factor, phi=20.0, c=10e3):
    """Displacement [m] under `load` [Pa] of an unconfined column whose strength is divided by `factor` in a second stage."""
    strong = {"friction": phi, "cohesion": c}
    weak = {"friction": float(np.degrees(np.arctan(tan(radians(phi)) / factor))), "cohesion": c / factor}
    soil = {"name": "soil", "density": 2000.0, "elastic": {"bulk": 2e7, "shear": 1e7}, "mohr_coulomb": strong}
    grid = {"kind": "box", "length": 1.0, "height": 2.0, "zone_size": 0.5}
    sides = [{"on": "bottom", "fix": "y"}, {"on": "left", "y": [0.0, 0.1], "fix": "x"}, {"on": "top", "pressure": load}]
    stages = [
        stage("load", steps=2000),
        stage("weaken", steps=3000, material=[{"name": "soil", "mohr_coulomb": weak}]),
    ]
    return grid, stages, sides, soil


@pytest.mark.parametrize(("share", "fails"), [(0.98, False), (1.02, True)])
def test_strength_reduced_by_hand_fails_at_the_closed_form(tmp_path, share, fails):
    """q = 2 c sqrt(N), with c and tan(phi) divided by the factor for which the column bears q only just."""
    factor = 1.4
    phi = float(np.degrees(np.arctan(tan(radians(20.0)) / factor)))
    load = 2.0 * (10e3 / factor) * sqrt(passive_ratio(phi))
    grid, stages, sides, soil = column(load, factor * share)
    with compute(tmp_path / "run", grid, *stages, boundary=sides, material=[soil]) as run:
        way = [abs(run.gridpoints(run.last_frame(name)).displacement).max() for name in ("load", "weaken")]
        assert run.info["stages"][0].get("changes") is None
        assert len(run.info["stages"][1]["changes"]["what"]) == 2
        assert (way[1] > 3.0 * way[0]) == fails


def test_the_ledger_is_closed_after_a_change_of_strength_and_stiffness(tmp_path):
    """Stresses stay, so that the strain energy jumps by the moduli; that is in run.json, and the stage's ledger is closed."""
    grid, stages, sides, soil = column(15e3, 1.5)
    stages[1]["material"][0]["elastic"] = {"young": 4e7}
    with compute(
        tmp_path / "run", grid, *stages, boundary=sides, material=[soil], record={"every": 100, "history": 10, "energy": True}
    ) as run:
        changes = run.info["stages"][1]["changes"]
        before, after = changes["strain_energy"]
        young = 9.0 * 2e7 * 1e7 / (3.0 * 2e7 + 1e7)
        assert after == pytest.approx(before * young / 4e7, rel=1e-9)  # nu stays
        steps, error = run.history("energy_error")
        plastic = run.history("energy_plastic")[1]
        assert plastic[steps > 2100].max() > 0.0
        assert np.abs(error).max() < 1e-9 * run.history("energy_external")[1].max()
        zones = run.zones(run.last_frame("load"))
        assert zones.plastic_state.max() == 0


BOX = [[0.0, 0.0], [0.8, 0.0], [0.8, 0.8], [0.0, 0.8]]


def pressed(first, then, **discs):
    """The run of loose discs in a box of servo walls: pressed with the first change of their law, then again with the other."""
    sides = zip(BOX, BOX[1:] + BOX[:1], strict=True)
    wall = [{"name": str(k), "ends": [a, b], "servo": {"pressure": 50e3, "fastest": 2e-4}} for k, (a, b) in enumerate(sides)]
    soil = {"density": 2000.0, "spring": {"normal": KN, "shear": 2e7}, "friction": {"coefficient": 0.0}}
    until = {"ratio": 2e-3, "steps": 20000}
    stages = [{"name": name, "kind": "discs", "until": until} | change for name, change in (("press", first), ("on", then))]
    table = {"radius": 0.04, "target": "porosity", "porosity": 0.23, "damping": {"local": 0.7}, "soil": soil, "wall": wall}
    window = [{"name": "box", "polygon": BOX}]
    return scenes.of_tables(scenes.tables(stages, table | discs, window=window, every=100000))


def porosity(run, name):
    return run.porosity(run.last_frame(name), (0.4, 0.4, 0.28))


FRICTION = {"discs": {"soil": {"friction": {"coefficient": 1.0}}}}


def test_discs_pressed_without_friction_are_denser():
    """And friction that comes later leaves their density, and the stress on them."""
    with pressed({}, FRICTION) as smooth, pressed(FRICTION, {}) as rough:
        dense, loose = porosity(smooth, "press"), porosity(rough, "press")
        assert dense < loose - 0.01
        assert porosity(smooth, "on") == pytest.approx(dense, abs=1e-3)
        assert smooth.info["stages"][2]["changes"]["what"] == ["discs.soil: friction.coefficient 0 -> 1"]


WALL = [{"on": "left", "fix": "x"}, {"on": "right", "fix": "x"}, {"on": "bottom", "fix": "xy"}]
GROUND = {"name": "soil", "density": 2000.0, "elastic": {"bulk": 2e7, "shear": 1e7}}
PIT = {"excavate": {"columns": [0, 1], "rows": [3, 3], "over": 40}}
FILL = {"surcharge": {"x": [0.0, 2.0], "pressure": 1e4, "over": 40}}


@pytest.mark.parametrize(("kind", "change"), [("excavate", PIT), ("surcharge", FILL)])
def test_boundaries_change_with_an_excavation_or_a_surcharge(tmp_path, kind, change):
    """Elastic ground: a pressure beside and on the same gridpoints, in the same stage or after it, gives the same shape."""
    grid = {"kind": "box", "length": 4.0, "height": 2.0, "zone_size": 0.5}
    push = {"boundary": [{"on": "top", "x": [1.0, 3.0], "pressure": 2e4, "over": 60}]}
    rest = stage("rest", steps=4000, ratio=1e-9, gravity=G)
    both = [rest, stage("both", kind, steps=4000, ratio=1e-9, **change, **push)]
    turns = [rest, stage("one", kind, steps=4000, ratio=1e-9, **change), stage("other", steps=4000, ratio=1e-9, **push)]
    found = []
    for name, stages in (("both", both), ("turns", turns)):
        with compute(tmp_path / name, grid, *stages, boundary=WALL, material=[GROUND]) as run:
            found.append(run.gridpoints(-1).displacement)
            there = np.unique(run.zones(-1).corners)
    scale = np.abs(found[1][there]).max()
    np.testing.assert_allclose(found[0][there], found[1][there], atol=1e-4 * scale)


def test_a_pressure_of_the_scene_acts_beside_a_surcharge_in_the_first_stage(tmp_path):
    grid = {"kind": "box", "length": 4.0, "height": 2.0, "zone_size": 0.5}
    push = {"on": "top", "x": [1.0, 3.0], "pressure": 2e4}
    fill = stage("fill up", "surcharge", steps=4000, ratio=1e-9, **FILL)
    found = []
    for name, stages, sides in (
        ("both", [fill], [*WALL, push]),
        ("turns", [stage("press", steps=4000, ratio=1e-9, boundary=[push]), fill], WALL),
    ):
        with compute(tmp_path / name, grid, *stages, boundary=sides, material=[GROUND]) as run:
            found.append(run.gridpoints(-1).displacement)
    np.testing.assert_allclose(*found, atol=1e-4 * np.abs(found[1]).max())


def test_a_discarded_stage_leaves_materials_as_they_were(tmp_path):
    """Strength that a discarded stage takes away is back in the next one, to the last bit; so it is after an equilibrium."""
    strong = GROUND | {"mohr_coulomb": {"friction": 20.0, "cohesion": 1e4}}
    grid = {"kind": "box", "length": 2.0, "height": 2.0, "zone_size": 0.5}
    weak = stage("weak", "equilibrium", steps=100, discard=True, material=[{"name": "soil", "mohr_coulomb": False}])
    weaker = stage("weaker", "locate", steps=100, discard=True, material=[{"name": "soil", "mohr_coulomb": {"cohesion": 10.0}}])
    rest, load = (
        stage("rest", "equilibrium", steps=200, gravity=G),
        stage("load", steps=200, boundary=[{"on": "top", "pressure": 1e5}]),
    )
    found = []
    for name, stages in (("with", [rest, weak, weaker, load]), ("without", [rest, load])):
        with compute(tmp_path / name, grid, *stages, boundary=WALL, material=[strong], units="any") as run:
            found.append(run.zones(-1).stress.tobytes() + run.gridpoints(-1).displacement.tobytes())
            assert run.info["exit_code"] == 0
    assert found[0] == found[1]
