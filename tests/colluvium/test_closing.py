"""What the closing sentences say about a window, from run.json."""

import pytest

from colluvium.closing import OUTCOME, SECONDS, filled, rows, sentences, times

WINDOW = {"name": "band", "discs": 100, "control_discs": 20, "porosity": 0.16, "error_yy": 0.031}
STONES = {"stones": 9, "stone_content": 0.45, "stone_content_discs": 0.47}


def test_a_stretched_rim_is_a_warning_of_its_stage():
    stretched = {"zone": 54, "stretch": 4.99, "place": [3.25, 4.25]}
    info = {"stages": [{"name": "couple"}, {"name": "drive", "rim_stretched": stretched}]}
    (said,) = [text for text in sentences(info) if "stretched" in text]
    assert said.startswith("warning: in stage drive zone 54 on a rim was stretched to 5.0 times its size at (3.2, 4.2) m")


@pytest.mark.parametrize(
    ("more", "words", "not_words"),
    [
        ({}, ["100 discs", "20 on the ring", "within 3.1 %", "porosity 0.160,"], ["stones", "exceeded", "remains"]),
        (STONES, ["9 stones: 45.0 % of the area, 47.0 % of the discs"], ["no disc centre"]),
        (STONES | {"stone_gaps": 0.045}, ["porosity 0.160 (0.115 with solid stones)"], []),
        (STONES | {"stones_without_discs": 2}, ["2 of them contain no disc centre"], []),
        (
            {"projected": 0.6, "imbalance_x": 0.0, "imbalance_y": 0.01, "further_rounds": 0},
            ["at 60 % of its points the stress of the zones exceeded the estimated strength"],
            ["remains", "further rounds"],
        ),
        ({"projected": 0.6, "further_rounds": 5}, ["5 further rounds brought the discs nearer to it"], []),
        ({"imbalance_x": 0.01, "imbalance_y": 0.45}, ["+1 % of the weight remains along x, +45 %"], ["exceeded"]),
    ],
)
def test_windows_in_words(more, words, not_words):
    said = next(sentences({"windows": [WINDOW | more]}))
    assert all(w in said for w in words), said
    assert not any(w in said for w in not_words), said


ZONES = {"zones_xx": 0.05, "zones_yy": 0.031, "zones_xy": 0.12, "sine_zones": 0.46, "sine_discs": 0.37}


def test_the_error_of_a_window_is_that_against_the_zones():
    window, warning, *_ = sentences({"windows": [WINDOW | ZONES]})
    assert "stress within 5.0 % (xx), 3.1 % (yy), 12.0 % (xy) of that of the zones" in window
    assert "mobilised sine 0.37 (0.46 in the zones)" in window
    assert warning.startswith("warning: the discs of window band took over 80 % of the shear stress of the zones")


def test_a_window_with_the_shear_stress_of_the_zones_is_not_warned_of():
    said = sentences({"windows": [WINDOW | ZONES | {"sine_discs": 0.42}]})
    assert not [text for text in said if text.startswith("warning")]


def test_a_long_compilation_is_mentioned():
    def said(grid, discs):
        info = {"compiled": {"seconds": grid}, "windows": [WINDOW | {"compiled": {"seconds": discs}}]}
        return [text for text in sentences(info) if "compiled" in text]

    assert said(14.2, 17.1) == ["kernels were compiled for 31 s, on both sides together; later runs find them in the cache"]
    assert said(0.1, 0.2) == []


def test_discs_alone_have_no_ring():
    assert "ring" not in next(sentences({"windows": [{"name": "dem.rank1", "discs": 7} | STONES]}))


STAGE = {"name": "rest", "steps": 5, "ended_by": "ratio 1e-6", "gravity_factor": 1.0}
STAGE |= {"ratio_discrete": [1e-6], "bonds_broken": [2]}
TIMES = {"continuum": 0.1, "waiting": 0.2, "recording": 0.3, "discrete": 0.4, "waiting_discrete": 0.5, "recording_discrete": 0.6}


def test_tables_have_no_columns_of_a_side_that_is_not_there():
    alone = {"stages": [STAGE | {"seconds": TIMES}], "windows": [WINDOW]}
    assert filled(OUTCOME, rows(alone))[0] == ["stage", "steps", "ended by", "gravity", "ratio\ndiscs", "bonds\nbroken"]
    assert filled(SECONDS, times(alone)) == (["stage", "discs\ncompute", "both\nrecord"], [["rest", "0.40", "0.90"]])
    both = {"stages": [STAGE | {"seconds": TIMES, "ratio_continuum": 1e-6}], "windows": [WINDOW]}
    assert filled(SECONDS, times(both))[1] == [["rest", "0.10", "0.20", "0.40", "0.50", "0.90"]]
