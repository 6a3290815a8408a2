"""The in-situ study's table and file; its cases are computed in tests/dem_server/insitu/test_insitu_fields.py."""

import json

import insitu_study


def test_table_and_file(tmp_path, capsys, monkeypatch):
    keys = ("lines", "side", "segment", "ratio", "ratio_later", "projected", "beyond_friction")
    row = dict.fromkeys(keys, 0.031) | {"broken": 7, "coordination": 4.0}
    row |= {"before": [0.01, 0.02, 0.03], "after": [0.04, 0.05, 0.06]}
    monkeypatch.setattr(insitu_study, "case", lambda scene, field, stony, seed: row)
    assert insitu_study.main(["--fast", "--json", str(tmp_path / "rows.json")]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 1 + 2 * len(insitu_study.FIELDS)
    assert lines[2].split()[:10] == ["K0", ".571", "stones", "0", "1.0", "2.0", "3.0", "4.0", "5.0", "6.0"]
    rows = json.loads((tmp_path / "rows.json").read_text(encoding="utf-8"))
    assert [r["field"] for r in rows[::2]] == list(insitu_study.FIELDS)


def test_table_of_slopes(capsys, monkeypatch):
    """The window of a slope with and without bonds: the study takes the bonds off, and nothing else."""
    asked = []

    def row_of(scene, nodes, target):
        asked.append(scene.discs.soil)
        keys = ("zones_xx", "zones_yy", "zones_xy", "sine_zones", "sine_estimate", "sine_discs", "slips", "ratio")
        return dict.fromkeys(keys, 0.031) | {"rounds": 17, "further_rounds": 5, "broken": 7}

    monkeypatch.setattr(insitu_study, "zones_at_rest", lambda scene: (None, None))
    monkeypatch.setattr(insitu_study, "slope_case", row_of)
    assert insitu_study.main(["--fast", "--slopes"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[:2] for line in lines[1:]] == [["quick_slope", "yes"], ["quick_slope", "no"]]
    assert lines[1].split()[2:] == ["3.1", "3.1", "3.1", "0.031", "0.031", "0.031", "17", "(5)", "7", "3.1", "%", "3.1e-02"]
    bonded, loose = asked
    assert bonded.bond is not None
    assert loose == bonded.model_copy(update={"bond": None})
