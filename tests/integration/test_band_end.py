"""A stage ends by the state of the band, at the frame in which a report finds it, in one process and in two."""

import numpy as np
import pytest

import colluvium
from colluvium.results import band_states as states
from colluvium.results import failure
from coupler_protocol.criteria import shear_band_states
from tests.commands import run_colluvium
from tests.integration.short_runs import FILES, watched
from tests.same_bits import differing

FAILING = (
    "stage.0.until.ratio=1e-4",
    "stage.2.until.ratio=1e-4",
    "stage.3.large_strain=true",
    "stage.3.gravity_factor={to=14.0, over=1500}",
    'stage.3.until={band="enters", steps=3000}',
    "record.every=100",
)


@pytest.fixture(scope="module")
def ended(tmp_path_factory, configs):
    """Folder of a run in this process that ended by its band, and the cells that the continuum looked at."""
    out, seen, holds = tmp_path_factory.mktemp("band"), [], shear_band_states.holds
    scene = colluvium.Scene.read(configs / "quick_slope.toml", FAILING)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(
            shear_band_states, "holds", lambda state, cells, surface: seen.append(cells) or holds(state, cells, surface)
        )
        colluvium.run(scene, out).close()
    return out, seen


@pytest.fixture
def run(ended):
    with colluvium.open_run(ended[0]) as opened:
        yield opened


def test_the_stage_ends_two_steps_after_the_first_frame_in_which_a_report_finds_the_state(run):
    row = run.info["stages"][-1]
    assert row["ended_by"] == "band enters"
    assert 200 < row["steps"] < 3000
    found = [reach for reach in states.reaches(run) if run.frames[reach.frame].stage == "overload"]
    assert [reach.state() for reach in found] == ["a"] * (len(found) - 2) + ["b", "b"]
    assert [found[-1].step - reach.step for reach in found[-2:]] == [2, 0]


def test_the_continuum_saw_what_was_recorded_to_the_bit(run, ended):
    seen = ended[1]
    frames = [i for i, info in enumerate(run.frames) if info.stage == "overload"][:-1]
    assert len(seen) == len(frames) > 3
    for frame, cells in zip(frames, seen, strict=True):
        recorded = failure.cells(run, frame)
        assert np.array_equal(cells.strain, recorded.strain)
        assert np.array_equal(cells.rank, recorded.rank)
        assert np.allclose(cells.xy, recorded.xy, rtol=0, atol=1e-12)
        assert {tuple(sorted(pair)) for pair in cells.pairs.tolist()} == {tuple(sorted(p)) for p in recorded.pairs.tolist()}


def test_two_processes_end_at_the_same_step_with_the_same_bits(ended, tmp_path, configs):
    words = [word for pair in FAILING for word in ("--set", pair)]
    arguments = ["run", configs / "quick_slope.toml", "--out", tmp_path / "run", "--quiet", *words]
    done = run_colluvium(*arguments)
    assert done.returncode == 0, done.stderr
    assert "band enters" in done.stdout
    for name in FILES:
        assert differing(tmp_path / "run" / name, ended[0] / name) == [], name


def test_a_branch_from_the_coupled_state_ends_there_too(ended, tmp_path, configs):
    words = [word for pair in FAILING for word in ("--set", pair)]
    words += ["--in-process", "--quiet", "--from", f"{ended[0]}@couple"]
    arguments = ["run", configs / "quick_slope.toml", "--out", tmp_path / "run", *words]
    done = run_colluvium(*arguments)
    assert done.returncode == 0, done.stderr
    for name in FILES[2:]:
        assert differing(tmp_path / "run" / name, ended[0] / name) == [], name


def test_a_grid_alone_ends_when_its_band_is_complete(tmp_path, configs):
    tables = colluvium.Scene.read(configs / "quick_slope.toml").model_dump(mode="json", exclude_none=True)
    del tables["discs"]
    more = {"name": "overload", "gravity_factor": 12.0, "until": {"band": "complete", "steps": 4000}}
    tables |= {"window": [], "stage": [tables["stage"][0], more], "record": {"every": 100}}
    with colluvium.run(colluvium.Scene(**tables), tmp_path / "run") as run:
        assert run.info["stages"][-1]["ended_by"] == "band complete"
        assert watched(run.info) == []
        assert not any("rim_stretched" in stage for stage in run.info["stages"])
        levels = [level.through for level in failure.levels(run)]
    assert levels[-3] < failure.FAILED <= levels[-2]
