"""Tests of samples are computed once: kept ones are read, others run; short ones are short."""

import json

import pytest

from colluvium.calibration import laboratory
from colluvium.calibration.laboratory import KEPT, SampleTests, key_of, middle, read
from colluvium.calibration.study import plan_of
from colluvium.calibration.targets import strength_name
from coupler_protocol.scene.reader import build_scene
from tests.colluvium.calibration.synthetic import PRESSURES, scene_of

TARGETS = {"young": 1e8, "poisson": 0.2, "cohesion": 2e4, "friction": 25.0}
LAB = {"width": 20.0}


def made(out):
    scene = scene_of(TARGETS, LAB)
    plan, _ = plan_of(scene, None)
    return SampleTests(scene, "soil", plan.targets, out, 1, lambda text: None), plan.space.start


def keep(out, tests, test, young=2e8, peak=3e5):
    """Writes a line of a finished test."""
    answers = {"E": young, "nu": 0.25, "dilation": 5.0, "peak_axial": peak + test.pressure, "peak_side": test.pressure}
    row = {"scene": key_of(test), "set": 1, "parameters": {}, "pressure": test.pressure, "seed": test.seed, "answers": answers}
    with (out / KEPT).open("a") as file:
        file.write(json.dumps(row | {"seconds": 2.0, "processor": 1.0, "short": False}) + "\n")


def test_tests_that_are_kept_are_not_computed_again(tmp_path, monkeypatch):
    tests, start = made(tmp_path)
    for number, pressure in enumerate(PRESSURES):
        keep(tmp_path, tests, tests.trial(start, pressure, 7, False), young=(1 + number) * 1e8)
    tests, start = made(tmp_path)  # the same command again
    asked = []
    monkeypatch.setattr(laboratory, "run_all", lambda jobs, *_: asked.extend(jobs) or [])
    found = tests.measure(start, [7], False)
    assert not asked
    assert found[7]["young"] == pytest.approx(2e8)
    assert found[7][strength_name(2e5)] == pytest.approx(3e5)
    assert tests.spent() == (3, 6.0, 3.0)
    assert tests.measure(start, [7, 8], False).keys() == {7}  # nothing ran for seed 8
    assert len(asked) == 3
    assert {job.out.parent for job in asked} == {tmp_path / "trials"}
    assert len({job.name for job in asked}) == 3


def test_other_parameters_are_another_test(tmp_path):
    tests, start = made(tmp_path)
    keys = {key_of(tests.trial(start | {"friction": mu}, p, seed, short)) for mu in (0.2, 0.3) for p in PRESSURES
            for seed in (1, 2) for short in (True, False)}  # fmt: skip
    assert len(keys) == 24
    assert key_of(tests.trial(start, 1e5, 1, False)) == key_of(tests.trial(dict(start), 1e5, 1, False))


def test_a_line_that_was_cut_is_left_out(tmp_path):
    (tmp_path / KEPT).write_text('{"scene": "a"}\n{"scene": "b"}\n{"sce')
    assert [row["scene"] for row in read(tmp_path / KEPT)] == ["a", "b"]
    assert read(tmp_path / "none.jsonl") == []


def test_short_tests_end_at_half_of_the_strength_and_cost_less(tmp_path):
    tests, start = made(tmp_path)
    short, full = tests.trial(start, 1e5, 1, True), tests.trial(start, 1e5, 1, False)
    assert short.loading.strain < 0.1 * full.loading.strain
    assert short.loading.steps <= full.loading.steps / 3
    assert (tests.cost(True), tests.cost(False)) == (1, 3)
    assert tests.pressures_of(True) == [middle(PRESSURES)] == [1e5]
    for test in (short, full):
        build_scene(test.tables)


def test_full_tests_of_all_sets_end_at_the_same_strain(tmp_path):
    tests, start = made(tmp_path)
    strains = {tests.trial(start | {"normal": kn}, 1e5, 1, False).loading.strain for kn in (1e8, 1e9)}
    assert len(strains) == 1
