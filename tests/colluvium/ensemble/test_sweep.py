"""Sweeps on workers of Dask: one that is killed, an interrupted sweep, a scheduler by itself and one that goes away."""

import csv
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from coupler_protocol import exits
from tests.commands import ROOT, command, finished
from tests.integration.short_runs import FILES, overrides, wait_for
from tests.same_bits import differing

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(not sys.platform.startswith("linux"), reason="reads /proc"),
]
VARY = "discs.soil.friction.coefficient=0.3,0.55"


def words(configs, out, *more):
    scene = configs / "quick_slope.toml"
    return command("colluvium.cli", "sweep", scene, *overrides(), "--of", "max_displacement", "--out", out, *more)


def servers_in(folder):
    """(process, parent) of every server that computes into a folder."""
    found = []
    for path in Path("/proc").glob("[0-9]*"):
        try:
            line = (path / "cmdline").read_bytes().decode().split("\0")
            parent = int((path / "stat").read_text().rpartition(")")[2].split()[1])
        except OSError:
            continue
        if any(part.startswith("--out=") and str(folder) in part for part in line):
            found.append((int(path.name), parent))
    return found


def points(out):
    with (out / "points.csv").open(newline="") as file:
        return list(csv.DictReader(file))


@pytest.fixture(scope="module")
def swept(tmp_path_factory, configs):
    """Folder of a sweep of four points, of which a worker was killed, and what was printed."""
    out = tmp_path_factory.mktemp("swept") / "sweep"
    sweep = subprocess.Popen(
        words(configs, out, "--vary", VARY, "--seeds", 2, "--workers", 2),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    wait_for(lambda: servers_in(out) or sweep.poll() is not None, 120.0, "the first server")
    os.kill(servers_in(out)[0][1], signal.SIGKILL)
    printed, said = sweep.communicate(timeout=280)
    assert sweep.returncode == exits.DONE, said
    return out, printed, said


def test_a_killed_worker_loses_no_point_and_leaves_no_process(swept):
    out, printed, _ = swept
    rows = points(out)
    assert [(row["discs.soil.friction.coefficient"], row["seed"]) for row in rows] == [
        (value, seed) for value in ("0.3", "0.55") for seed in ("1", "2")
    ]
    assert all(float(row["max_displacement"]) > 0.0 for row in rows)
    assert not any(row["why_not"] for row in rows)
    assert "max_displacement goes from" in printed
    wait_for(lambda: not servers_in(out), 60.0, "the end of all servers")


def test_a_point_that_branches_off_has_the_bits_of_its_own_run(swept, tmp_path, configs):
    """Points 2 to 4 take the grid's equilibrium from the first one."""
    out, _, _ = swept
    last = out / points(out)[3]["folder"]
    assert not (last / "fdm.rank0.equilibrium.h5").exists()
    alone = command(
        "colluvium.cli", "run", configs / "quick_slope.toml", *overrides("discs.soil.friction.coefficient=0.55", "seed=2")
    )
    done = finished([*alone, "--out", tmp_path / "alone", "--in-process", "--quiet"])
    assert done.returncode == 0, done.stderr
    for name in FILES[2:]:
        assert differing(tmp_path / "alone" / name, last / name) == []


def test_points_that_are_done_are_never_computed_again(swept, configs):
    out, printed, _ = swept
    before = {path: path.stat().st_mtime_ns for path in out.rglob("*.vtkhdf")}
    again = finished(words(configs, out, "--vary", VARY, "--seeds", 2))
    assert again.returncode == exits.DONE, again.stderr
    assert again.stdout == printed
    assert "4 of 4 points are known" in again.stderr
    assert {path: path.stat().st_mtime_ns for path in before} == before


def test_an_interrupted_sweep_on_its_own_scheduler_goes_on_with_another_one(tmp_path, configs):
    """Ctrl-C ends the points, which save their State; then the scheduler is killed, and one more sweep ends what is left."""
    out, own = tmp_path / "sweep", ("--vary", VARY, "--cluster", tmp_path / "scheduler.json")
    cluster = started(tmp_path)
    try:
        sweep = subprocess.Popen(words(configs, out, *own), stderr=subprocess.PIPE, text=True)
        wait_for(lambda: servers_in(out), 120.0, "the first server")
        sweep.send_signal(signal.SIGINT)
        assert "the same command continues" in sweep.communicate(timeout=120)[1]
        assert sweep.returncode == exits.INTERRUPTED
        wait_for(lambda: not servers_in(out), 60.0, "the end of all servers")
        sweep = subprocess.Popen(words(configs, out, *own), stderr=subprocess.PIPE, text=True)
        wait_for(lambda: servers_in(out), 120.0, "the first server")
        cluster[0].kill()
        said = sweep.communicate(timeout=120)[1]
        assert "the scheduler is gone" in said
        assert sweep.returncode == exits.ENVIRONMENT
    finally:
        ended(cluster)
    (tmp_path / "scheduler.json").unlink()
    cluster = started(tmp_path)
    try:
        done = finished(words(configs, out, *own))
        assert done.returncode == exits.DONE, done.stderr
        assert [bool(row["max_displacement"]) for row in points(out)] == [True, True]
    finally:
        ended(cluster)
    wait_for(lambda: not servers_in(out), 60.0, "the end of all servers")


def started(folder):
    """A scheduler and two workers, as in three shells."""
    file, dask = folder / "scheduler.json", [sys.executable, "-m", "dask"]
    options = {"cwd": ROOT, "stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    scheduler = [*dask, "scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--scheduler-file", file]
    worker = [*dask, "worker", "--host", "127.0.0.1", "--nthreads", "1", "--no-dashboard", "--scheduler-file", file]
    worker += ["--local-directory", folder, "--death-timeout", "20"]
    return [subprocess.Popen([*map(str, line)], **options) for line in (scheduler, worker, worker)]


def ended(processes):
    for process in processes:
        process.terminate()
    until = time.monotonic() + 30.0
    for process in processes:
        try:
            process.wait(max(0.1, until - time.monotonic()))
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
