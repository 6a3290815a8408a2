"""The comparison with other engines runs with whatever is installed, and compares the same work (no seconds asserted)."""

import json

import numpy as np
import pytest
from bench.peers import ENGINES
from bench.peers.compare import box_rows
from bench.peers.engine import Outcome, PeerError

from tests.commands import run_script

BOXES = ["dense box, friction", "dense box, friction, contact bonds"]


@pytest.fixture(scope="module")
def told(tmp_path_factory):
    """What a fast run says, and its rows by name."""
    file = tmp_path_factory.mktemp("peers") / "rows.json"
    done = run_script("bench_peers.py", "--fast", "--repeats", "1", "--json", file, timeout=600)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout, {row["name"]: row for row in json.loads(file.read_text())}


def test_our_own_rows_are_there(told):
    _, rows = told
    for box in BOXES:
        row = rows[f"ours; {box}"]
        assert (row["unit"], row["size"], row["repeats"], row["threads"]) == ("disc-steps/s", 2500, 1, 1)
        assert row["value"] > 0.0
        assert set(row["companion"]) == {"triad_GB_per_s", "cpu"}


@pytest.mark.parametrize("engine", ENGINES, ids=lambda engine: engine.NAME)
def test_an_engine_does_the_same_work_or_is_said_to_be_missing(told, engine):
    said, rows = told
    if engine.version() is None:
        assert f"{engine.NAME}: not installed" in said
        assert not any(engine.NAME in name for name in rows)
        return
    boxes = [box for box, bonded in zip(BOXES, (False, True), strict=True) if engine.choices(bonded)]
    for box in boxes:
        theirs = rows[f"{engine.NAME}; {box}"]
        ratio = rows[f"ours over {engine.NAME}; {box}"]["value"]
        assert ratio == pytest.approx(rows[f"ours; {box}"]["value"] / theirs["value"], rel=0.5)
        assert "off ours;" in theirs["note"]
        assert all(difference in theirs["note"] for difference in engine.DIFFERENCES)
        assert all(difference in said for difference in engine.DIFFERENCES)


class Twin:
    """An engine that is our own discs, with a flaw if one is wanted."""

    NAME, TRIAL, DIFFERENCES = "twin", {True: {"stress_free": True, "equal_radii": True}}, ()
    stiffness = 1.0

    @classmethod
    def choices(cls, bonded):
        return {"speed": ["slow", "fast", "broken"]}

    @classmethod
    def run(cls, box, steps, settings, trial=False):
        """Explicit steps over all pairs that touch or are bonded, normal forces and shear written out once more."""
        if settings["speed"] == "broken":
            raise PeerError("no such speed")
        xy, velocity = (box.xy, box.xy) if not trial else moved(box, steps, cls.stiffness)
        return Outcome(1e-3 if settings["speed"] == "fast" else 2e-3, xy, velocity)


def moved(box, steps, stiffness):
    """Positions and velocities after `steps` steps of bonded, stress-free discs of one size."""
    a, b = box.bonds.T
    x, v, spin, shear = box.xy.copy(), box.velocity.copy(), np.zeros(len(box.xy)), np.zeros(len(a))
    rest = np.hypot(*(x[b] - x[a]).T)
    inverse = np.where(np.arange(len(x)) < box.held, 0.0, box.dt / box.mass)
    for step in range(steps + 1):
        branch = x[b] - x[a]
        d = np.hypot(*branch.T)
        n = branch / d[:, None]
        t = np.column_stack([-n[:, 1], n[:, 0]])
        if step > 0:
            slip = ((v[b] - v[a]) * t).sum(axis=1) - 0.5 * d * (spin[a] + spin[b])
            shear -= stiffness * box.shear * box.dt * slip
        if step == steps:
            return x, v
        force = -box.normal * (d - rest)[:, None] * n + shear[:, None] * t
        share = 1.0 if step > 0 else 0.5
        for k in range(2):
            total = np.bincount(b, force[:, k], len(x)) - np.bincount(a, force[:, k], len(x))
            v[:, k] += share * inverse * total
        moment = -0.5 * d * shear
        total = np.bincount(a, moment, len(x)) + np.bincount(b, moment, len(x))
        spin += share * inverse * total / (0.5 * box.radius**2)
        x += v * box.dt


def test_the_trial_tells_the_same_springs_from_others(monkeypatch):
    rows, failed, differ = box_rows(2500, True, [Twin], 10_000, 2, {}, tune=True)
    assert failed == []
    assert differ == []
    assert "speed fast" in next(row for row in rows if row["name"].startswith("twin"))["note"]
    monkeypatch.setattr(Twin, "stiffness", 1.2)
    rows, _, differ = box_rows(2500, True, [Twin], 10_000, 2, {}, tune=False)
    assert differ == ["twin; dense box, friction, contact bonds, 2500"]
    assert "NOT THE SAME WORK" in next(row for row in rows if row["name"].startswith("twin"))["note"]


def test_an_engine_that_fails_is_named_and_leaves_the_others_alone(monkeypatch):
    monkeypatch.setattr(Twin, "choices", classmethod(lambda cls, bonded: {"speed": ["broken"]}))
    rows, failed, differ = box_rows(2500, True, [Twin], 10_000, 2, {}, tune=False)
    assert [row["name"] for row in rows] == ["ours; dense box, friction, contact bonds"]
    assert failed == ["twin; dense box, friction, contact bonds, 2500: no such speed"]
    assert differ == []


def test_boxes_that_do_not_exist_are_refused():
    done = run_script("bench_peers.py", "--sizes", "2500,77", timeout=60)
    assert done.returncode == 2
    assert "no such box: 77; there are 2500, 10000, 50000, 200000" in done.stderr
