"""What `colluvium check` says about the continuum's grid and sides."""

import tomllib

from colluvium.forecast import check
from colluvium.running import processes
from coupler_protocol.scene.reader import build_scene, read_scene


def test_counts_and_sides_of_a_scene_without_windows(configs):
    found = check.describe(read_scene(configs / "hole.toml"))
    assert (found["columns"], found["zones"], found["gridpoints"]) == (24, 24 * found["rows"], 25 * (found["rows"] + 1))
    before, opened = found["stages"]
    assert before["sides"] == ["fix on left", "fix on bottom", "stress on outer", "stress on inner"]
    assert opened["sides"] == ["stress on inner"]
    assert before["gravity"] == 0.0


def test_scenes_with_boundaries_survive_as_toml(configs):
    for name in ("hole", "footing", "layered_slope", "quick_biaxial"):
        scene = read_scene(configs / f"{name}.toml")
        text = processes.as_toml(scene.model_dump(mode="json", exclude_none=True))
        assert build_scene(tomllib.loads(text)) == scene
