"""Factors of safety by strength reduction on coarse meshes: published slopes, and the trials close to the factor found."""

from math import pi, radians, tan

import pytest
from verification.continuum import slopes

from colluvium import Scene
from coupler_protocol.scene.reader import read_scene
from coupler_protocol.scene.tables.boundary import Boundary
from fdm_server.fos.bracket import search
from fdm_server.fos.ground import settle, with_zone_size
from fdm_server.fos.trial import run_trial
from fdm_server.fos.verdict import FAILS, RESTS


@pytest.fixture(scope="module")
def found(configs):
    """A function of (scene, zone size): (ground, bracket, scene), the search of each made once."""
    done = {}

    def factor(name, size, *changes):
        key = name, size, changes
        if key not in done:
            scene = with_zone_size(read_scene(configs / f"{name}.toml", changes), size)
            ground = settle(scene)
            bracket = search(lambda f: run_trial(scene, ground, f).verdict, scene.fos.bracket, scene.fos.resolution)
            done[key] = ground, bracket, scene
        return done[key]

    return factor


def test_dawson_roth_and_drescher_1999(found):
    """45 degrees, phi = psi = 20, c = 12.38 kPa, H = 10 m: 1 by limit analysis; a mesh of H/12 is some per cent too strong."""
    _, bracket, _ = found("dawson_slope", 10 / 12)
    assert 0.99 < bracket.middle < 1.04


def test_griffiths_and_lane_1999(found):
    """Example 1: 2:1, phi = 20, psi = 0, c = .05 gamma H; upper bound of limit analysis 1.368, Bishop 1.380."""
    _, bracket, _ = found("griffiths_lane", 1.25)
    assert bracket.middle == pytest.approx(1.37, abs=0.03)


def test_published_slopes_with_both_flow_rules(found):
    """Griffiths & Lane's slope and ACADS 1(a) (limit analysis 1.368, referee 1.00): psi = phi; psi = 0 is weaker."""
    _, zero, _ = found("griffiths_lane", 1.25)
    _, associated, _ = found("griffiths_lane", 1.25, 'fos.flow="associated"')
    assert 1.368 < associated.middle < 1.368 * 1.03
    assert 0.01 < associated.middle - zero.middle < 0.05
    factors = []
    for flow in ("zero", "associated"):
        scene = slopes.acads(flow, 1.25)
        ground = settle(scene)
        factors.append(search(lambda f, s=scene, g=ground: run_trial(s, g, f).verdict, (0.9, 1.1), 0.01).middle)
    assert factors == [pytest.approx(0.967, abs=0.01), pytest.approx(1.017, abs=0.01)]


def test_triangles_on_the_face_are_stronger(found):
    """Why the scene asks for columns along the face: with a face along the diagonals of cells the error is larger by half."""
    _, along, _ = found("dawson_slope", 10 / 12)
    _, cut, _ = found("dawson_slope", 10 / 12, 'grid.fit="diagonals"')
    assert 1.4 < (cut.middle - 1.0) / (along.middle - 1.0) < 2.2


@pytest.mark.parametrize(("name", "size"), [("dawson_slope", 10 / 12), ("griffiths_lane", 1.25)])
def test_one_per_cent_off_is_told_apart(found, name, size):
    """Trials at .99 and 1.01 of the mesh's own factor get their verdicts within the budget, with associated flow and without."""
    ground, bracket, scene = found(name, size)
    below, above = (run_trial(scene, ground, share * bracket.middle) for share in (0.99, 1.01))
    assert (below.verdict, above.verdict) == (RESTS, FAILS)
    assert max(below.steps, above.steps) < 0.5 * ground.budget


def test_stiffness_does_not_matter(found):
    """A factor of safety is a matter of strength: ten times stiffer ground, the same factor."""
    _, soft, _ = found("dawson_slope", 10 / 8)
    _, stiff, _ = found("dawson_slope", 10 / 8, "material.0.elastic.bulk=1e9", "material.0.elastic.shear=3e8")
    assert stiff.middle == pytest.approx(soft.middle, abs=0.004)


STEEP = ("grid.profile=[[0,5],[10,5],[15.773502691896258,15],[35,15]]", "material.0.mohr_coulomb.cohesion=19247.4256568184")
SOFT = ("material.0.elastic.bulk=3e5", "material.0.elastic.shear=1.38e5")  # settles by 3 m
STIFF = ("material.0.elastic.bulk=1e8", "material.0.elastic.shear=4.6e7")  # by 9 mm


def test_ground_that_settles_by_metres_has_the_same_factor(found):
    """60 degrees: c = 19.25 kPa, K = 100 MPa or 0.3 MPa, where elastic settlement once counted as a run-out (1.07 and 1.00)."""
    search = ("fos.bracket=[0.95,1.15]", "fos.resolution=0.01")
    _, stiff, _ = found("dawson_slope", 1.25, *STEEP, *STIFF, *search)
    _, soft, _ = found("dawson_slope", 1.25, *STEEP, *SOFT, *search)
    assert (soft.low, soft.high) == (stiff.low, stiff.high)
    assert soft.middle == pytest.approx(1.072, abs=0.004)


@pytest.mark.parametrize("scale", [1 / 64, 32.0])
def test_size_does_not_matter(found, scale):
    """The same slope drawn 64 times smaller or 32 times larger, cohesion with it: the same trials, verdict by verdict."""
    _, one, scene = found("dawson_slope", 1.25, *STEEP, *SOFT, "fos.resolution=0.02")
    grid = scene.grid.model_copy(update={
        "length": scene.grid.length * scale, "height": scene.grid.height * scale,
        "zone_size": tuple(size * scale for size in scene.grid.zone_size),
        "profile": [(x * scale, y * scale) for x, y in scene.grid.profile],
    })  # fmt: skip
    law = scene.material[0].mohr_coulomb
    law = law.model_copy(update={"cohesion": law.cohesion * scale})
    scene = scene.model_copy(update={"grid": grid, "material": [scene.material[0].model_copy(update={"mohr_coulomb": law})]})
    ground = settle(scene)
    other = search(lambda f: run_trial(scene, ground, f).verdict, scene.fos.bracket, scene.fos.resolution)
    assert other.tried == one.tried


def test_units_do_not_matter(found):
    """Stresses in kPa with densities in t/m3: numbers a thousand times smaller, the same trials, verdict by verdict."""
    _, one, _ = found("dawson_slope", 1.25, *STEEP, *SOFT, "fos.resolution=0.02")
    law = ("material.0.elastic.bulk=3e2", "material.0.elastic.shear=1.38e2", "material.0.mohr_coulomb.cohesion=19.2474256568184")
    _, other, _ = found("dawson_slope", 1.25, STEEP[0], *law, "material.0.density=2.0", "fos.resolution=0.02", "units=any")
    assert other.tried == one.tried


def infinite_slope(angle, friction, length=20.0, thick=2.0, size=0.5):
    """A layer of sand, psi = phi, c = 0, on rock that does not yield, between smooth ends."""
    rise, base = length * tan(radians(angle)), 1.0
    beyond = tan(radians(angle))
    layer = [[-1.0, base - beyond], [length + 1.0, base + rise + beyond], [length + 1.0, base + rise + thick + 5.0], [-1.0, 9.0]]
    rock = {"name": "rock", "density": 2000.0, "elastic": {"bulk": 1e10, "shear": 4.6e9}}
    law = {"friction": friction, "cohesion": 0.0, "dilation": friction}
    sand = {"name": "sand", "density": 2000.0, "elastic": {"bulk": 1e8, "shear": 4.6e7}, "mohr_coulomb": law, "region": layer}
    profile = [[0.0, base + thick], [length, base + thick + rise]]
    grid = {
        "kind": "slope",
        "length": length,
        "height": base + thick + rise,
        "zone_size": size,
        "profile": profile,
        "fit": "profile",
    }
    return Scene(
        format=1, seed=1, grid=grid, material=[rock, sand], damping={"local": 0.8},
        boundary=[{"on": "left", "fix": "x"}, {"on": "right", "fix": "x"}, {"on": "bottom", "fix": "xy"}],
        stage=[{"name": "equilibrium", "gravity": 10.0, "until": {"ratio": 1e-5, "steps": 60_000}}],
    )  # fmt: skip


def test_sand_that_flows_in_equilibrium_fails():
    """25 degrees, phi = psi = 30, tan(phi)/tan(25) = 1.238: at 1.225 the layer flows at constant speed while the ratio falls to
    1e-8, because nothing but a change of the field takes its momentum; at 1.1 and 1.2 it rests."""
    scene = infinite_slope(25.0, 30.0)
    ground = settle(scene)
    below, near, flows, beyond = (run_trial(scene, ground, factor) for factor in (1.1, 1.2, 1.225, 1.25))
    assert [trial.verdict for trial in (below, near, flows, beyond)] == [RESTS, RESTS, FAILS, FAILS]
    assert flows.spans[-1].last_ratio < 1e-4 * flows.spans[0].last_ratio
    assert flows.steps < 0.25 * ground.budget


def test_weight_and_cohesion_go_together(found):
    """Cohesion and gravity enter as c/(gamma H) alone: twice of each, the same factor."""
    _, one, _ = found("dawson_slope", 10 / 8)
    _, two, _ = found("dawson_slope", 10 / 8, "material.0.mohr_coulomb.cohesion=24.76e3", "stage.0.gravity=20.0")
    assert two.middle == pytest.approx(one.middle, abs=0.004)


def test_gravity_of_frictionless_ground(found):
    """Without friction only c/(gamma H) counts: the gravity at collapse is the factor of safety (with friction it is not)."""
    tresca = ("material.0.mohr_coulomb.friction=0.0", "material.0.mohr_coulomb.dilation=0.0",
              "material.0.mohr_coulomb.cohesion=40e3")  # fmt: skip
    _, strength, _ = found("dawson_slope", 10 / 8, *tresca)
    _, gravity, _ = found("dawson_slope", 10 / 8, *tresca, 'fos.by="gravity"')
    assert gravity.middle == pytest.approx(strength.middle, rel=0.004)


def test_under_the_gravity_at_collapse_the_factor_of_safety_is_one(found):
    """Two searches of different kinds agree where they must, with friction, without dilation, with a tension cut-off."""
    _, gravity, _ = found("paper_slope", 2 / 3, 'fos.by="gravity"', "fos.bracket=[7.0,10.0]")
    heavy = f"stage.0.gravity={9.81 * gravity.middle}"
    _, strength, _ = found("paper_slope", 2 / 3, heavy, "fos.bracket=[0.9,1.1]")
    assert strength.middle == pytest.approx(1.0, abs=0.01)


def test_a_flexible_strip_on_clay_without_weight(configs):
    """A pressure of (2 + pi) c/1.2 on Tresca clay, no gravity: factor of safety 1.2 (Prandtl 1921), more on a mesh."""
    scene = with_zone_size(read_scene(configs / "footing.toml"), 0.25)
    pressure = (2.0 + pi) * scene.material[0].mohr_coulomb.cohesion / 1.2
    stage = scene.stage[0].model_copy(update={"boundary": [Boundary(on="top", x=(0.0, 1.0), pressure=pressure)]})
    scene = scene.model_copy(update={"stage": [stage]})
    ground = settle(scene)
    bracket = search(lambda f: run_trial(scene, ground, f).verdict, (1.0, 1.5), 0.005)
    assert 1.19 < bracket.middle < 1.25
