"""Motion of a trial: gridpoints and discs are one body; what each side has written gives the spans of the verdict."""

import json
from types import SimpleNamespace

import numpy as np
import pytest

from colluvium.safety import judge as judging
from colluvium.safety.judge import LOOKS, Judge, Meter, farthest, read_rows, rows_of, spans_of
from coupler_protocol.exits import EnvironmentFailed
from fdm_server.fos.verdict import FAILS, LEAST, RESTS


def meters(motions, masses):
    """Rows of one side that moves by motions (k, n, 2) in spans."""
    place = np.zeros_like(motions[0])
    meter, rows = Meter(place.copy(), place.copy(), place.copy()), []
    for k, motion in enumerate(motions):
        meter.ratios = [0.1 / (k + 1)] * LOOKS
        place = place + motion
        rows.append(meter.row(place, masses))
    return rows


def test_two_sides_are_one_body():
    """Root mean square by mass and cosine over all bodies are those of the bodies in one array."""
    rng = np.random.default_rng(3)
    motion, mass = rng.normal(size=(3, 9, 2)), rng.uniform(0.5, 2.0, 9)
    spans = spans_of([meters(motion[:, :4], mass[:4]), meters(motion[:, 4:], mass[4:])])
    (whole,) = [spans_of([meters(motion, mass)])]
    assert [tuple(s) for s in spans] == [pytest.approx(tuple(s)) for s in whole]
    lengths = np.sqrt((mass[:, None] * motion**2).sum(axis=(1, 2)) / mass.sum())
    assert [s.motion for s in spans] == pytest.approx(lengths)
    cosine = (mass[:, None] * motion[1] * motion[0]).sum() / mass.sum() / (lengths[0] * lengths[1])
    assert spans[0].similarity == 0.0
    assert spans[1].similarity == pytest.approx(cosine)


def test_the_ratio_of_the_worse_side_counts():
    calm, loud = meters(np.ones((2, 3, 2)), np.ones(3)), meters(np.ones((2, 3, 2)), np.ones(3))
    loud[1]["ratios"] = [0.2, 0.4, 0.6, 0.9]
    spans = spans_of([calm, loud])
    assert [s.ratio for s in spans] == pytest.approx([0.1, 0.5])
    assert spans[1].last_ratio == 0.9
    assert farthest([calm, loud]) == pytest.approx(2.0 * 2.0**0.5)


@pytest.fixture
def moving(monkeypatch, tmp_path):
    """Takes `count` spans of a made-up slope; motion [m] of grid and discs by span; returns text and step."""
    monkeypatch.setattr(judging, "_of_grid", lambda m, g: (m.state, np.ones(len(m.state)), m.model))
    monkeypatch.setattr(judging, "_of_discs", lambda m, g: (m.state, np.ones(len(m.state)), m.model))

    def take(count, grid, discs, ratio, windows=1):
        sides = {rank: Judge(tmp_path, "trial", 100, 1e-5, 1e-2, 9.81, windows) for rank in range(windows + 1)}
        place = {0: np.zeros((5, 2)), 1: np.zeros((7, 2))}
        for look in range(count * LOOKS + 1):
            span = max(look - 1, 0) // LOOKS
            for rank in (1, 0):
                speed = (grid, discs)[rank](span) / LOOKS
                place[rank] = place[rank] + (speed if look else 0.0)
                if rank <= windows:
                    said = sides[rank].on_step(SimpleNamespace(rank=rank, stage="trial", model=ratio, state=place[rank]))
                    if said:
                        return said, look * 25
        return None, count * 100

    return take


def test_rest_of_grid_and_discs_is_seen_one_span_later(moving):
    """The first span at rest ends at step 100; the grid says so at 200, when it certainly has the discs' row."""
    assert moving(4, lambda k: 0.0, lambda k: 0.0, 1e-6) == (RESTS, 200)


def test_discs_that_move_are_no_rest(moving):
    assert moving(8, lambda k: 0.0, lambda k: 1e-3, 1e-6)[0] is None


def test_discs_alone_can_fail(moving):
    """The grid rests; the discs accelerate in one shape, under a constant ratio: failure after LEAST spans, and one."""
    assert moving(40, lambda k: 0.0, lambda k: 1e-3 * (k + 1), 1e-2) == (FAILS, 100 * (LEAST + 1))


def test_a_window_without_rows_is_named(moving, tmp_path):
    (tmp_path / "other").mkdir()
    one = Judge(tmp_path / "other", "trial", 100, 1e-5, 1e-2, 9.81, 2)
    one.rows = meters(np.ones((3, 4, 2)), np.ones(4))
    with pytest.raises(EnvironmentFailed, match="a window has not written its motion of span 2"):
        one._verdict()


def test_half_a_line_is_not_read(tmp_path):
    rows_of(tmp_path, 1).write_text(json.dumps({"square": 1.0}) + '\n{"squ')
    assert read_rows(tmp_path, 1) == [{"square": 1.0}]


def test_other_stages_are_not_judged(tmp_path):
    one = Judge(tmp_path, "trial", 100, 1e-5, 1e-2, 9.81, 1)
    assert one.on_step(SimpleNamespace(rank=0, stage="couple", model=None, state=None)) is None
    assert not one.meters


def test_a_plugin_reads_what_was_written(tmp_path):
    from coupler_protocol.process.plugin import from_file

    plugin = from_file(Judge(tmp_path, "trial", 120, 1e-5, 1e-2, 9.81, 1).write())
    assert plugin.every == 30
    assert plugin.on_step(SimpleNamespace(rank=0, stage="other")) is None
    assert Judge.read(tmp_path).settlement == 1e-2
