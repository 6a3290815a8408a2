"""The timeline of two processes: intervals of each follow one another, and those of both the order of the exchange."""

import numpy as np
import pytest

import colluvium
from colluvium.figures import timeline
from colluvium.results.timeline import ACTIVITIES, intervals
from tests.window_scenes import BOX, L_SHAPE, uniform

TRACED = 60


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A coupled run of two processes with a trace."""
    data = uniform(BOX, L_SHAPE, radius=0.08)
    data["record"] = {"every": 20, "trace": TRACED}
    data["stage"][2]["until"] = {"steps": 80}
    data["stage"].append({"name": "more", "kind": "overload", "until": {"steps": 80}})
    with colluvium.run(colluvium.Scene(**data), tmp_path_factory.mktemp("trace") / "run", in_process=False) as found:
        yield found


def of_stage(run, stage):
    found = intervals(run)
    assert list(found) == ["fdm.rank0", "dem.rank1"]
    return [own.where(own.stage == stage) for own in found.values()]


@pytest.mark.parametrize("stage", ["couple", "more"])
def test_intervals_of_a_process_do_not_overlap_and_cover_its_time(run, stage):
    for own in of_stage(run, stage):
        assert set(own.activity) == set(ACTIVITIES)
        assert (own.begin <= own.end).all()
        assert (own.begin[1:] >= own.end[:-1]).all()
        assert (own.end - own.begin).sum() >= 0.95 * (own.end[-1] - own.begin[0])
        assert set(own.step) == set(range(TRACED + 1))


@pytest.mark.parametrize("stage", ["couple", "more"])
def test_forces_are_heard_before_velocities_and_these_before_the_next_forces(run, stage):
    grid, discs = (own.where(own.activity == "waiting") for own in of_stage(run, stage))
    np.testing.assert_array_equal(grid.step, np.arange(TRACED))
    np.testing.assert_array_equal(discs.step, np.arange(TRACED))
    assert (grid.end < discs.end).all()  # the order of a step answers its forces
    assert (discs.end[:-1] < grid.end[1:]).all()  # the next forces are those after that order


def test_the_report_draws_it(run):
    pytest.importorskip("matplotlib")
    assert timeline.missing(run) == ""
    figure = timeline.draw(run)
    titles = [axes.get_title(loc="left") for axes in figure.axes]
    assert [title.partition(",")[0] for title in titles] == ["couple", "more"]
    assert titles[0] == f"couple, steps 24 to 36 of {TRACED} traced"
    assert len(figure.axes[0].collections) == 2 * len(ACTIVITIES)


def test_a_trace_of_plain_steps_is_drawn_between_its_waits(run):
    """They are not recorded one by one: a step is complete when the wait for the next one begins."""
    own = of_stage(run, "more")[0]
    plain = own.where(own.activity != "recording")
    waits = plain.where((plain.step == 30) & (plain.activity == "waiting"))
    assert timeline._moment(plain, 30) == waits.begin.min()
    assert timeline._moment(own, 29) <= timeline._moment(plain, 30)
