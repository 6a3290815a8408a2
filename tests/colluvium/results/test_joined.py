"""The folders of two machines are joined if they are the two sides of one run, as far as both came."""

import shutil

import h5py
import pytest

from colluvium import open_run
from coupler_protocol.exits import EnvironmentFailed
from tests.commands import run_colluvium

SIDES = ("fdm.rank0.vtkhdf", "dem.rank1.vtkhdf")


@pytest.fixture
def two(run_folder, tmp_path):
    """Folders of the grid and of the discs of one run, with its number."""
    folders = tmp_path / "a", tmp_path / "b"
    for folder, name in zip(folders, SIDES, strict=True):
        folder.mkdir()
        shutil.copy(run_folder / name, folder)
        mark(folder / name, run="3f2a9c1e77b0")
    return folders


def mark(path, **attributes):
    with h5py.File(path, "r+") as file:
        file.attrs.update(attributes)


def test_both_orders_give_the_same_run(two):
    for folders in (two, two[::-1]):
        with open_run(*folders) as run:
            assert list(run.files) == [0, 1]
            assert [info.step for info in run.frames] == [0, 1000, 2000, 3000, 4000, 5000]
            assert run.cut == ""


def test_folders_of_different_runs_are_refused_with_both_numbers(two):
    mark(two[1] / SIDES[1], run="4b0000000000")
    with pytest.raises(EnvironmentFailed, match=r"are of different runs \(3f2a9c1e77b0 and 4b0000000000\)"):
        open_run(*two)


def test_folders_of_different_scenes_are_refused_also_without_numbers(two):
    for folder, name, scene in zip(two, SIDES, ("one", "another"), strict=True):
        mark(folder / name, run="", scene_identity=scene)
    with pytest.raises(EnvironmentFailed, match=r"are of different scenes \(without a number and without a number\)"):
        open_run(*two)


def test_a_missing_side_is_named(two, tmp_path):
    (tmp_path / "c").mkdir()
    for other, words in (("none", "none has no file NAME.rankN"), ("c", "c has no file NAME.rankN.vtkhdf: copy the --out")):
        with pytest.raises(EnvironmentFailed, match=words):
            open_run(two[0], tmp_path / other)
    with pytest.raises(EnvironmentFailed, match="are one folder"):
        open_run(two[0], two[0])
    shutil.copy(two[0] / SIDES[0], tmp_path / "c")
    with pytest.raises(EnvironmentFailed, match=r"c has no rank that .*a lacks \(rank 0\)"):
        open_run(two[0], tmp_path / "c")


def test_of_a_side_that_was_cut_the_common_part_is_shown(two):
    with h5py.File(two[1] / SIDES[1], "r+") as file:  # as of a copy that was made before
        steps = file["VTKHDF/Steps"]
        steps.attrs["NSteps"] = 2
    with open_run(*two) as run:
        assert [info.step for info in run.frames] == [0, 1000, 2000, 3000]
        assert run.cut == (
            "rank 0 ends at step 5,000, rank 1 ends at step 3,000: the files of rank 1 are older, or that side was cut short"
        )
        assert run.cut in repr(run)
    done = run_colluvium("report", *two)
    assert done.returncode == 0, done.stderr
    assert f"not drawn, {run.cut}: frames after step 3,000" in done.stderr
    with open_run(two[0]) as alone:
        assert alone.frames[-1].step == 5000


def test_the_command_refuses_in_words(two):
    mark(two[1] / SIDES[1], run="4b0000000000")
    for words in ((two[0], two[1]), (two[0], two[0] / "none")):
        done = run_colluvium("report", *words)
        assert done.returncode == 4
        assert "Traceback" not in done.stderr
        assert "are of different runs" in done.stderr or "has no file NAME.rankN.vtkhdf" in done.stderr
