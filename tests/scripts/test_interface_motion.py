"""scripts/studies/interface_motion.py: a row for every stage of a run with discs."""

import json

import pytest

import colluvium
from tests.window_scenes import BOX, L_SHAPE, uniform

interface_motion = pytest.importorskip("interface_motion")


def test_a_window_at_rest_hardly_moves_from_its_rim_and_says_how_well_forces_fit(tmp_path, capsys):
    scene = colluvium.Scene(**uniform(BOX, L_SHAPE))
    colluvium.run(scene, tmp_path / "run").close()
    interface_motion.main([str(tmp_path / "run"), "--json", str(tmp_path / "rows.json")])
    filled, coupled = json.loads((tmp_path / "rows.json").read_text())
    assert (filled["stage"], coupled["stage"]) == ("fill", "couple")
    assert filled["opening_max"] == filled["slip_max"] == filled["parted"] == 0.0  # what motion is counted from
    assert filled["pairs"] == coupled["pairs"] > 100
    assert 0.0 < coupled["opening_rms"] < coupled["opening_max"] < 0.01
    assert 0.0 < coupled["slip_rms"] < coupled["slip_max"] < 0.01
    assert 0.0 < coupled["traction"] < 0.1
    assert "| hole | couple |" in capsys.readouterr().out
