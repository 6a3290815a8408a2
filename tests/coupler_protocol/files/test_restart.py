"""Where a run may go on from: only where all processes saved the same moment of the same scene."""

import json
from pathlib import Path

import h5py
import pytest

from coupler_protocol.exits import EnvironmentFailed
from coupler_protocol.files import checkpoint, restart, run_json, saved_moments
from coupler_protocol.files.restart import END, INSIDE, Origin
from coupler_protocol.problems import SceneError
from coupler_protocol.scene.reader import read_scene


@pytest.fixture(scope="module")
def scene(configs):
    return read_scene(configs / "quick_slope.toml")


def save(folder, scene, stage, ranks=(1,), session=5, dem_session=None, phase=END, step=0):
    """Checkpoints of the end of a stage, or of a step inside of it, without a State worth the name."""
    phase = INSIDE if step else phase
    for name in ("fdm.rank0", *(f"dem.rank{rank}" for rank in ranks)):
        own = session if name == "fdm.rank0" or dem_session is None else dem_session
        about = restart.attributes(scene, name, stage, phase, step or 7, own, 1.0, 9, rows=[])
        checkpoint.save(saved_moments.path_of(folder, name, stage, step), {"number": 1.5}, about)


def test_the_text_of_the_command_line():
    assert Origin.parse("runs/a@b/c@couple") == (Path("runs/a@b/c"), "couple")
    for wrong in ("runs/slope", "@couple", "runs/slope@"):
        with pytest.raises(ValueError, match="DIR@STAGE"):
            Origin.parse(wrong)


def place(folder, scene):
    """File and words of the moment from which a run in a folder continues."""
    path, where = saved_moments.common_in_folder(scene, folder)
    return path and path.name, where


def test_the_newest_moment_that_all_have_saved(tmp_path, scene):
    assert place(tmp_path, scene) == (None, "from the start: no checkpoint of all sides is there")
    save(tmp_path, scene, "equilibrium", ranks=())
    assert place(tmp_path, scene) == ("fdm.rank0.equilibrium.h5", "after the end of stage 'equilibrium'")
    save(tmp_path, scene, "fill", ranks=())  # the discs have not saved it
    assert place(tmp_path, scene)[0] == "fdm.rank0.equilibrium.h5"
    save(tmp_path, scene, "fill")
    assert place(tmp_path, scene)[0] == "fdm.rank0.fill.h5"
    save(tmp_path, scene, "couple", dem_session=6)  # of two runs
    assert place(tmp_path, scene)[0] == "fdm.rank0.fill.h5"
    save(tmp_path, scene, "couple", step=900)
    save(tmp_path, scene, "couple", step=1200, ranks=())
    assert place(tmp_path, scene) == ("fdm.rank0.couple@900.h5", "in step 900 of stage 'couple'")
    save(tmp_path, scene, "couple", phase="stopped")
    assert place(tmp_path, scene)[0] == "fdm.rank0.couple@900.h5"
    save(tmp_path, scene, "couple")
    assert place(tmp_path, scene)[0] == "fdm.rank0.couple.h5"
    save(tmp_path, scene, "overload", step=1500)
    assert place(tmp_path, scene)[0] == "fdm.rank0.overload@1500.h5"
    assert not saved_moments.finished(scene, tmp_path, "fdm.rank0", True)


def test_a_run_is_finished_when_its_last_stage_is_saved_and_its_account_is_written(tmp_path, scene):
    save(tmp_path, scene, "overload")
    for name, conducts in (("fdm.rank0", True), ("dem.rank1", False)):
        assert saved_moments.finished(scene, tmp_path, name, conducts) == ""
    for code, done in ((5, False), (0, True), (8, True)):
        run_json.write_json(tmp_path / "run.json", {"exit_code": code, "reason": "because", "stages": []})
        for name, conducts in (("fdm.rank0", True), ("dem.rank1", False)):
            assert bool(saved_moments.finished(scene, tmp_path, name, conducts)) == done
    (tmp_path / "run.json").unlink()
    run_json.write_json(tmp_path / "dem.rank1.json", {"reason": "all stages done"})
    assert saved_moments.finished(scene, tmp_path, "fdm.rank0", True) == ""
    said = saved_moments.finished(scene, tmp_path, "dem.rank1", False)
    assert said.endswith("is finished (all stages done): nothing remains to be computed; --force computes it again")


def test_results_of_another_scene_are_refused_with_the_keys_that_differ(tmp_path, scene):
    save(tmp_path, scene, "couple", step=900)
    free = scene.model_copy(update={"title": "other", "record": scene.record.model_copy(update={"every": 7})})
    saved_moments.refuse_other_scene(free, tmp_path, "fdm.rank0")
    other = scene.stage[3].model_copy(update={"step_factor": 0.3})
    changed = scene.model_copy(update={"seed": 9, "stage": [*scene.stage[:3], other]})
    with pytest.raises(SceneError) as found:
        saved_moments.refuse_other_scene(changed, tmp_path, "fdm.rank0")
    assert "seed: 9 on this scene, 1 on" in str(found.value)
    assert "stage.3.step_factor: 0.3 on this scene, None on" in str(found.value)
    assert "choose another --out or use --force" in str(found.value)


def test_frames_of_another_scene_are_refused_too(tmp_path, scene):
    """A run that ended before its first checkpoint has nothing but its file of frames."""
    with h5py.File(tmp_path / "dem.rank1.vtkhdf", "w") as file:
        file.attrs.update(restart.kept(scene, None, tmp_path / "dem.rank1.vtkhdf", 9))
    saved_moments.refuse_other_scene(scene, tmp_path, "dem.rank1")
    with pytest.raises(EnvironmentFailed, match="of another scene or version"):
        saved_moments.refuse_other_scene(scene.model_copy(update={"seed": 9}), tmp_path, "dem.rank1")


def test_a_file_of_frames_that_cannot_be_read_is_not_taken_for_one_of_another_scene(tmp_path, scene):
    (tmp_path / "dem.rank1.vtkhdf").touch()
    with pytest.raises(EnvironmentFailed, match=r"dem.rank1.vtkhdf cannot be read: .*Move it away to continue"):
        saved_moments.refuse_other_scene(scene, tmp_path, "dem.rank1")


def test_only_the_last_two_checkpoints_inside_of_stages_stay(tmp_path, scene):
    written = []
    for stage, step in (("couple", 100), ("couple", 200), ("overload", 300), ("overload", 400)):
        save(tmp_path, scene, stage, step=step)
        written.append(saved_moments.path_of(tmp_path, "dem.rank1", stage, step))
        saved_moments.prune(tmp_path, "dem.rank1", written)
    save(tmp_path, scene, "couple")
    left = sorted(path.name for path in tmp_path.glob("dem*.h5"))
    assert left == ["dem.rank1.couple.h5", "dem.rank1.overload@300.h5", "dem.rank1.overload@400.h5"]
    assert len(list(tmp_path.glob("fdm*@*.h5"))) == 4  # not its own


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


def test_a_run_that_continues_adds_a_part_and_says_what_counts(tmp_path, scene):
    for stage, step in (("equilibrium", 0), ("couple", 0), ("overload", 800)):
        save(tmp_path, scene, stage, step=step)
    first = restart.part_file(tmp_path, "fdm.rank0")
    assert first.name == "fdm.rank0.vtkhdf"
    assert "kept_stages" not in restart.kept(scene, None, first, 9)
    first.touch()
    (tmp_path / "fdm.rank01.part7.vtkhdf").touch()
    for number in (1, 2):
        part = restart.part_file(tmp_path, "fdm.rank0")
        assert part.name == f"fdm.rank0.part{number}.vtkhdf"
        part.touch()
    end = restart.read(scene, tmp_path / "fdm.rank0.couple.h5", "fdm.rank0", 2)
    inside = restart.read(scene, tmp_path / "fdm.rank0.overload@800.h5", "fdm.rank0", 3)
    assert restart.kept(scene, None, part, 9)["kept_stages"] == []
    assert restart.kept(scene, end, part, 9)["kept_stages"] == ["equilibrium", "fill", "couple"]
    assert restart.kept(scene, inside, part, 9)["kept_step"] == 800
    assert restart.begins_after(inside) == {"begins_after": {"run": str(tmp_path), "stage": "overload", "step": 800}}
    assert len(list(tmp_path.glob("fdm*.h5"))) == 3  # none is removed
