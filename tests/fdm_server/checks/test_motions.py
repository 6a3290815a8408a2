"""Motions of sides: what a scene must say, and motions that drift, strike, or are too fast for the zones."""

import numpy as np
import pytest

from coupler_protocol.problems import SceneError
from coupler_protocol.scene.reader import build_scene
from fdm_server.checks.motions import doubts_of_motions
from fdm_server.mesh.grid import build_grid
from tests.small_grounds import REST, TABLES

SLOW = 2.0  # Hz


def scene(tmp_path, rows, *, names="time,x", until=None, stage=None, **table):
    """A scene of which a stage shakes the bottom by rows of a file."""
    np.savetxt(tmp_path / "base.csv", rows, delimiter=",", header=names, comments="")
    shaking = {"file": "base.csv", "base": "rigid", "x": 1.0} | table
    own = {"name": "shake", "kind": "load", "time": "real", "until": {"time": until or 10.0}} | (stage or {})
    own["boundary"] = [{"on": "bottom", "shaking": {k: v for k, v in shaking.items() if v is not None}}]
    return build_scene(TABLES | {"stage": [REST, own]}, folder=tmp_path)


def burst(frequency, cycles=4):
    """Rows of a motion that begins and ends at rest where it began."""
    time = np.linspace(0.0, cycles / frequency, 40 * cycles + 1)
    return np.column_stack([time, np.sin(np.pi * time / time[-1]) ** 2 * np.sin(2.0 * np.pi * frequency * time)])


def doubted(found):
    return [f"{what}; {remedy}" for _, what, remedy in doubts_of_motions(found, build_grid(found))]


def refused(*arguments, **more):
    with pytest.raises(SceneError) as caught:
        scene(*arguments, **more)
    return {(problem.key, problem.reason) for problem in caught.value.problems}


def test_a_motion_without_fault_is_not_doubted(tmp_path):
    assert doubted(scene(tmp_path, burst(SLOW))) == []


def test_a_motion_that_drifts(tmp_path):
    rows = burst(SLOW)
    rows[:, 1] += 0.2 * np.sin(np.pi * rows[:, 0] / rows[-1, 0])
    (words,) = doubted(scene(tmp_path, rows))
    assert "drifts" in words
    assert "baseline" in words


def test_a_motion_that_ends_in_its_middle(tmp_path):
    rows = burst(SLOW)
    assert "taper" in " ".join(doubted(scene(tmp_path, rows[: 3 * len(rows) // 4])))
    assert "in the middle of the motion" in " ".join(doubted(scene(tmp_path, rows, until=0.5)))


def test_a_motion_that_is_too_fast_for_the_zones(tmp_path):
    found = scene(tmp_path, burst(SLOW))
    elastic = found.material[0].elastic
    limit = np.sqrt(elastic.shear / found.material[0].density) / (10.0 * 0.5)  # zones of 0.5 m
    (words,) = doubted(scene(tmp_path, burst(2.0 * limit)))
    assert f"above {limit:.3g} Hz" in words
    assert doubted(scene(tmp_path, burst(0.5 * limit))) == []


def test_what_is_wrong_is_said_in_the_words_of_the_scene(tmp_path):
    at = "stage[1].boundary[0].shaking"
    assert {key for key, _ in refused(tmp_path, burst(SLOW), stage={"time": "static", "until": {"steps": 10}})} == {at}
    assert {why for _, why in refused(tmp_path, burst(SLOW), y=1.0)} == {f"{tmp_path / 'base.csv'} has no column 'y'"}
    assert {key for key, _ in refused(tmp_path, burst(SLOW), file="other.csv")} == {f"{at}.file"}
    assert any("give x, y, or both" in why for _, why in refused(tmp_path, burst(SLOW), x=None))
    wrong = burst(SLOW)[::-1]
    assert all(key == f"{at}.file" and "does not follow" in why for key, why in refused(tmp_path, wrong))


def test_a_file_is_named_by_its_place_and_its_contents(tmp_path):
    found = scene(tmp_path, burst(SLOW))
    table = found.stage[1].boundary[0].shaking
    assert table.file == str(tmp_path / "base.csv")
    assert len(table.file_hash) == 64
    assert scene(tmp_path, 2.0 * burst(SLOW)).digest() != found.digest()
