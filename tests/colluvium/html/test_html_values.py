"""Values under the pointer and keys of report.html: its JavaScript in Node, compared with the recorded values."""

import re

import numpy as np
import pytest

from colluvium.html import player
from colluvium.results import window_fields
from colluvium.results.run import open_run
from tests.colluvium.report_page import Page, in_node, needs_node

pytest.importorskip("cmcrameri")
pytestmark = needs_node
STATE = '{frame: %d, zones: "%s", discs: "same", scale: "run", motion: "%s", view: "all", chains: %s, mesh: false}'


@pytest.fixture(scope="module")
def page(stony_folder, tmp_path_factory):
    with open_run(stony_folder) as run:
        return Page(player.write(run, tmp_path_factory.mktemp("page") / "report.html"))


@pytest.fixture(scope="module")
def run(stony_folder):
    with open_run(stony_folder) as run:
        yield run


def state(frame=5, zones="syy", motion="true", chains="false"):
    return STATE % (frame, zones, motion, chains)


def at(page, places, words):
    """Lines of words at places (n, 2) [m]."""
    return in_node(page, f"{np.asarray(places).tolist()}.map(([x, y]) => valuesAt(x, y, {words}))")


def number(line):
    """Value and unit of a line "name: value unit"."""
    value, _, unit = line.rpartition(": ")[2].partition(" ")
    return float(value), unit


def test_every_zone_and_disc_is_found_at_its_middle(page, run):
    zones, gridpoints, discs = run.zones(5), run.gridpoints(5), run.discs(5)
    now = (gridpoints.xy + gridpoints.displacement)[zones.corners]
    middles = np.where((zones.corners[:, 2] == zones.corners[:, 3])[:, None], now[:, :3].mean(axis=1), now.mean(axis=1))
    found = in_node(
        page,
        f"[{middles.tolist()}.map(([x, y]) => zoneAt(run.frames[5].grid, 1, x, y)), "
        f"{discs.xy.tolist()}.map(([x, y]) => discAt(run.frames[5].windows[0], 1, x, y))]",
    )
    assert found == [list(range(len(zones.corners))), list(range(len(discs.xy)))]


def test_beside_the_slope_there_is_no_value(page):
    assert at(page, [[1.0, 11.0], [-1.0, 1.0], [10.0, -0.01]], state()) == [None, None, None]


@pytest.mark.parametrize(
    ("key", "name", "of", "unit", "factor"),
    [
        ("syy", "vertical stress syy, tension +, averaged at gridpoints", lambda run: run.smoothed_stress(1)[:, 1], "MPa", 1e-6),
        ("sxy", "shear stress sxy, averaged at gridpoints", lambda run: run.smoothed_stress(1)[:, 3], "kPa", 1e-3),
        ("shear_strain", "shear strain", lambda run: run.zones(1).shear_strain, "", 1.0),
        ("shear_strain_rate", "shear strain rate", lambda run: run.zones(1).shear_strain_rate, "1 per step", 1.0),
    ],
)
def test_a_zone_has_the_recorded_value_with_name_and_unit(page, run, key, name, of, unit, factor):
    zones = run.zones(1)
    shown = [0, 100, len(zones.corners) // 2]
    lines = at(page, zones.xy[shown], state(1, key))
    for zone, (place, what, line) in zip(shown, lines, strict=True):
        assert place == f"x {zones.xy[zone, 0]:.2f} m, y {zones.xy[zone, 1]:.2f} m"
        assert what == f"zone {zone}"
        assert line.startswith(f"{name}: ")
        value, shown_unit = number(line)
        assert value == pytest.approx(factor * of(run)[zone], rel=1e-3)
        assert shown_unit == unit


def test_a_disc_covers_the_zones_and_has_its_radius_stone_and_bin(page, run):
    discs, bins = run.discs(4), window_fields.bins(run, 4)
    means = window_fields.mean_stress(run, 4, bins)[:, 1][bins.of(window_fields.starting_places(discs))]
    stony, soil = int(np.flatnonzero(discs.stone >= 0)[3]), int(np.flatnonzero((discs.stone < 0) & (discs.control == 0))[5])
    lines = at(page, discs.xy[[stony, soil]], state(4, "syy"))
    assert [words[1] for words in lines] == [f"disc, radius 50 mm, of stone {discs.stone[stony]}", "disc, radius 50 mm"]
    for row, words in zip((stony, soil), lines, strict=True):
        assert words[2].startswith("vertical stress syy, tension +: ")
        assert words[2].endswith(" MPa (mean of its bin)")
        assert float(words[2].rpartition(": ")[2].split()[0]) == pytest.approx(1e-6 * means[row], rel=1e-3)
    size = np.hypot(*discs.displacement.T)
    far, near = int(size.argmax()), int(size.argmin())
    assert size[near] < 1e-6
    moved, still = at(page, discs.xy[[far, near]], state(4, "displacement"))
    assert number(moved[2]) == (pytest.approx(size[far], rel=1e-3), "m")
    assert re.fullmatch(r"displacement: 0 ± \de-6 m", still[2])


def test_a_disc_of_force_chains_has_its_largest_contact_force(page, run):
    contacts = run.contacts(5)
    force, disc = contacts.normal_force, int(contacts.ends[700, 0])
    own = force[(contacts.ends == disc).any(axis=1)]
    largest = own[np.abs(own).argmax()]
    words = at(page, run.discs(5).xy[[disc]], state(5, "plain", chains="true"))[0]
    assert words[2].startswith("displacement: ")
    assert number(words[3]) == (pytest.approx(1e-3 * largest, rel=1e-3), "kN per m")


def test_the_plastic_state_is_told_in_words(page, run):
    told = {0: "never yielded", 4: "shear past", 5: "shear now, shear past"}
    zones, gridpoints = run.zones(5), run.gridpoints(5)
    now = (gridpoints.xy + gridpoints.displacement)[zones.corners].mean(axis=1)
    quads = zones.corners[:, 2] != zones.corners[:, 3]
    shown = [int(np.flatnonzero((zones.plastic_state == bits) & quads)[0]) for bits in told]
    lines = [words[1:3] for words in at(page, now[shown], state(5, "plastic"))]
    assert lines == [[f"zone {zone}", f"plastic state: {words}"] for zone, words in zip(shown, told.values(), strict=True)]


def test_bodies_are_where_they_are_drawn(page, run):
    """Displacements that are not drawn do not move what lies under the pointer."""
    discs = run.discs(5)
    start = discs.xy - discs.displacement
    row = int(np.hypot(*discs.displacement.T).argmax())
    words = at(page, start[[row]], state(5, "displacement", motion="none"))[0]
    assert number(words[2])[0] == pytest.approx(np.hypot(*discs.displacement[row]), rel=1e-3)
    assert at(page, start[[row]], state(5, "displacement"))[0] != words


def test_numbers_have_no_digit_below_the_stored_step(page):
    told = {
        "123.456": "123.5",
        "0.00012345": "1.234e-4",
        "123456": "1.235e+5",
        "-230.04, 10": "-230",
        "14, 10": "10",
        "-3, 10": "0 ± 10",
        "0, 4.6e-6": "0 ± 5e-6",
        "0": "0",
        "NaN": "none",
    }
    assert in_node(page, f"[{', '.join(f'digits({given})' for given in told)}]") == list(told.values())


def points_of(page, plot):
    """Places of the points of each line of a plot, as the browser reads them."""
    svg = re.findall(r"<svg .*?</svg>", page.text, re.DOTALL)[plot]
    lines = re.findall(r'<polyline points="(.*?)"', svg)
    return [[[float(number) for number in pair.split(",")] for pair in line.split(" ")] for line in lines]


def test_histories_have_their_recorded_values(page, run):
    """The ratio of both sides at one place: float32 of the recorded value, also where it is far below the largest."""
    told = page.run["plots"][0]
    points = points_of(page, 0)
    assert told["names"] == ["continuum, rank 0", "discrete, rank 1"]
    steps, ratio = run.history("unbalanced_ratio", 0)
    assert len(steps) == len(points[0]) == 600
    row = int(ratio.argmin())
    x = points[0][row][0]
    found = in_node(page, f"plotValuesAt(run.plots[0], {points}, {x + 0.2}, 50)")
    mine, other = found["words"]
    assert mine.startswith("continuum, rank 0, step ")
    at_step = int(mine.split("step ")[1].split(":")[0].replace(",", ""))
    assert abs(at_step - steps[row]) <= 10
    assert number(mine)[0] == pytest.approx(ratio[steps == at_step][0], rel=1e-3)
    assert other.startswith("discrete, rank 1, step ")
    assert len(found["spots"]) == 2
    for line, name, rank in zip(told["lines"], ("unbalanced_ratio",) * 2, (0, 1), strict=True):
        recorded = run.history(name, rank)
        assert page.array(line[0]).tolist() == recorded[0].tolist()
        assert page.array(line[1]).tolist() == recorded[1].astype(np.float32).tolist()


def test_a_curve_has_values_near_it_only(page):
    asked = """
        const plot = { curve: true, x: { name: "settlement", unit: "mm" }, unit: "kN", names: ["reaction"],
          lines: [page.map((values) => run.arrays.push(values) - 1)] };
        const array = data.array;
        data.array = (number) => run.arrays[number];
        const line = [[[60, 140], [100, 100], [140, 90]]];
        const found = [plotValuesAt(plot, line, 103, 98), plotValuesAt(plot, line, 103, 120)];
        data.array = array;
        return found;
    """
    found = in_node(page, "((page) => {" + asked + "})([[0, 2, 4.5], [0, 80.25, 100]])")
    assert found[0] == {"words": ["settlement 2 mm: 80.25 kN"], "spots": [[100, 100]]}
    assert found[1] == {"words": [], "spots": []}


def test_a_time_axis_has_seconds_where_the_stage_is_in_real_time(page):
    time = [
        {"real": False, "start": 0, "end": 0.25, "first": 0, "last": 100},
        {"real": True, "start": 0.25, "end": 1, "first": 0, "last": 0.6},
    ]
    asked = f"(() => {{ run.time = {str(time).replace('True', 'true').replace('False', 'false')};"
    found = in_node(page, asked + "return [20, 85, 110].map((x) => timeWords(x, { left: 10, inner: 100 })) })()")
    assert found == ["", " (0.4 s)", " (0.6 s)"]


def test_force_chains_have_a_key_with_the_drawn_widths_and_its_scale(page):
    """A hundredth of the largest force has a tenth of the width; the key follows zoom and scale."""
    asked = """[300, 600].map((pixels) => legend(%s, { pixels, ratio: 1 }).at(-1))"""
    near, nearer = in_node(page, asked % state(3, "syy", chains="true"))
    assert near["name"] == "normal contact force; width grows with its root, one scale for all frames"
    widths = np.array([sign[3] for sign in near["signs"][:3]])
    assert [float(sign[2].split()[0]) for sign in near["signs"][:3]] == pytest.approx(
        [float(f"{1e-3 * part * page.run['chains']['run']:.2g}") for part in (1.0, 0.1, 0.01)]
    )
    np.testing.assert_allclose(widths, 300 * 0.05 * np.array([11.5, 3.5, 1.5]) / 12, rtol=1e-3)
    np.testing.assert_allclose([sign[3] for sign in nearer["signs"][:3]], 2.0 * widths, rtol=1e-6)
    own = in_node(page, (asked % state(3, "syy", chains="true").replace('"run"', '"frame"')))[0]
    assert own["name"].endswith("scale of this frame")
    assert own["signs"][0][2] != near["signs"][0][2]
