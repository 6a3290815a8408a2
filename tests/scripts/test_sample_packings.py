"""scripts/studies/sample_packings.py: growths of small samples, and seeds that miss their stress."""

import pytest

from dem_server.packing import growth

sample_packings = pytest.importorskip("sample_packings")

WORDS = ("--seeds", "1", "2", "--set", "lab.width=16", "--sample", "soil")


def test_growths_of_each_seed(configs, capsys):
    assert sample_packings.main([str(configs / "quick_lab.toml"), *WORDS]) == 0
    said = capsys.readouterr().out
    assert "soil: 0 of 2 packings miss their stress" in said
    low, high = (int(word.strip(",")) for word in said.split("growths: ")[1].split()[:3:2])
    assert 1 < low <= high <= growth.GROWTHS


def test_seeds_that_miss_their_stress_are_named(configs, capsys, monkeypatch):
    monkeypatch.setattr(growth, "GROWTHS", 3)
    assert sample_packings.main([str(configs / "quick_lab.toml"), *WORDS]) == 1
    said = capsys.readouterr()
    assert "soil: 2 of 2 packings miss their stress: seeds [1, 2]" in said.out
    assert "after 3 growths" in said.err
