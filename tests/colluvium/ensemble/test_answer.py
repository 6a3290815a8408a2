"""What a sweep says of samples whose means, intervals and shares are known."""

import numpy as np
import pytest

from colluvium.ensemble import answer, page, pictures, study
from colluvium.ensemble.plan import Point


def found(tmp_path, values, failed=""):
    """Results of {content: [values of seeds 1, 2, ..]}; None: not failed up to 3 g."""
    rows = []
    for content, numbers in values.items():
        for seed, number in enumerate(numbers, 1):
            told = {"values": {} if number is None else {"f": [number, 0.0]}, "lacking": {}, "failed": "", "steps": 1}
            told["lacking"] = {"f": "not failed up to 3 g"} if number is None else {}
            folder = tmp_path / "points" / f"{content}-{seed}"
            rows.append(study.Found(Point({"stones.content": content}, seed), folder, told))
    return rows


def test_the_interval_holds_the_mean_of_its_distribution_in_95_of_100_samples():
    """Coverage over 100 samples of 12 normal numbers; a binomial with p = 0.93 (BCa at n = 12) deviates by 2.6 %."""
    random, inside = np.random.default_rng(5), 0
    for _ in range(100):
        low, high = answer.interval_of_mean(random.normal(3.0, 0.5, 12))
        inside += low <= 3.0 <= high
    assert 0.84 < inside / 100 <= 1.0


def test_few_seeds_have_the_interval_of_student():
    """t(0.975, 2) = 4.302653."""
    low, high = answer.interval_of_mean([1.0, 2.0, 3.0])
    assert (low, high) == pytest.approx((2.0 - 4.302653 / 3**0.5, 2.0 + 4.302653 / 3**0.5), rel=1e-6)
    assert answer.interval_of_mean([1.0]) is None
    assert answer.interval_of_mean([2.0, 2.0, 2.0, 2.0]) == (2.0, 2.0)


def test_the_share_has_the_interval_of_wilson():
    """3 of 10: 0.1078 to 0.6032 (Wilson 1927, eq. of the score interval)."""
    share, low, high = answer.share_below([1, 1, 1, *[2] * 7], 1.5)
    z, p, n = 1.959964, 0.3, 10
    middle, half = (p + z * z / 2 / n) / (1 + z * z / n), z / (1 + z * z / n) * (p * (1 - p) / n + z * z / 4 / n / n) ** 0.5
    assert (share, low, high) == pytest.approx((0.3, middle - half, middle + half), abs=1e-6)


def test_what_the_intervals_allow_to_be_said(tmp_path):
    values = {0.0: [2.0, 2.1, 1.9, 2.0], 0.3: [3.0, 3.1, 2.9, 3.0, None]}
    settings = answer.settings_of(found(tmp_path, values), "f", below=1.95)
    assert [len(one.found) for one in settings] == [4, 4]
    assert settings[1].missing == ["stones.content = 0.3, seed 5: not failed up to 3 g"]
    said = answer.sentences(settings, "f", below=1.95)
    assert said[0].startswith("f goes from 2 (95 %: ")
    assert said[0].endswith("the intervals are apart.")
    assert said[1].endswith("12 more seeds would halve it.")
    assert said[2].startswith("f is below 1.95 in 25 % of the seeds at stones.content = 0 ")
    overlap = answer.settings_of(found(tmp_path, {0.0: [2.0, 2.2], 0.3: [2.1, 2.3]}), "f")
    assert "may be chance" in answer.sentences(overlap, "f")[0]
    single = answer.settings_of(found(tmp_path, {0.0: [2.0], 0.3: [2.1]}), "f")
    assert "one seed each says nothing of chance" in answer.sentences(single, "f")[0]
    assert answer.sentences(answer.settings_of(found(tmp_path, {0.0: [None]}), "f"), "f") == ["No point has f."]


def test_the_mean_settles_with_the_number_of_seeds():
    rows = answer.by_number_of_seeds([1.0, 2.0, 3.0, 2.0, 2.0])
    assert [row[0] for row in rows] == [2, 3, 4, 5]
    assert rows[1][1] == 2.0
    assert all(low <= mean <= high for _, mean, low, high in rows)


def test_the_table_has_a_row_for_each_point(tmp_path):
    rows = found(tmp_path, {0.0: [2.0, None]})
    study.write_table(rows, ("f",), tmp_path / "points.csv")
    lines = (tmp_path / "points.csv").read_text().splitlines()
    assert lines[0] == "stones.content,seed,f,f_half_width,steps,seconds,tries,folder,why_not"
    assert lines[1] == "0.0,1,2.0,0.0,1,,,points/0.0-1,"
    assert lines[2] == "0.0,2,,,1,,,points/0.0-2,f: not failed up to 3 g"


def test_pictures_and_page_show_what_there_is(tmp_path):
    rows = found(tmp_path, {0.0: [2.0, 2.1, 1.9], 0.3: [3.0, 3.1, 2.9]})
    settings = answer.settings_of(rows, "f")
    figure = pictures.curve(settings, "f")
    (axes,) = figure.axes
    means = next(line for line in axes.lines if line.get_marker() == "o")
    assert means.get_xydata().ravel().tolist() == pytest.approx([0.0, 2.0, 0.3, 3.0])
    drawn = pictures.write(rows, settings, "f", tmp_path)
    assert [path.name for path in drawn] == ["curve.png", "distribution.png", "seeds.png"]  # no run was recorded: no bands
    (rows[0].folder / "report").mkdir(parents=True)
    (rows[0].folder / "report" / "report.html").touch()
    text = page.write("A sweep", ["said <b>"], settings, rows, "f", drawn, tmp_path / "report.html").read_text()
    assert text.count("data:image/png") == 3
    assert 'href="points/0.0-1/report/report.html"' in text
    assert 'href="points/0.3-1/"' in text
    assert "said &lt;b&gt;" in text
