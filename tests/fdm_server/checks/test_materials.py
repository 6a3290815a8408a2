"""Materials as drawn and as meshed: areas, thin layers, pieces, materials without zones."""

import tomllib

import numpy as np
import pytest

from coupler_protocol.problems import SceneError
from coupler_protocol.scene.reader import build_scene
from coupler_protocol.scene.rules.between_tables import doubts
from fdm_server.checks.materials import laid_out
from fdm_server.mesh.grid import build_grid

ELASTIC = {"bulk": 5e7, "shear": 2e7}
PROFILE = [[0.0, 5.0], [10.0, 5.0], [15.773502691896258, 15.0], [40.0, 15.0]]
SEAM_TOP = [[6.0, 3.699169847161161], [40.0, 27.50622614629129]]
SEAM_FOOT = [[6.0, 2.478395258399705], [40.0, 26.285451557529832]]  # 1 m below, at 35 degrees


def scene(grid, *materials):
    rows = [{"name": "m", "density": 2000.0, "elastic": ELASTIC}]
    rows += [{"density": 2000.0, "elastic": ELASTIC} | row for row in materials]
    sides = [{"on": "bottom", "fix": "xy"}, {"on": "left", "fix": "x"}, {"on": "right", "fix": "x"}]
    stage = {"name": "rest", "kind": "equilibrium", "gravity": 9.81, "until": {"ratio": 1e-5, "steps": 2000}}
    data = {"format": 1, "seed": 1, "grid": grid, "material": rows, "boundary": sides, "damping": {"local": 0.8}}
    return build_scene(data | {"stage": [stage]})


def box(*materials, zone_size=0.5, **grid):
    return scene({"kind": "box", "length": 2.0, "height": 2.0, "zone_size": zone_size} | grid, *materials)


def seam(zone_size, fit="profile"):
    grid = {"kind": "slope", "length": 40.0, "height": 15.0, "zone_size": zone_size, "fit": fit, "profile": PROFILE}
    return scene(grid, {"name": "seam", "top": SEAM_TOP}, {"name": "base", "top": SEAM_FOOT})


def said(found):
    return [(what, remedy) for path, what, remedy in doubts(found) if path[0] == "material"]


def rows(found):
    return {row.name: row for row in laid_out(found, build_grid(found))}


def test_areas_are_those_of_the_zones_and_of_the_drawing():
    found = rows(
        box({"name": "low", "top": [[0.0, 1.0]]}, {"name": "corner", "region": [[0, 0], [0.5, 0], [0.5, 0.5], [0, 0.5]]})
    )
    assert [(row.zones, row.area) for row in found.values()] == [(8, 2.0), (7, 1.75), (1, 0.25)]
    assert [row.drawn for row in found.values()] == pytest.approx([2.0, 1.75, 0.25])


def test_areas_of_a_slope_are_those_below_its_profile():
    found = rows(seam(0.5))
    ground = 10 * 5 + 5.773502691896258 * 10 + (40 - 15.773502691896258) * 15
    assert sum(row.drawn for row in found.values()) == pytest.approx(ground)
    assert sum(row.area for row in found.values()) == pytest.approx(ground, rel=2e-3)


def test_a_layer_without_zones_is_refused_where_it_lies_and_where_it_is_too_thin():
    with pytest.raises(SceneError) as found:
        box({"name": "soft", "region": [[100.0, 4.0], [110.0, 4.0], [110.0, 8.0]]})
    (problem,) = found.value.problems
    assert problem.key == "material[1]"
    assert "no zone has material 'soft': it is drawn outside of the ground" in problem.reason
    assert "x 0 to 2, y 0 to 2 m" in problem.remedy
    with pytest.raises(SceneError) as found:
        box({"name": "thin", "region": [[0.0, 1.0], [2.0, 1.0], [2.0, 1.2], [0.0, 1.2]]})
    (problem,) = found.value.problems
    assert "drawn with 0.4 m2" in problem.reason
    assert "use zones of at most 0.1 m" in problem.remedy
    with pytest.raises(SceneError, match="no zone has material 'above'"):
        box({"name": "above", "top": [[0.0, -1.0]]})


def test_a_seam_of_one_zone_is_doubted_with_the_zone_size_that_would_do():
    (what, remedy), *_ = said(seam(1.0))
    thick = float(what.split("material 'seam' is ")[1].split(" m thick")[0])
    assert thick == pytest.approx(1.0, rel=0.15)  # 1.22 m where it is level, 1 m at 35 degrees
    assert f"use zones of at most {thick / 2:.2g} m" in remedy
    assert not [what for what, _ in said(seam(0.5)) if "thick" in what]


@pytest.mark.parametrize("fit", ["profile", "face"])
def test_a_level_layer_is_as_thick_as_its_zones_are_high(fit):
    """Flat zones: two of them are enough, however wide they are."""
    grid = {"kind": "slope", "length": 40.0, "height": 15.0, "zone_size": [1.25, 0.625], "fit": fit, "profile": PROFILE}
    layer = [{"name": "weak", "top": [[0.0, 3.75]]}, {"name": "base", "top": [[0.0, 2.5]]}]
    assert said(scene(grid, *layer)) == []
    layer[0]["top"] = [[0.0, 3.125]]
    assert "material 'weak' is 0.625 m thick, 1 zones of 0.625 m" in said(scene(grid, *layer))[0][0]


def test_a_band_in_pieces_is_doubted():
    """A thin band at 27 degrees through square zones: its zones touch in corners."""
    band = [[0.0, 0.2], [2.0, 1.2], [2.0, 1.6], [0.0, 0.6]]
    words = " | ".join(what for what, _ in said(box({"name": "band", "region": band}, zone_size=0.25)))
    assert "1.4 zones of 0.25 m" in words
    stripe = [[0.0, 0.0], [2.0, 2.0], [2.0, 1.7], [0.3, 0.0]]
    words = said(box({"name": "stripe", "region": stripe}, zone_size=0.25))
    assert any("lie in" in what and "pieces, drawn in 1" in what for what, _ in words)


def test_a_top_between_rows_is_doubted_by_area_and_weight():
    """Top at 0.7 m on rows of 0.5 m: one row of zones, 29 % less than drawn; 1,000 kg/m3 lighter, 11 % of the weight."""
    light = {"name": "light", "density": 1000.0, "top": [[0.0, 0.7]]}
    weight = 0.4 * 1000.0 / (1.4 * 1000.0 + 2.6 * 2000.0)
    words = next(both for both in said(box(light)) if "have" in both[0])
    assert "zones of material 'light' have 1 m2, -29 % of the 1.4 m2 drawn" in words[0]
    assert f"{100 * weight:+.2g} % of the weight of the ground" in words[0]
    assert "0.5 or 1 m" in words[1]
    assert not [what for what, _ in said(box(light | {"top": [[0.0, 1.0]]})) if "drawn" in what]
    assert not [what for what, _ in said(box(light, zone_size=0.1)) if "drawn" in what]


def test_a_material_under_others_is_doubted_not_refused():
    whole = [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]]
    (what, _) = said(box({"name": "cover", "region": whole}))[0]
    assert what == "later materials cover all of material 'm'"


def test_regions_of_a_ring_count_only_in_the_ground():
    grid = {"kind": "ring", "part": "quarter", "inner": 1.0, "outer": 10.0, "around": 24}
    data = {"name": "shell", "region": [[0, 0], [3, 0], [3, 3], [0, 3]]}
    found = build_scene(
        {
            "format": 1,
            "seed": 1,
            "grid": grid,
            "material": [{"name": "m", "density": 2500.0, "elastic": ELASTIC}, {"density": 2500.0, "elastic": ELASTIC} | data],
            "boundary": [{"on": "left", "fix": "x"}, {"on": "bottom", "fix": "y"}],
            "damping": {"local": 0.8},
            "stage": [{"name": "rest", "kind": "equilibrium", "until": {"steps": 10}}],
        }
    )
    assert rows(found)["shell"].drawn == pytest.approx(9.0 - np.pi / 4, rel=2e-3)


def test_shipped_scenes_follow_their_materials(configs):
    layered = build_scene(tomllib.loads((configs / "layered_slope.toml").read_text(encoding="utf-8")))
    assert said(layered) == []
    assert all(row.area == pytest.approx(row.drawn, rel=0.05) for row in rows(layered).values())
