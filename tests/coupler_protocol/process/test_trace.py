"""When a process computed, waited and recorded: a Stopwatch that keeps its intervals."""

import csv
import itertools

from coupler_protocol.process.trace import Stopwatch, Trace, stopwatch


def stepped(watch, stages=("one", "two"), steps=5):
    for stage in stages:
        watch.begin(stage)
        for _ in range(steps):
            watch.add_to("waiting")
            watch.stages[-1].steps += 1
            watch.add_to("computing")
            watch.add_to("recording")
    return watch


def test_the_first_steps_of_every_stage_are_kept_and_written(tmp_path):
    trace = stepped(Trace(3))
    trace.write(tmp_path / "a.csv")
    with open(tmp_path / "a.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    for stage in ("one", "two"):
        own = [row for row in rows if row["stage"] == stage]
        assert [int(row["step"]) for row in own] == [0, 1, 1, 1, 2, 2, 2, 3, 3]
        assert [row["activity"] for row in own] == ["waiting", "computing", "recording"] * 3
        assert all(a["end"] == b["begin"] for a, b in itertools.pairwise(own))
        assert all(float(row["begin"]) <= float(row["end"]) for row in own)


def test_a_trace_of_one_step_has_the_whole_step():
    own = [row for row in stepped(Trace(1)).rows if row[0] == "one"]
    assert [row[1:3] for row in own] == [(0, "waiting"), (1, "computing"), (1, "recording")]


def test_seconds_of_stages_are_booked_as_without_a_trace():
    trace = stepped(Trace(10))
    for times in trace.stages:
        own = [row for row in trace.rows if row[0] == times.name]
        for column in ("computing", "waiting", "recording"):
            assert abs(getattr(times, column) - sum(row[4] - row[3] for row in own if row[2] == column)) < 1e-9


def test_without_the_key_nothing_is_kept():
    assert type(stopwatch(None)) is Stopwatch
    assert isinstance(stopwatch(4), Trace)
