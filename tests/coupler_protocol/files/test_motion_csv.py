"""Files of motions: every line that is not one moment is named, all at once."""

import numpy as np
import pytest

from coupler_protocol.files import motion_csv
from coupler_protocol.problems import SceneError


def read(tmp_path, text):
    path = tmp_path / "motion.csv"
    path.write_text(text, encoding="utf-8")
    return motion_csv.read(path, "shaking.file")


def test_a_motion_is_read_and_its_drift_is_its_integral(tmp_path):
    found = read(tmp_path, "time,y\n0,0\n0.5,1\n2.0,0\n")
    np.testing.assert_array_equal(found.time, [0.0, 0.5, 2.0])
    assert list(found.velocity) == ["y"]
    assert found.drift("y") == pytest.approx(1.0)
    assert found.step == 1.0


def test_all_wrong_lines_are_said_at_once(tmp_path):
    with pytest.raises(SceneError) as caught:
        read(tmp_path, "time,x\n-1,0\n0,0\n0,1\n1,nan\n2,1,5\n3,0\n")
    assert [problem.line for problem in caught.value.problems] == [2, 4, 5, 6]
    words = ["is negative", "time 0 s does not follow 0 s", "x 'nan' is not a number", "3 columns instead of 2"]
    for problem, expected in zip(caught.value.problems, words, strict=True):
        assert expected in problem.reason


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("t,x\n0,0\n1,0\n", "column 'time' is missing"),
        ("time,vx\n0,0\n1,0\n", "column 'vx' is not known"),
        ("time,x,x\n0,0,0\n1,0,0\n", "column 'x' is there twice"),
        ("time;x\n0;0\n", "semicolons"),
        ("time\n0\n1\n", "no column of velocities"),
        ("time,x\n0,0\n", "has 1 moments"),
        ("", "column 'time' is missing"),
    ],
)
def test_files_that_are_not_motions(tmp_path, text, words):
    with pytest.raises(SceneError, match=words):
        read(tmp_path, text)


def test_a_file_that_is_not_there(tmp_path):
    with pytest.raises(SceneError, match="there is no file"):
        motion_csv.read(tmp_path / "none.csv", "shaking.file")
