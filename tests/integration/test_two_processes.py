"""Two processes over TCP give the bits of one process, and neither outlives the other for long."""

import json
import os
import signal
import subprocess
import sys
import time
from contextlib import suppress

import h5py
import numpy as np
import pytest

from colluvium import open_run, status
from coupler_protocol.exits import EnvironmentFailed
from tests.commands import command, finished, run_colluvium
from tests.integration.short_runs import (
    FILES,
    IMPATIENT,
    LONG,
    STONES,
    alive,
    children_of,
    coupled_frames,
    end,
    overrides,
    start_servers,
    wait_for,
)
from tests.same_bits import differing


def test_servers_started_by_hand_equal_the_in_process_twin_bit_for_bit(tmp_path, configs, short_run):
    """Also while others ask for their status and read their frames all the time, from the folder of either side."""
    fdm, dem = start_servers(configs / "quick_slope.toml", tmp_path / "a", tmp_path / "b")
    seen = set()
    try:
        deadline = time.monotonic() + 300.0
        while fdm.poll() is None and time.monotonic() < deadline:
            seen |= seen_in(tmp_path / "a") | seen_in(tmp_path / "b")
            time.sleep(0.1)
        assert fdm.wait(1) == 0, fdm.stderr.read()
        assert dem.wait(30) == 0, dem.stderr.read()
    finally:
        end(fdm, dem)
    for name in FILES:
        there = tmp_path / ("a" if name.startswith("fdm") else "b") / name
        assert differing(there, short_run / name) == [], name
    assert {("fdm.rank0", "running"), ("dem.rank1", "running")} <= seen
    assert {state for _, state in seen_in(tmp_path / "a") | seen_in(tmp_path / "b")} == {"finished"}


def seen_in(folder):
    """(process, state) of all processes of a folder, whose frames are read as well."""
    try:
        info = status.of_folder(folder)
    except EnvironmentFailed:  # the server has not begun
        return set()
    with suppress(FileNotFoundError, OSError, KeyError), open_run(folder) as run:
        if run.frames:
            assert len(run.bodies(-1)[0].xy)
    return {(row["process"], row["state"]) for row in info["processes"]}


def test_launched_run_equals_the_in_process_twin_bit_for_bit_and_takes_no_servers_of_another_tree(tmp_path, configs, short_run):
    """The launcher starts the servers of its own installation, wherever it is called."""
    for name in ("fdm_server", "dem_server"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "__init__.py").write_text("raise SystemExit(99)\n")
    words = [sys.executable, "-P", "-m", "colluvium.cli", "run", configs / "quick_slope.toml", "--out", tmp_path / "run"]
    done = finished([*words, *overrides(), "--quiet"], cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    for name in FILES:
        assert differing(tmp_path / "run" / name, short_run / name) == [], name


@pytest.mark.parametrize(("body", "mixed"), [("clump", "zone"), pytest.param("cluster", "nodal", marks=pytest.mark.long)])
def test_stones_are_the_same_bits_in_one_process_and_two(tmp_path, configs, body, mixed):
    words = ["run", configs / "quick_slope.toml", "--quiet", *overrides(*STONES, f"stones.body={body}", f"grid.mixed={mixed}")]
    for more in (["--out", tmp_path / "two"], ["--out", tmp_path / "one", "--in-process"]):
        done = run_colluvium(*words, *more)
        assert done.returncode == 0, done.stderr
    for name in FILES:
        assert differing(tmp_path / "one" / name, tmp_path / "two" / name) == [], name
    with h5py.File(tmp_path / "one" / FILES[1]) as file:
        assert file["Constants/stone_start"][-1] == len(file["Constants/stone_corners"])
        assert ("centroid" in file["VTKHDF/PointData"]) == (body == "clump")
    window = json.loads((tmp_path / "one" / "run.json").read_text())["windows"][0]
    assert window["stone_content"] == pytest.approx(0.4, rel=1e-12)
    assert window["stone_content_discs"] == pytest.approx(0.4, abs=0.05)


def test_another_seed_gives_other_bits(tmp_path, configs, short_run):
    arguments = ["run", configs / "quick_slope.toml", "--out", tmp_path / "run", "--in-process", "--quiet", *overrides("seed=2")]
    done = run_colluvium(*arguments)
    assert done.returncode == 0, done.stderr
    assert differing(tmp_path / "run" / FILES[1], short_run / FILES[1])


@pytest.mark.parametrize("victim", ["discs", "grid"])
def test_a_killed_peer_ends_the_other_side_with_a_clear_message(tmp_path, configs, victim):
    fdm, dem = start_servers(configs / "quick_slope.toml", tmp_path / "a", tmp_path / "b", *LONG, *IMPATIENT)
    killed, left = (dem, fdm) if victim == "discs" else (fdm, dem)
    try:
        wait_for(lambda: coupled_frames(tmp_path / "b" / "dem.rank1.vtkhdf") > 3, 200, "coupled steps")
        killed.kill()
        assert left.wait(3.0 + 15.0) == 5
        message = left.stderr.read()
        assert "was lost" in message
        assert "3" in message
        stopped = tmp_path / ("a/fdm.rank0.stopped.h5" if victim == "discs" else "b/dem.rank1.stopped.h5")
        with h5py.File(stopped) as file:
            assert len(file) > 0
        if victim == "discs":
            info = json.loads((tmp_path / "a" / "run.json").read_text())
            assert info["exit_code"] == 5
            assert "was lost" in info["reason"]
    finally:
        end(fdm, dem)


@pytest.fixture
def launched(tmp_path, configs):
    """A long coupled run under the launcher, once steps are taken: (launcher, ids of both servers, run directory)."""
    out = tmp_path / "run"
    arguments = ["run", configs / "quick_slope.toml", "--out", out, "--quiet", *overrides(*LONG)]
    launcher = subprocess.Popen(command("colluvium.cli", *arguments), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    servers = []
    try:
        wait_for(lambda: coupled_frames(out / "dem.rank1.vtkhdf") > 3, 200, "coupled steps")
        servers = children_of(launcher.pid)
        assert len(servers) == 2
        yield launcher, servers, out
    finally:
        end(launcher)
        for pid in servers:
            if alive(pid):
                os.kill(pid, signal.SIGKILL)


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="reads /proc")
def test_no_orphan_is_left_when_the_launcher_dies(launched):
    launcher, servers, _ = launched
    launcher.kill()
    wait_for(lambda: not any(map(alive, servers)), 30, "the servers to end by themselves")
    assert [pid for pid in servers if alive(pid)] == []


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="reads /proc")
def test_ctrl_c_stops_both_sides_and_leaves_readable_files(launched):
    from colluvium import open_run

    launcher, servers, out = launched
    launcher.send_signal(signal.SIGINT)
    assert launcher.wait(40) == 130
    assert not any(map(alive, servers))
    with open_run(out) as run:
        last = run.frames[-1]
        assert last.stage in ("couple", "overload")
        assert np.isfinite(run.zones(-1).stress).all()
        own = [i for i in range(len(run.frames)) if run.has(i, 1)]  # the signal may come between the frames of both sides
        assert own[-1] >= len(run.frames) - 2
        assert np.isfinite(run.discs(own[-1]).xy).all()
    assert json.loads((out / "run.json").read_text())["exit_code"] == 130


def test_a_bad_scene_ends_the_run_before_anything_is_written(tmp_path, configs):
    text = (configs / "quick_slope.toml").read_text().replace("bulk", "bulc").replace("height = 12.0", "height = -12.0")
    bad = tmp_path / "bad.toml"
    bad.write_text(text)
    done = run_colluvium("run", bad, "--out", tmp_path / "run")
    assert done.returncode == 3
    line = next(i for i, row in enumerate(text.splitlines(), 1) if "bulc" in row)
    assert f"bad.toml:{line}: material[0].elastic.bulc: unknown key" in done.stderr
    assert 'did you mean "bulk"?' in done.stderr
    assert "grid.height" in done.stderr
    assert not (tmp_path / "run").exists()


def test_results_are_not_overwritten_without_force(tmp_path, configs, quick_run):
    """A finished run says so; a changed scene is refused with the keys that differ."""
    out, _ = quick_run
    before = {path.name: path.stat().st_mtime_ns for path in out.iterdir()}
    done = run_colluvium("run", configs / "quick_slope.toml", "--out", out)
    assert done.returncode == 0
    assert f"the run in {out} is finished (all stages done): nothing remains to be computed; --force computes" in done.stderr
    changed = ["--set", "seed=9", "--set", "stage.3.until.steps=7", "--set", "record.every=3"]
    done = run_colluvium("run", configs / "quick_slope.toml", "--out", out, *changed)
    assert done.returncode == 3
    assert "seed: 9 on this scene, 1 on" in done.stderr
    assert "stage.3.until.steps: 7 on this scene" in done.stderr
    assert "record.every" not in done.stderr
    assert {path.name: path.stat().st_mtime_ns for path in out.iterdir()} == before


@pytest.mark.parametrize("factor", ["1e40", pytest.param("1e300", marks=pytest.mark.long)])
def test_a_computation_that_blows_up_stops_both_sides_and_saves(tmp_path, configs, factor):
    out = tmp_path / "run"
    blow = overrides(f"stage.3.gravity_factor.to={factor}", "stage.3.gravity_factor.over=20")
    done = run_colluvium("run", configs / "quick_slope.toml", "--out", out, "--quiet", *blow)
    assert done.returncode == 6, done.stderr
    assert (out / "fdm.rank0.stopped.h5").exists()
    assert (out / "dem.rank1.stopped.h5").exists()
    assert json.loads((out / "run.json").read_text())["exit_code"] in (5, 6)  # 5: the discs noticed first
