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
