"""The benchmark of a step says what it does and prints every row as soon as it is known; turns are fair (no seconds asserted)."""

import itertools
from statistics import NormalDist, median

import bench_step
import numba
import numpy as np
import pytest
from bench import fdm, quick
from bench.announcements import announcements
from bench.timing_rows import bounds, in_turns, ratio_row, row

from coupler_protocol.compiled.jit import jit


def rows_seen_between(monkeypatch, capsys, words):
    """Standard output before each row of a run whose kinds of rows are three of our own, and all of it."""
    seen = []

    def rows(*_, companion, say):
        for number in range(3):
            say(f"preparing {number}")
            seen.append(capsys.readouterr().out)
            yield row(f"row {number}", 10, [1.0 + number], "-", companion)

    for code in (bench_step.fdm, bench_step.dem):
        monkeypatch.setattr(code, "rows", rows)
    for name in ("fdm_rows", "dem_rows"):
        monkeypatch.setattr(bench_step.quick, name, rows)
    monkeypatch.setattr(bench_step, "triad", lambda *_: [10.0])
    assert bench_step.main(words) == 0
    return [*seen, capsys.readouterr().out]


@pytest.mark.parametrize("words", [["--fdm"], ["--quick", "--dem"]])
def test_a_row_is_printed_before_the_next_is_prepared(monkeypatch, capsys, words):
    seen = rows_seen_between(monkeypatch, capsys, words)
    assert "triad 10.0 GB/s" in seen[0]
    assert [[f"row {i}" in text for i in range(3)] for text in seen[1:]] == np.eye(3, dtype=bool).tolist()


def test_both_codes_are_measured_unless_one_is_named(monkeypatch, capsys):
    printed = "".join(rows_seen_between(monkeypatch, capsys, ["--fast"]))
    assert printed.count("row 2") == 2


def test_the_quick_measurement_says_what_it_leaves_out(monkeypatch, capsys):
    assert quick.LEFT_OUT in rows_seen_between(monkeypatch, capsys, ["--quick"])[0]
    assert "left out" not in rows_seen_between(monkeypatch, capsys, ["--fast"])[0]


def test_the_first_rows_need_the_smallest_box_only(monkeypatch):
    """Only the box of the first two rows is built before they are known, and everything is announced before it is done."""
    built, said = [], []

    class Box(fdm.laws.Box):
        def __init__(self, *arguments):
            built.append(len(said))
            super().__init__(*arguments)

    monkeypatch.setattr(fdm.laws, "Box", Box)
    rows = fdm.rows(True, 2, {"triad_GB_per_s": 1.0}, said.append)
    first = list(itertools.islice(rows, 2))
    assert built == [1]
    assert said == ["preparing 1,600 zones, Mohr-Coulomb, tension, flags; at rest", "measuring"]
    assert [r["name"].partition(";")[0] for r in first] == ["Mohr-Coulomb, tension, flags", "scalar loop"]


def test_turns_go_forwards_and_backwards():
    order = []
    found = in_turns([lambda name=name: order.append(name) or len(order) for name in "abc"], 3)
    assert "".join(order) == "abccbaabc"
    assert found == [[1, 6, 7], [2, 5, 8], [3, 4, 9]]


def test_a_slow_drift_of_the_machine_changes_no_ratio():
    """Two cases of equal cost on a machine that becomes slower by the same factor each time."""
    speed = iter(1.01**i for i in range(1000))
    first, second = in_turns([lambda: next(speed)] * 2, 40)
    assert median(b / a for a, b in zip(first, second, strict=True)) == pytest.approx(1.0, abs=1e-4)


@pytest.mark.parametrize("turns", [6, 15, 40])
def test_bounds_contain_the_median_in_95_of_100_measurements(turns):
    """Of a distribution as skew as seconds beside other work."""
    rng = np.random.default_rng(turns)
    true, trials = 1.0, 2000
    inside = sum(low <= true <= high for low, high in (bounds(np.exp(rng.standard_normal(turns))) for _ in range(trials)))
    assert inside / trials > 0.95 - NormalDist().inv_cdf(0.999) * (0.95 * 0.05 / trials) ** 0.5
    assert inside / trials < 0.99


def test_a_ratio_says_how_well_it_is_known():
    found = ratio_row("a over b", 10, [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0], {}, "no builds")
    assert (found["value"], found["low"], found["high"]) == (4.5, 1.0, 8.0)
    assert found["note"] == "95 % bounds of the median 1.000 .. 8.000, 8 turns; no builds"
    assert bounds([3.0, 1.0]) == (1.0, 3.0)


def test_compilations_are_announced_once(capsys):
    if numba.config.DISABLE_JIT:
        pytest.skip("nothing is compiled")
    inner = jit(_inner, package="fdm_server", cache=False)
    namespace = {"inner": inner}
    exec(compile("def outer(x):\n    return inner(x) + 1.0", fdm.__file__, "exec"), namespace)
    outer = jit(namespace["outer"], package="fdm_server", cache=False)
    with announcements() as say:
        say("preparing")
        assert outer(1.0) == outer(1.0) == 3.0
    lines = [line.partition(" s  ")[2] for line in capsys.readouterr().err.splitlines()]
    assert lines == ["preparing", "compiling outer"]


def _inner(x):
    return 2.0 * x


@pytest.mark.trial
@pytest.mark.long
def test_quick_rows_of_both_codes(capsys):
    said = []
    found = [*quick.fdm_rows({}, said.append, 0.0), *quick.dem_rows({}, said.append, 0.0, 0.06)]
    rows = {r["name"]: r for r in found}
    assert len(rows) == len(found) == 5 + 4 + 5 + 4
    assert {r["repeats"] for r in found} == {quick.LEAST}
    assert all(r["low"] <= r["value"] <= r["high"] for r in found if r["unit"] == "-")
    law = "Mohr-Coulomb, tension, flags"
    ratio = rows[f"over the scalar loop; {law}; flowing"]["value"]
    apart = rows[f"{law}; flowing"]["value"] / rows[f"scalar loop; {law}; flowing"]["value"]
    assert ratio == pytest.approx(apart, rel=0.5)  # ours over theirs, not theirs over ours
    assert [text for text in said if text.startswith("preparing")][-1] == "preparing the paper window, bonded, stones as clumps"
