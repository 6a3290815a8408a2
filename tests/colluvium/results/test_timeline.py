"""The picture of a trace: steps as many as there are, and a word where there are none."""

import warnings
from types import SimpleNamespace

import pytest

from colluvium.figures import timeline
from colluvium.results.timeline import ACTIVITIES, intervals
from coupler_protocol.process.trace import Trace

NAMES = ("fdm.rank0", "dem.rank1")


def traced(folder, steps, coupled=True, apart=0.0):
    """A run of two processes that take 5 steps in a stage (the discs only if `coupled`); apart: of their clocks [s]."""
    grid, discs = Trace(steps), Trace(steps)
    for trace in (grid, discs):
        trace.begin("couple")
    for _ in range(5):
        for trace in (grid, discs) if coupled else (grid,):
            trace.add_to("waiting")
            trace.stages[-1].steps += 1
            trace.add_to("computing")
            trace.add_to("recording")
    discs.rows = [(*row[:3], row[3] + apart, row[4] + apart) for row in discs.rows]
    for name, trace in zip(NAMES, (grid, discs), strict=True):
        trace.write(folder / f"{name}.trace.csv")
    return SimpleNamespace(folders=[folder])


def titles(run):
    pytest.importorskip("matplotlib")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return [axes.get_title(loc="left") for axes in timeline.draw(run).axes]


@pytest.mark.parametrize(("steps", "shown"), [(1, 1), (2, 2), (5, 5), (9, 5)])
def test_a_short_trace_is_drawn_as_long_as_it_is(tmp_path, steps, shown):
    run = traced(tmp_path, steps)
    assert timeline.missing(run) == ""
    assert titles(run) == [f"couple, steps 0 to {shown} of {shown} traced"]


def test_without_a_coupled_stage_there_is_nothing_to_draw(tmp_path):
    assert timeline.missing(traced(tmp_path, 3, coupled=False)) == "no coupled stage in the trace"


def test_without_a_trace_the_key_is_named(tmp_path):
    assert "record.trace" in timeline.missing(SimpleNamespace(folders=[tmp_path]))


def test_a_process_of_which_nothing_is_shown_has_shares_of_zero(tmp_path):
    run = traced(tmp_path, 3, apart=1e3)
    assert len(titles(run)) == 1
    nothing = intervals(run)[NAMES[0]]
    assert nothing.where(nothing.step < 0).shares() == dict.fromkeys(ACTIVITIES, 0.0)
