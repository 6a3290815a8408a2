"""Where a run may go on from: only where all processes saved the same moment of the same scene."""

import json
from pathlib import Path

import pytest

from coupler_protocol.exits import EnvironmentFailed
from coupler_protocol.files import checkpoint, restart
from coupler_protocol.files.restart import END, Origin
from coupler_protocol.problems import SceneError
from coupler_protocol.scene.reader import read_scene


@pytest.fixture(scope="module")
def scene(configs):
    return read_scene(configs / "quick_slope.toml")


def save(folder, scene, stage, ranks=(1,), session=5, dem_session=None, phase=END):
    """Checkpoints of a stage, without a State worth the name."""
    for name in ("fdm.rank0", *(f"dem.rank{rank}" for rank in ranks)):
        own = session if name == "fdm.rank0" or dem_session is None else dem_session
        about = restart.attributes(scene, name, stage, phase, 7, own, 1.0, rows=[])
        checkpoint.save(folder / f"{name}.{stage}.h5", {"number": 1.5}, about)


def test_the_text_of_the_command_line():
    assert Origin.parse("runs/a@b/c@couple") == (Path("runs/a@b/c"), "couple")
    for wrong in ("runs/slope", "@couple", "runs/slope@"):
        with pytest.raises(ValueError, match="DIR@STAGE"):
            Origin.parse(wrong)


def test_the_last_end_that_all_have_saved(tmp_path, scene):
    with pytest.raises(EnvironmentFailed, match=r"no stage in .* ended with checkpoints of all processes"):
        restart.last_saved(scene, tmp_path)
    save(tmp_path, scene, "equilibrium", ranks=())
    assert restart.last_saved(scene, tmp_path).stage == "equilibrium"
    save(tmp_path, scene, "fill", ranks=())  # the discs have not saved it
    assert restart.last_saved(scene, tmp_path).stage == "equilibrium"
    save(tmp_path, scene, "fill")
    assert restart.last_saved(scene, tmp_path).stage == "fill"
    save(tmp_path, scene, "couple", dem_session=6)  # of two runs
    assert restart.last_saved(scene, tmp_path).stage == "fill"
    save(tmp_path, scene, "couple", phase="stopped")
    assert restart.last_saved(scene, tmp_path).stage == "fill"
    save(tmp_path, scene, "couple")
    assert restart.last_saved(scene, tmp_path) == Origin(tmp_path, "couple")


def test_checkpoints_of_two_runs_are_refused(tmp_path, scene):
    save(tmp_path, scene, "couple", dem_session=6)
    with pytest.raises(EnvironmentFailed, match="of different runs"):
        restart.check(scene, Origin(tmp_path, "couple"))


def test_title_and_later_stages_may_differ_but_nothing_else(tmp_path, scene):
    save(tmp_path, scene, "couple")
    later = scene.stage[3].model_copy(update={"name": "other"})
    branch = scene.model_copy(update={"title": "another", "stage": [*scene.stage[:3], later, later]})
    restart.check(branch, Origin(tmp_path, "couple"))
    other = scene.model_copy(update={"stage": [*scene.stage[:2], scene.stage[2].model_copy(update={"handover": 400})]})
    with pytest.raises(SceneError, match=r"stage\.2\.handover: 400 on this scene, 500 on"):
        restart.check_scene(other, scene.resolved(), 2, "there")


def test_a_checkpoint_of_another_version_is_refused(tmp_path, scene, monkeypatch):
    save(tmp_path, scene, "couple")
    monkeypatch.setattr(restart, "version", lambda name: "9.9")
    with pytest.raises(EnvironmentFailed, match=r"was written by version \d.*, this is 9.9"):
        restart.load(scene, Origin(tmp_path, "couple"), "fdm.rank0")


def test_a_scene_may_be_read_from_what_a_run_left(tmp_path, scene):
    (tmp_path / "scene.json").write_text(json.dumps(scene.resolved()), encoding="utf-8")
    assert read_scene(tmp_path / "scene.json").digest() == scene.digest()


def test_a_run_that_goes_on_adds_a_part_and_forgets_later_ends(tmp_path, scene):
    for stage in ("equilibrium", "couple", "overload"):
        save(tmp_path, scene, stage)
    assert restart.part_file(scene, tmp_path / "new", "fdm.rank0", Origin(tmp_path, "couple")).name == "fdm.rank0.vtkhdf"
    for number in (1, 2):
        part = restart.part_file(scene, tmp_path, "fdm.rank0", Origin(tmp_path, "couple"))
        assert part.name == f"fdm.rank0.part{number}.vtkhdf"
        part.touch()
    assert sorted(path.name for path in tmp_path.glob("fdm*.h5")) == ["fdm.rank0.couple.h5", "fdm.rank0.equilibrium.h5"]
    assert (tmp_path / "dem.rank1.overload.h5").exists()  # not its own
