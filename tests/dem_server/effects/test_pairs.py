"""What two materials combine to, and what `discs.pair` says instead."""

from types import SimpleNamespace

import numpy as np
import pytest
from window_case import OBLIQUE, packed, rim, soil_discs, stone_grain, stones_table

from coupler_protocol.geometry import polygon_area
from coupler_protocol.problems import SceneError
from coupler_protocol.scene.reader import build_scene
from dem_server.effects import RING, SOIL, STONE, law_from
from dem_server.effects.bond import BONDED, Bond
from dem_server.effects.dashpot import Dashpot
from dem_server.effects.friction import Friction
from dem_server.effects.parallel_bond import ParallelBond
from dem_server.effects.rolling import Rolling
from dem_server.effects.spring import Spring, in_series
from dem_server.insitu.hat_bins import bins_over
from dem_server.insitu.takeover import take_over
from dem_server.insitu.virtual_strain import relax
from dem_server.pairs import contacts
from dem_server.stones.bodies import assign_discs
from dem_server.stones.mapped import stones_of
from dem_server.stones.mesostructure import draw

SOIL_SOIL, SOIL_STONE, STONE_SOIL, STONE_STONE = SOIL * 3 + SOIL, SOIL * 3 + STONE, STONE * 3 + SOIL, STONE * 3 + STONE
RING_STONE = RING * 3 + STONE


def cement(normal, shear, tension, strength, radius):
    return ParallelBond(normal_stiffness=normal, shear_stiffness=shear, tension=tension, shear=strength, radius=radius)


def law(pairs=(), soil=None, stone=None):
    """Law of the paper's two materials with more tables, and with `discs.pair`."""
    discs = soil_discs(stone=stone_grain())
    vars(discs.soil).update(soil or {})
    vars(discs.stone).update(stone or {})
    discs.pair = [SimpleNamespace(**pair) for pair in pairs]
    return law_from(discs)


def test_two_materials_combine():
    found = law(
        soil={
            "rolling": Rolling(coefficient=0.3),
            "dashpot": Dashpot(normal=0.4, shear=0.1, tension=True),
            "parallel_bond": cement(1e9, 4e8, 1e5, 3e5, 1.0),
        },
        stone={
            "rolling": Rolling(coefficient=0.2),
            "dashpot": Dashpot(normal=0.1, shear=0.2),
            "parallel_bond": cement(3e9, 0.0, 2e5, 2e5, 0.5),
        },
    )
    for kind in (SOIL_STONE, STONE_SOIL):
        assert found.rolling.coefficient[kind] == 0.2
        kn, ks = in_series(5e7, 5e8), in_series(2e7, 5e8)
        assert found.dashpot.normal[kind] == pytest.approx(2.0 * 0.1 * np.sqrt(kn))
        assert found.dashpot.shear[kind] == pytest.approx(2.0 * 0.1 * np.sqrt(ks))
        assert not found.dashpot.tension[kind]
        assert [column[kind] for column in found.parallel_bond] == [1.5e9, 0.0, 1e5, 2e5, 0.5]
    assert [column[SOIL_SOIL] for column in found.parallel_bond] == [1e9, 4e8, 1e5, 3e5, 1.0]
    assert found.dashpot.tension[SOIL_SOIL]


def test_a_material_without_the_table_has_none_with_others():
    found = law(soil={"rolling": Rolling(coefficient=0.3), "parallel_bond": cement(1e9, 4e8, 1e5, 3e5, 1.0)})
    assert found.rolling.coefficient[[SOIL_SOIL, SOIL_STONE, STONE_SOIL, STONE_STONE]].tolist() == [0.3, 0.0, 0.0, 0.0]
    assert found.parallel_bond.radius[[SOIL_SOIL, SOIL_STONE, STONE_STONE]].tolist() == [1.0, 0.0, 0.0]


def test_a_pair_goes_before_the_combination():
    own = {
        "between": ("stone", "soil"),
        "spring": Spring(normal=7e7, shear=3e7),
        "friction": Friction(coefficient=0.2),
        "bond": Bond(tension=5.0, shear=6.0),
        "rolling": Rolling(coefficient=0.9),
        "dashpot": Dashpot(normal=0.5),
        "parallel_bond": cement(2e9, 1e9, 1.0, 2.0, 0.7),
    }
    found, without = law([own]), law()
    for kind in (SOIL_STONE, STONE_SOIL):
        assert (found.spring.normal[kind], found.spring.shear[kind]) == (7e7, 3e7)  # the contact's own, not in series
        assert found.friction.coefficient[kind] == 0.2
        assert (found.bond.tension[kind], found.bond.shear[kind]) == (5.0, 6.0)
        assert found.rolling.coefficient[kind] == 0.9
        assert found.dashpot.normal[kind] == pytest.approx(2.0 * 0.5 * np.sqrt(7e7))
        assert found.parallel_bond.cohesion[kind] == 2.0
    for kind in (SOIL_SOIL, STONE_STONE, RING_STONE):
        assert found.spring.normal[kind] == without.spring.normal[kind]
        assert found.friction.coefficient[kind] == without.friction.coefficient[kind]
        assert found.rolling.coefficient[kind] == found.parallel_bond.radius[kind] == 0.0


def test_a_pair_may_change_one_effect_alone():
    found, without = law([{"between": ("ring", "stone"), "friction": Friction(coefficient=0.0)}]), law()
    assert found.friction.coefficient[RING_STONE] == 0.0
    assert found.bond.tension[RING_STONE] == without.bond.tension[RING_STONE] == 1.0e6
    assert found.rolling is None
    assert found.dashpot is None
    assert found.parallel_bond is None


@pytest.mark.parametrize("path", ["clump", "cluster", "mapped"])
def test_a_pair_of_soil_and_stone_acts_however_stones_are_made(path, tmp_path):
    """Smooth, never bonded, its own spring: after the discs became stones each contact of soil and stone obeys its pair."""
    discs = soil_discs(stone=stone_grain())
    own = {"friction": Friction(coefficient=0.0), "bond": Bond(tension=0.0, shear=0.0), "spring": Spring(normal=7e7, shear=3e7)}
    discs.pair = [SimpleNamespace(between=("soil", "stone"), **own)]
    model, state = packed(OBLIQUE, discs)
    found = draw(rim(OBLIQUE), stones_table(content=0.35), np.random.default_rng(0))
    if path == "mapped":
        rows = [f"{k},{x!r},{y!r}" for k, outline in enumerate(found.outlines) for x, y in outline.tolist()]
        (tmp_path / "stones.csv").write_text("\n".join(["stone,x,y", *rows]), encoding="utf-8")
        found = stones_of(rim(OBLIQUE), stones_table(file=str(tmp_path / "stones.csv")), None)
    assign_discs(model, state, found.outlines, 2700.0)
    model, _ = take_over(model, state, level(OBLIQUE), 9.81, found, "cluster" if path == "cluster" else "clump")
    relax(model, state, 9.81, 200)
    pairs = contacts(state)
    stony = np.column_stack([state.stone[pairs.disc_a] >= 0, state.stone[pairs.disc_b] >= 0])
    free = (pairs.disc_a >= model.ring) & (pairs.disc_b >= model.ring)
    mixed, soil = free & (stony.sum(axis=1) == 1), free & (stony.sum(axis=1) == 0)
    assert mixed.sum() > 100
    np.testing.assert_allclose(pairs.normal_force[mixed], -7e7 * pairs.gap[mixed], rtol=1e-9, atol=1e-6)
    np.testing.assert_array_equal(pairs.shear_force[mixed], 0.0)
    assert not pairs.bond_state[mixed].any()
    assert (pairs.bond_state[soil] == BONDED).mean() > 0.9
    assert np.abs(pairs.shear_force[soil]).max() > 0.0


def level(corners):
    """Zones (z, 7) of level ground of 2700 kg/m3 under a surface at y = 5 m."""
    points = bins_over(corners, 0.125).points
    yy = -2700.0 * 9.81 * (5.0 - points[:, 1])
    area = np.full(len(points), polygon_area(corners) / len(points))
    return np.column_stack([points, area, 0.571 * yy, yy, 0.0 * yy, np.full(len(points), 2700.0)])


@pytest.mark.parametrize(
    ("pairs", "why"),
    [
        ([{"between": ["soil", "stone"], "friction": {"coefficient": 0.1}}], "no material stone"),
        ([{"between": ["ring", "ring"], "friction": {"coefficient": 0.1}}], "no contacts with each other"),
        ([{"between": ["soil", "soil"]}], "sets nothing"),
        ([{"between": ["soil", "ring"], "rolling": {"coefficient": 0.1}}] * 2, "two tables for the pair"),
        ([{"between": ["soil", "gravel"], "rolling": {"coefficient": 0.1}}], "not known"),
    ],
)
def test_pairs_that_cannot_be(pairs, why):
    scene = {
        "format": 1,
        "seed": 1,
        "grid": {"kind": "box", "length": 9.0, "height": 9.0, "zone_size": 1.0},
        "material": [{"name": "m", "density": 1.0, "elastic": {"bulk": 1.0, "shear": 1.0}}],
        "window": [{"name": "w", "columns": [2, 6], "rows": [2, 6]}],
        "discs": {"radius": 0.1, "soil": {"density": 2.0, "spring": {"normal": 1.0, "shear": 1.0}}, "pair": pairs},
        "stage": [{"name": "fill"}, {"name": "couple", "until": {"steps": 1}}],
    }
    with pytest.raises(SceneError, match=why):
        build_scene(scene)
