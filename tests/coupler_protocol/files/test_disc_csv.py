"""Files of discs: every line that is not one disc is named, also numbers that Python would take."""

import pytest

from coupler_protocol.files import disc_csv
from coupler_protocol.problems import SceneError

HEAD = "x,y,radius,stone\n"


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("0,5,0,5,0,1,-1", "7 columns instead of 4: are decimals written with commas"),
        ('"0,5",0.5,0.1,-1', "x '0,5' is not a number: decimals have a point"),
        ("1_0,0.5,0.1,-1", "x '1_0' is not a number"),
        ("nan,0.5,0.1,-1", "x 'nan' is not a number"),
        ("0.5,inf,0.1,-1", "y 'inf' is not a number"),
        ("0.5,1e300,0.1,-1", "y '1e300' is not a number"),
        ("0.5,,0.1,-1", "y '' is not a number"),
        ("0.5,0.5,True,-1", "radius 'True' is not a number"),
        ("0.5,0.5,0.0,-1", "the radius is not positive"),
        ("0.5,0.5,0.1,1.5", "stone '1.5' is not an integer"),
        ("0.5,0.5,0.1,99999999999999999999", "is larger than 2147483647"),
    ],
)
def test_lines_that_are_no_discs(tmp_path, line, words):
    path = tmp_path / "discs.csv"
    path.write_text(HEAD + line + "\n", encoding="utf-8")
    with pytest.raises(SceneError, match=words) as found:
        disc_csv.read(path)
    assert [problem.line for problem in found.value.problems] == [2]
