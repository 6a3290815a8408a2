"""What `colluvium check` says about the continuum's grid and sides."""

from colluvium import check
from coupler_protocol.scene_reader import read_scene


def test_counts_and_sides_of_a_scene_without_windows(configs):
    found = check.answer(read_scene(configs / "hole.toml"))
    assert (found["columns"], found["zones"], found["gridpoints"]) == (24, 24 * found["rows"], 25 * (found["rows"] + 1))
    before, opened = found["stages"]
    assert before["sides"] == ["fix on left", "fix on bottom", "stress on outer", "stress on inner"]
    assert opened["sides"] == ["stress on inner"]
    assert before["gravity"] == 0.0
