"""`open_run` gives back what was recorded, by rank, frame and name, and says clearly what is not there."""

import json
import shutil
import subprocess
import sys
from importlib.metadata import version

import numpy as np
import pytest

import colluvium
from colluvium.figures import moments, roses, stress
from colluvium.results import failure
from colluvium.results.rank_file import ClosedRunError, NotRecordedError
from colluvium.results.run import open_run
from coupler_protocol.files.recorder import FrameInfo, Recorder


@pytest.fixture(scope="module")
def run(run_folder):
    with open_run(run_folder) as opened:
        yield opened


def test_frames_and_stages_of_all_ranks(run):
    assert run.stages == ["equilibrium", "couple", "overload"]
    assert [info.step for info in run.frames] == [0, 1000, 2000, 3000, 4000, 5000]
    assert run.frames[-1] == FrameInfo(5000, 5000.0, "overload", 9.0)
    assert run.last_frame("couple") == 3
    assert [run.has(frame, 1) for frame in range(6)] == [False, False, True, True, True, True]
    assert run.windows == [1]


def test_a_run_says_what_it_is_and_what_it_has(run, run_folder):
    assert repr(run) == (
        f"<Run {run_folder}: a slope of closed forms; 6 frames of equilibrium, couple, overload up to step 5,000; "
        "rank 0 continuum, rank 1 discrete; done>"
    )
    assert set(run.histories()) == {"unbalanced_ratio", "gravity_factor"}
    assert set(run.histories(1)) == {"unbalanced_ratio", "bonds_broken"}
    table = run.fields()
    assert (0, "zones", "stress", "Pa", "stress, tension positive") in table
    assert {(rank, place) for rank, place, *_ in table} == {(0, "gridpoints"), (0, "zones"), (1, "discs"), (1, "contacts")}
    for rank, place, name, *_ in table:
        assert name in getattr(run, place)(5, rank)


def test_a_closed_run_says_so(run_folder):
    opened = open_run(run_folder)
    zones, read = opened.zones(5), opened.zones(5).stress
    opened.close()
    opened.close()  # a second time does nothing
    assert read.shape[1] == 4  # arrays that were read remain
    for ask in (lambda: zones.stress, lambda: opened.discs(5), lambda: opened.history("gravity_factor"), opened.fields):
        with pytest.raises(ClosedRunError, match=r"this run is closed; .*open it again"):
            ask()
    assert repr(opened).startswith("<closed Run ")


def test_large_libraries_are_loaded_when_they_are_used():
    code = "import sys, colluvium.results.run, colluvium.cli; colluvium.cli.parser(); "
    code += "sys.exit(' '.join({'scipy', 'shapely', 'numba', 'pydantic'} & set(sys.modules)) or 0)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_the_version_is_that_of_the_distribution():
    assert colluvium.__version__ == version("colluvium")


def test_stages_stand_in_the_order_of_the_scene(run_folder, tmp_path):
    """Where two stages begin at the same step, only the scene knows which was first."""
    shutil.copytree(run_folder, tmp_path, dirs_exist_ok=True)
    stages = [{"name": name} for name in ("equilibrium", "fill", "overload", "couple")]
    (tmp_path / "scene.json").write_text(json.dumps({"stage": stages}))
    with open_run(tmp_path) as run:
        assert run.stages == ["equilibrium", "overload", "couple"]


def test_stages_are_found_by_their_kind_not_by_their_name(run_folder, tmp_path):
    """What is shown of a stage follows its kind: here the one named overload couples, and the one named couple overloads."""
    shutil.copytree(run_folder, tmp_path, dirs_exist_ok=True)
    kinds = {"equilibrium": "equilibrium", "couple": "overload", "overload": "couple"}
    tables = [{"name": name, "kind": kind} for name, kind in kinds.items()]
    (tmp_path / "scene.json").write_text(json.dumps({"stage": tables}))
    with open_run(tmp_path) as swapped, open_run(run_folder) as plain:
        assert (swapped.stages_where(couples=True), plain.stages_where(couples=True)) == (["overload"], ["couple"])
        assert swapped.stages_where(locates=True) == []
        assert swapped.stages_where(couples=False) == ["equilibrium", "couple"]
        assert stress.moments(plain) == (1, plain.last_frame("couple"))
        assert stress.moments(swapped) == (1, plain.last_frame("overload"))
        looked_at = [level.step for level in failure.levels(swapped)]
        assert looked_at == [info.step for info in swapped.frames if info.stage == "couple"]
        assert [one.frame for one in roses.shown(swapped)] != [one.frame for one in roses.shown(plain)]
        assert moments.lacking(swapped) == ""
    (tmp_path / "scene.json").write_text(json.dumps({"stage": [{"name": name, "kind": "load"} for name in kinds]}))
    with open_run(tmp_path) as run:
        assert moments.lacking(run) == "no frame of an overload stage"


def test_the_continuum_comes_back(run, slope):
    xy, zones = slope.grid()
    before, after = run.zones(0), run.zones(-1)
    assert np.array_equal(before.corners, zones)
    assert np.array_equal(run.gridpoints(0).xy, xy)
    hole = slope.in_window(xy[zones].mean(axis=1))
    assert np.array_equal(after.corners, zones[~hole])
    assert np.array_equal(after.stress, 9.0 * slope.stress_at(xy[zones[~hole]].mean(axis=1)))
    assert np.array_equal(run.gridpoints(-1).displacement, slope.slip_at(xy, 0.8))
    triangle = zones[:, 3] == zones[:, 2]
    assert 0 < triangle.sum() < len(zones)
    assert np.allclose(before.xy[~triangle], xy[zones[~triangle]].mean(axis=1), rtol=0, atol=1e-12)
    assert np.allclose(before.xy[triangle], xy[zones[triangle, :3]].mean(axis=1), rtol=0, atol=1e-12)


def test_the_discs_come_back(run, slope):
    ring, free = slope.ring_and_discs()
    centres = np.concatenate((ring, free))
    discs, contacts = run.discs(-1), run.contacts(-1)
    assert np.array_equal(discs.xy, centres + slope.slip_at(centres, 0.8))
    assert discs.displacement.shape == (len(centres), 2)
    ends, normal_force, _ = slope.contacts_under(centres, len(ring), 9.0)
    assert np.array_equal(contacts.ends, ends)
    assert np.array_equal(contacts.normal_force, normal_force)
    assert np.array_equal(discs.id[contacts.ends], np.column_stack((contacts.disc_a, contacts.disc_b)))
    assert len(contacts.bond_state) == len(ends)


def test_histories_units_and_the_scene(run):
    steps, factor = run.history("gravity_factor")
    assert len(steps) == 600
    assert factor[steps == 5000] == 9.0
    assert run.history("bonds_broken", rank=1)[1].tolist() == [400.0, 900.0, 1600.0, 2500.0]
    assert (run.units("stress"), run.units("bonds_broken"), run.units("normal_force")) == ("Pa", "-", "N")
    assert run.scene["title"] == "a slope of closed forms"
    assert run.info["exit_code"] == 0


def test_errors_say_what_there_is(run, tmp_path):
    with pytest.raises(AttributeError, match="no field 'porosity' here; it has corners, group, plastic_state"):
        _ = run.zones(0).porosity
    with pytest.raises(NotRecordedError, match=r"nothing at frame 0 \(step 0, equilibrium\).*between 2 and 5"):
        run.discs(0)
    with pytest.raises(NotRecordedError, match="rank 1 has it"):
        run.history("bonds_broken")
    with pytest.raises(NotRecordedError, match="rank 2 has no discs, contacts here: rank 0 has zones"):
        run.discs(-1, rank=2)
    with pytest.raises(NotRecordedError, match="nothing named 'mood'"):
        run.units("mood")
    with pytest.raises(NotRecordedError, match="equilibrium, couple, overload"):
        run.last_frame("picnic")
    with pytest.raises(IndexError, match="frame 6 of 6"):
        run.zones(6)
    with pytest.raises(FileNotFoundError, match="rankN"):
        open_run(tmp_path)


def test_the_two_servers_may_have_written_to_different_folders(run_folder, tmp_path):
    first, second = tmp_path / "a", tmp_path / "b"
    for folder, name in ((first, "fdm.rank0.vtkhdf"), (second, "dem.rank1.vtkhdf")):
        folder.mkdir()
        shutil.copy(run_folder / name, folder)
    with open_run(first, second) as run:
        assert list(run.files) == [0, 1]
        assert (run.info, run.scene) == ({}, {})
    with open_run(second) as run:
        assert [info.step for info in run.frames] == [2000, 3000, 4000, 5000]


def test_a_run_is_read_while_it_is_written(tmp_path, slope):
    with Recorder(tmp_path / "fdm.rank0.vtkhdf", "continuum") as recorder:
        xy, zones = slope.grid()
        for step in range(3):
            with open_run(tmp_path) as run:
                assert len(run.frames) == step
            recorder.frame(
                FrameInfo(step, float(step), "equilibrium", 1.0),
                points=xy,
                cells=zones,
                point_fields={"displacement": np.full_like(xy, step)},
                cell_fields={},
            )
            recorder.sync()
            with open_run(tmp_path) as run:
                assert (run.gridpoints(-1).displacement == step).all()
