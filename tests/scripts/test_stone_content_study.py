"""The study of stones: its series vary what they say, its sentences follow from intervals, and its short form finds them all."""

import importlib.util
import json
from pathlib import Path

import numpy as np
import pytest

from colluvium.ensemble.scenes import Scenes
from coupler_protocol.scene.reader import read_scene
from tests.commands import run_script

SCRIPT = Path(__file__).resolve().parents[2] / "scripts" / "studies" / "stone_content_study.py"


@pytest.fixture(scope="module")
def study():
    """The script as a module."""
    spec = importlib.util.spec_from_file_location("stone_content_study", SCRIPT)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def scenes(study):
    """Scenes of every point by series, with one seed."""
    maker = Scenes(study.SCENE, ())
    return {one.name: maker.checked(study.plan(one, [1], maker)) for one in study.all_series()}


def test_contents_differ_in_their_stones_only(scenes):
    contents = [scene.stones.content if scene.stones else 0.0 for scene in scenes["calibrated clumps"]]
    assert contents == [0.0, 0.15, 0.30, 0.45, 0.60]
    assert len({scene.model_copy(update={"stones": None}).digest() for scene in scenes["calibrated clumps"]}) == 1
    assert {scene.stones.body for scene in scenes["calibrated clusters"]} == {"cluster"}


def test_printed_discs_are_those_of_the_papers_slope_and_calibrated_ones_those_of_the_calibrated_slope(scenes, configs):
    for series, file in (("printed clumps", "paper_slope.toml"), ("calibrated clumps", "calibrated_slope.toml")):
        discs = read_scene(configs / file).discs
        for scene in scenes[series]:
            assert (scene.discs.soil, scene.discs.stone) == (discs.soil, discs.stone)


def test_stones_have_the_directions_and_sizes_of_their_points(scenes):
    for scene, angle in zip(scenes["direction"], (0.0, 45.0, 90.0, 135.0), strict=True):
        assert (scene.stones.azimuth.mean, scene.stones.azimuth.spread) == (angle, 10.0)
    assert [scene.stones.size.mean for scene in scenes["size"]] == [0.15, 0.25, 0.40]
    assert len({scene.stones.content for name in ("direction", "aspect", "angularity", "size") for scene in scenes[name]}) == 1


def test_a_difference_is_told_only_where_its_interval_leaves_out_zero(study):
    """Welch's interval against its formula, and the verdicts of a rise, a fall and chance."""
    low, high = [8.0, 8.2, 8.1, 7.9], [9.0, 9.4, 9.1, 9.3]
    change, begin, end = study.difference(low, high)
    variances = [np.var(one, ddof=1) / 4 for one in (low, high)]
    freedom = sum(variances) ** 2 / sum(v**2 / 3 for v in variances)
    half = study_t(freedom) * np.sqrt(sum(variances))
    assert (change, begin, end) == pytest.approx((1.15, 1.15 - half, 1.15 + half))
    rows = [{"point": name, "failure": values} for name, values in (("a", low), ("b", high), ("c", low), ("d", [7.0, 9.0, 8.4]))]
    assert [text.rpartition(": ")[2] for text in study.sentences(rows)] == [
        "a rise.",
        "a fall.",
        "no difference can be told.",
        "no difference can be told.",
    ]
    assert study.difference([8.0], high) is None


def study_t(freedom):
    """Student's t of a two-sided 95 % interval."""
    from scipy import stats

    return stats.t.ppf(0.975, freedom)


@pytest.mark.long
@pytest.mark.trial
def test_the_short_form_computes_reports_and_reads_again(study, tmp_path):
    pytest.importorskip("matplotlib")
    pytest.importorskip("distributed")
    words = ["--fast", "--seeds", "2", "--only", "calibrated clumps", "--out", tmp_path / "runs", "--json", tmp_path / "s.json"]
    first = run_script("studies/stone_content_study.py", *words, "--page", tmp_path / "page.md", "--pictures", tmp_path)
    assert first.returncode == 0, first.stderr
    rows = json.loads((tmp_path / "s.json").read_text())["calibrated clumps"]
    assert [row["point"] for row in rows] == ["0.00", "0.60"]
    assert all(len(row["failure"]) + len(row["missing"]) == 2 for row in rows)
    assert all(4.0 < value < 20.0 for row in rows for value in row["failure"])
    assert sum(len(row["failure"]) for row in rows) >= 2
    assert "| 0.60 |" in (tmp_path / "page.md").read_text()
    assert (tmp_path / "stone_content.png").is_file()
    again = run_script("studies/stone_content_study.py", *words)
    assert "0 of 4 runs to compute" in again.stderr
    assert again.stdout == first.stdout
