"""Two processes over TCP give the bits of one process, and neither outlives the other for long."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import h5py
import numpy as np
import pytest

from tests.conftest import command

SHORT = (
    "stage.0.until.steps=400",
    "stage.2.handover=100",
    "stage.2.until.steps=200",
    "stage.3.gravity_factor.over=100",
    "stage.3.until.steps=150",
    "record.every=50",
    "link.give_up=3.0",
    "link.timeout=1.0",
)
FILES = ("fdm.rank0.vtkhdf", "dem.rank1.vtkhdf", "fdm.rank0.overload.h5", "dem.rank1.overload.h5")


def overrides(*more):
    return [word for pair in (*SHORT, *more) for word in ("--set", pair)]


def bits(data):
    """Bits of a data set; an empty one (an effect that is absent) has none."""
    value = data[()]
    return b"" if isinstance(value, h5py.Empty) else value.tobytes()


def differing(a, b):
    """Names of data sets that are not the same bits in two HDF5 files."""
    names = []
    with h5py.File(a) as fa, h5py.File(b) as fb:

        def collect(name, item):
            if isinstance(item, h5py.Dataset):
                other = fb.get(name)
                if other is None or other.shape != item.shape or bits(other) != bits(item):
                    names.append(name)

        fa.visititems(collect)
        mine, theirs = [], []
        fa.visit(mine.append)
        fb.visit(theirs.append)
    return names + sorted(set(mine) ^ set(theirs))


def start_servers(scene, fdm_out, dem_out, *more):
    """Both servers by hand, as in two shells."""
    options = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    extra = overrides(*more)
    fdm = subprocess.Popen(
        command("fdm_server", scene, "--bind", "tcp://127.0.0.1:0", "--out", fdm_out, "--quiet", *extra), **options
    )
    dem = subprocess.Popen(
        command("dem_server", scene, "--connect", fdm_out / "endpoint", "--rank", 1, "--out", dem_out, "--quiet", *extra),
        **options,
    )
    return fdm, dem


def wait_for(condition, seconds, what):
    """Wait until condition() holds."""
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline, f"waited {seconds} s for {what}"
        time.sleep(0.05)


def coupled_frames(path):
    """Frames a discrete process has written so far."""
    try:
        with h5py.File(path, "r", locking=False) as file:
            return int(file["VTKHDF/Steps"].attrs["NSteps"])
    except (OSError, KeyError):
        return 0


def end(*processes):
    for process in processes:
        if process.poll() is None:
            process.kill()
        process.communicate()


@pytest.fixture(scope="module")
def twin(tmp_path_factory, configs):
    """The short run in one process."""
    out = tmp_path_factory.mktemp("twin")
    scene = configs / "quick_slope.toml"
    arguments = ["run", scene, "--out", out, "--force", "--in-process", "--quiet", *overrides()]
    done = subprocess.run(command("colluvium.cli", *arguments), capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    return out


def test_servers_started_by_hand_equal_the_in_process_twin_bit_for_bit(tmp_path, configs, twin):
    fdm, dem = start_servers(configs / "quick_slope.toml", tmp_path / "a", tmp_path / "b")
    try:
        assert fdm.wait(300) == 0, fdm.stderr.read()
        assert dem.wait(30) == 0, dem.stderr.read()
    finally:
        end(fdm, dem)
    for name in FILES:
        there = tmp_path / ("a" if name.startswith("fdm") else "b") / name
        assert differing(there, twin / name) == [], name


def test_launched_run_equals_the_in_process_twin_bit_for_bit(tmp_path, configs, twin):
    arguments = ["run", configs / "quick_slope.toml", "--out", tmp_path / "run", "--quiet", *overrides()]
    done = subprocess.run(command("colluvium.cli", *arguments), capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    for name in FILES:
        assert differing(tmp_path / "run" / name, twin / name) == [], name


STONES = (
    "discs.radius=0.045",
    "stones={content=0.4,size={mean=0.25,sigma=0.35,min=0.15,max=0.6},gap=0.02}",
    "discs.stone={density=2700.0,spring={normal=5e8,shear=5e8},friction={coefficient=1.0},bond={tension=1e6,shear=1e6}}",
)


@pytest.mark.parametrize("body", ["clump", "cluster"])
def test_stones_are_the_same_bits_in_one_process_and_two(tmp_path, configs, body):
    words = ["run", configs / "quick_slope.toml", "--quiet", *overrides(*STONES, f"stones.body={body}")]
    for more in (["--out", tmp_path / "two"], ["--out", tmp_path / "one", "--in-process"]):
        done = subprocess.run(command("colluvium.cli", *words, *more), capture_output=True, text=True, timeout=300)
        assert done.returncode == 0, done.stderr
    for name in FILES:
        assert differing(tmp_path / "one" / name, tmp_path / "two" / name) == [], name
    with h5py.File(tmp_path / "one" / FILES[1]) as file:
        assert file["Constants/stone_start"][-1] == len(file["Constants/stone_corners"])
        assert ("centroid" in file["VTKHDF/PointData"]) == (body == "clump")
    window = json.loads((tmp_path / "one" / "run.json").read_text())["windows"][0]
    assert window["stone_content"] == pytest.approx(0.4, rel=1e-12)
    assert window["stone_content_discs"] == pytest.approx(0.4, abs=0.05)


def test_another_seed_gives_other_bits(tmp_path, configs, twin):
    arguments = ["run", configs / "quick_slope.toml", "--out", tmp_path / "run", "--quiet", *overrides("seed=2")]
    done = subprocess.run(command("colluvium.cli", *arguments), capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    assert differing(tmp_path / "run" / FILES[1], twin / FILES[1])


LONG = ("stage.3.until.steps=10000000", "stage.3.until.ratio=1e-12")


@pytest.mark.parametrize("victim", ["discs", "grid"])
def test_a_killed_peer_ends_the_other_side_with_a_clear_message(tmp_path, configs, victim):
    fdm, dem = start_servers(configs / "quick_slope.toml", tmp_path / "a", tmp_path / "b", *LONG)
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


def children_of(pid):
    """Process ids of the children of a process, from /proc."""
    found = []
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                status = (entry / "stat").read_text().rpartition(")")[2].split()
            except OSError:
                continue
            if int(status[1]) == pid:
                found.append(int(entry.name))
    return found


def alive(pid):
    try:
        return (Path("/proc") / str(pid) / "stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


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
        assert np.isfinite(run.discs(-1).xy).all()
    assert json.loads((out / "run.json").read_text())["exit_code"] == 130


def test_servers_of_another_tree_in_the_current_folder_are_not_taken(tmp_path, configs):
    """The launcher starts the servers of its own installation, wherever it is called."""
    for name in ("fdm_server", "dem_server"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "__init__.py").write_text("raise SystemExit(99)\n")
    words = [sys.executable, "-P", "-m", "colluvium.cli", "run", configs / "quick_slope.toml", "--out", tmp_path / "run"]
    done = subprocess.run([*map(str, words), *overrides(), "--quiet"], cwd=tmp_path, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr


def test_a_bad_scene_ends_the_run_before_anything_is_written(tmp_path, configs):
    text = (configs / "quick_slope.toml").read_text().replace("bulk", "bulc").replace("height = 12.0", "height = -12.0")
    bad = tmp_path / "bad.toml"
    bad.write_text(text)
    done = subprocess.run(
        command("colluvium.cli", "run", bad, "--out", tmp_path / "run"), capture_output=True, text=True, timeout=60
    )
    assert done.returncode == 3
    line = next(i for i, row in enumerate(text.splitlines(), 1) if "bulc" in row)
    assert f"bad.toml:{line}: material[0].elastic.bulc: unknown key" in done.stderr
    assert 'did you mean "bulk"?' in done.stderr
    assert "grid.height" in done.stderr
    assert not (tmp_path / "run").exists()


def test_results_are_not_overwritten_without_force(tmp_path, configs, quick_run):
    out, _ = quick_run
    before = (out / "run.json").read_bytes()
    done = subprocess.run(
        command("colluvium.cli", "run", configs / "quick_slope.toml", "--out", out), capture_output=True, text=True, timeout=60
    )
    assert done.returncode == 4
    assert "--force" in done.stderr
    assert (out / "run.json").read_bytes() == before


@pytest.mark.parametrize("factor", ["1e40", "1e300"])
def test_a_computation_that_blows_up_stops_both_sides_and_saves(tmp_path, configs, factor):
    out = tmp_path / "run"
    blow = overrides(f"stage.3.gravity_factor.to={factor}", "stage.3.gravity_factor.over=20")
    done = subprocess.run(
        command("colluvium.cli", "run", configs / "quick_slope.toml", "--out", out, "--quiet", *blow),
        capture_output=True,
        text=True,
        timeout=200,
    )
    assert done.returncode == 6, done.stderr
    assert (out / "fdm.rank0.stopped.h5").exists()
    assert (out / "dem.rank1.stopped.h5").exists()
    assert json.loads((out / "run.json").read_text())["exit_code"] in (5, 6)  # 5: the discs noticed first
