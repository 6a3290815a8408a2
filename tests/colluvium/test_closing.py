"""What the closing sentences say about a window, from run.json."""

import pytest

from colluvium.closing import sentences

WINDOW = {"name": "band", "discs": 100, "control_discs": 20, "porosity": 0.16, "error_yy": 0.031}
STONES = {"stones": 9, "stone_content": 0.45, "stone_content_discs": 0.47}


@pytest.mark.parametrize(
    ("more", "words", "not_words"),
    [
        ({}, ["100 discs", "20 on the ring", "within 3.1 %"], ["stones", "brought back", "left over"]),
        (STONES, ["9 stones: 45.0 % of the area, 47.0 % of the discs"], ["too small"]),
        (STONES | {"stones_without_discs": 2}, ["2 of them too small"], []),
        ({"projected": 0.6, "imbalance_x": 0.0, "imbalance_y": 0.01}, ["at 60 % of its places was beyond"], ["left over"]),
        ({"imbalance_x": 0.01, "imbalance_y": 0.45}, ["+1 % of the weight is left over along x, +45 %"], ["brought back"]),
    ],
)
def test_windows_in_words(more, words, not_words):
    said = next(sentences({"windows": [WINDOW | more]}))
    assert all(w in said for w in words), said
    assert not any(w in said for w in not_words), said


def test_discs_alone_have_no_ring():
    assert "ring" not in next(sentences({"windows": [{"name": "dem.rank1", "discs": 7} | STONES]}))
