"""The rule for the four states of the band on slopes whose strain is prescribed, and the intervals of the fabric."""

import json
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest

from colluvium.results import band_states, failure
from colluvium.results.fabric import contact_fabric
from colluvium.results.run import open_run
from coupler_protocol.files.recorder import FrameInfo, Recorder

BEFORE = [(5.0, 4.5), (10.75, 7.75)]  # toe to the window's left side
INSIDE = [(11.25, 7.75), (12.75, 8.75)]
BEYOND = [(13.25, 9.25), (14.25, 10.0)]
LAST = [(14.25, 10.0), (16.25, 11.75)]  # to the crest
UNDER = [(5.0, 4.5), (14.25, 3.75), (16.25, 11.75)]  # toe to crest without the window
STRAIN = 0.02


def strained(xy, *lines, value=STRAIN):
    """(n,) `value` at the places no further than .45 m from one of the lines, else 1e-5."""
    strain = np.full(len(xy), 1e-5)
    for line in lines:
        for start, end in pairwise(line):
            along = np.subtract(end, start)
            share = np.clip((xy - start) @ along / (along @ along), 0.0, 1.0)
            strain[np.hypot(*(xy - start - share[:, None] * along).T) < 0.45] = value
    return strain


@pytest.fixture
def make_run(tmp_path, slope):
    """Writes a run whose frames are strained along lines; of each frame (lines of the zones, lines of the window)."""

    def make(*moments, strain_in_window=None):
        xy, zones = slope.grid()
        ring, free = slope.ring_and_discs()
        centres = np.concatenate((ring, free))
        corner, size = np.array([11.0, 5.0]), 0.5
        bins = corner + size * (np.floor((centres - corner) / size).clip(0, (3, 9)) + 0.5)
        run = {"stage": [{"name": "grid", "kind": "equilibrium"}, {"name": "couple", "kind": "couple"}]}
        run["stage"].append({"name": "more gravity", "kind": "overload"})
        (tmp_path / "scene.json").write_text(json.dumps(run))
        fdm = Recorder(tmp_path / "fdm.rank0.vtkhdf", "continuum", "strained", {})
        dem = Recorder(tmp_path / "dem.rank1.vtkhdf", "discrete", "strained", {})
        with fdm, dem:
            for number, (outside, inside) in enumerate([((), ()), ((), ()), *moments]):
                stage = run["stage"][min(number, 2)]["name"]
                info = FrameInfo(100 * number, 100.0 * number, stage, 1.0 + 0.1 * number)
                active = zones if number == 0 else zones[~slope.in_window(xy[zones].mean(axis=1))]
                strain = strained(xy[active].mean(axis=1), *outside)
                fdm.frame(
                    info, points=xy, cells=active, point_fields={"displacement": 0.0 * xy}, cell_fields={"shear_strain": strain}
                )
                if number == 0:
                    continue
                shear = strained(bins, *inside) if strain_in_window is None else np.full(len(bins), strain_in_window)
                moved = np.column_stack((shear * (centres - bins)[:, 1], np.zeros(len(bins))))
                fields = {"radius": np.full(len(bins), 0.05), "displacement": moved}
                fields["control"] = (np.arange(len(bins)) < len(ring)).astype(int)
                ends = np.array([[len(ring), len(ring) + 1]])
                forces = {"normal_force": np.ones(1)}
                dem.frame(info, points=centres + moved, cells=ends, point_fields=fields, cell_fields=forces)
        return open_run(tmp_path)

    return make


def letters(run):
    return "".join(one.state() for one in band_states.reaches(run))


ALL = ((BEFORE, BEYOND, LAST), (INSIDE,))


def test_one_state_after_the_other(make_run):
    run = make_run(
        ((BEFORE,), ()),  # the band has come to the window, nothing happens in it
        ((BEFORE,), (INSIDE,)),
        ((BEFORE, BEYOND), (INSIDE,)),
        ALL,
        ALL,
    )
    found = band_states.reaches(run)
    assert [one.frame for one in found] == [1, 2, 3, 4, 5, 6]  # from the coupled state on
    assert letters(run) == "aabcdd"
    assert [one.reach.frame for one in band_states.states(found)] == [1, 3, 4, 5]
    assert [one.alike for one in band_states.states(found)] == ["", "", "", ""]
    assert band_states.last_before(found).frame == 2
    assert band_states.states(found)[3].as_text() == "d (complete, toe to crest): 1.50 g, step 500"


def test_levels_are_the_strains_that_connect(make_run):
    last = band_states.reaches(make_run(ALL))[-1]
    assert (last.enters, last.through, last.complete) == pytest.approx(3 * (STRAIN,), rel=1e-9)
    part = band_states.reaches(make_run(((BEFORE,), (INSIDE,))))[-1]
    assert (part.enters, part.through, part.complete) == pytest.approx((STRAIN, 1e-5, 1e-5), rel=1e-9)


def test_states_reached_in_the_same_frame_are_reported_so(make_run):
    reached = band_states.states(band_states.reaches(make_run(((), ()), ALL)))
    assert [one.reach.frame for one in reached] == [1, 3, 3, 3]
    assert [one.alike for one in reached] == ["", "cd", "bd", "bc"]
    assert reached[2].as_text().endswith("step 300, in the same frame as b and d")


def test_states_not_reached_are_reported_so(make_run):
    found = band_states.reaches(make_run(((BEFORE,), (INSIDE,))))
    reached = band_states.states(found)
    assert [one.reach and one.reach.frame for one in reached] == [1, 2, None, None]
    assert reached[3].as_text() == "d (complete, toe to crest): not reached"
    assert band_states.last_before(found).frame == 1


def test_a_connection_that_is_lost_again_does_not_count(make_run):
    through = ((BEFORE, BEYOND), (INSIDE,))
    entered = ((BEFORE,), (INSIDE,))
    reached = band_states.states(band_states.reaches(make_run(through, entered, through, ALL)))
    assert [one.reach.frame for one in reached] == [1, 2, 4, 5]
    assert reached[2].seen.frame == 2
    assert reached[2].as_text() == "c (through the window): 1.40 g, step 400 (seen at 1.20 g, lost again)"


def test_a_window_that_shears_everywhere_has_no_band(make_run):
    """Strained by 2 % as the zones are, but nowhere twice as much as elsewhere in the window."""
    run = make_run(ALL, strain_in_window=STRAIN)
    assert letters(run) == "aa"
    assert failure.levels(run)[-1].through == pytest.approx(STRAIN, rel=1e-9)


def test_a_band_round_the_window_does_not_enter_it(make_run):
    """Nor does one that comes to the window from the side of the crest."""
    run = make_run(((UNDER,), ()), ((UNDER, BEYOND), (INSIDE,)))
    assert letters(run) == "aaa"
    assert failure.levels(run)[-1].around == pytest.approx(STRAIN, rel=1e-9)


def test_the_picture_shows_each_state_once(make_run):
    pytest.importorskip("matplotlib")
    pytest.importorskip("cmcrameri")
    from colluvium.figures import moments
    from colluvium.figures import states as picture

    run = make_run(((BEFORE,), (INSIDE,)), ((BEFORE,), (INSIDE,)), ALL)
    assert not picture.missing(run)
    assert [frame for _, frame in moments.of_band(run)] == [1, 2, 4]
    assert [frame for _, frame in moments.of_run(run, 0)] == [1, 2, 4]  # the initial coupled state is the last before b
    assert moments.of_band(run)[-1].words == "c through the window\nd complete, toe to crest"
    figure = picture.draw(run)
    assert len(figure.axes) == 4  # three moments and the colour bar


class Rows(dict):
    """What results.Fields are to the fabric."""

    __getattr__ = dict.__getitem__


def run_of(theta, force):
    """A run of pairs of discs, of which each touches in direction theta."""
    start = np.column_stack((3.0 * np.arange(len(theta)), np.zeros(len(theta))))
    xy = np.concatenate((start, start + np.column_stack((np.cos(theta), np.sin(theta)))))
    ends = np.column_stack((np.arange(len(theta)), np.arange(len(theta)) + len(theta)))
    contacts = Rows(ends=ends, normal_force=force)
    return SimpleNamespace(discs=lambda *_: Rows(xy=xy), contacts=lambda *_: contacts)


def test_half_widths_are_those_of_the_fabric():
    rng = np.random.default_rng(7)
    run = run_of(np.pi * rng.random(400) ** 1.5, rng.gamma(2.0, 0.5, 400))
    fabric, width = band_states.fabric(run, 0)
    assert fabric == contact_fabric(run.discs(), run.contacts())
    assert (width.a, width.a_n) == (fabric.a_interval[1] - fabric.a, fabric.a_n_interval[1] - fabric.a_n)
    assert (width.theta_a, width.theta_n) == (fabric.theta_a_error, fabric.theta_n_error)
    assert 0.02 < width.a < 0.3


def test_few_contacts_have_no_fabric():
    assert band_states.fabric(run_of(np.linspace(0.0, 3.0, 30), np.ones(30)), 0) is None
    assert band_states.fabric(run_of(np.linspace(0.0, 3.0, 50), -np.ones(50)), 0) is None


def test_frames_after_the_failure_are_not_looked_at(make_run, monkeypatch):
    """Those before are, each once: a summary needs the last that had not failed."""
    run = make_run(((), ()), ALL, ((BEFORE,), (INSIDE,)), ALL)
    of_all = failure.levels(run)
    failed = failure.failure(of_all)
    looked_at, level = [], failure.level
    monkeypatch.setattr(failure, "level", lambda *given: looked_at.append(given[1]) or level(*given))
    found = failure.summary(run)
    assert looked_at == [one.frame for one in of_all if one.frame <= failed.frame]
    assert len(looked_at) < len(of_all)
    assert (found["failed_at"], found["step"]) == (failed.gravity_factor, failed.step)
    assert found["not_failed_at"] == of_all[of_all.index(failed) - 1].gravity_factor
    assert failure.summary(run, 1.0)["failed_at"] is None
    assert looked_at[-1] == of_all[-1].frame
