"""Several windows, each its own process, discs and stones, in one lock-step: the same bits in any order and any processes."""

import subprocess
import threading
from contextlib import contextmanager

import numpy as np
import pytest

from colluvium import open_run, report, status
from colluvium.closing import sentences
from colluvium.results import export
from colluvium.running import threads
from colluvium.running.processes import as_toml
from coupler_protocol import exits
from coupler_protocol.scene.reader import build_scene
from coupler_protocol.wire import handshake
from dem_server.procedure import window_side
from tests.commands import command
from tests.integration.kills import DiscreteSide, goes_on, kill_where, killed_run
from tests.integration.same_runs import assert_same_runs
from tests.integration.short_runs import coupled_frames, end, wait_for
from tests.window_scenes import THREE, three_windows

RANKS = {name: rank for rank, name in enumerate(THREE, start=1)}


def tables(windows=3):
    """Tables of the scene of three windows, or of the first ones of them, with checkpoints inside of stages."""
    data = three_windows()
    data["window"] = data["window"][:windows]
    data["record"] |= {"checkpoint_steps": 25, "checkpoint": 0.0}
    return data


@pytest.fixture(scope="module")
def straight(tmp_path_factory):
    """straight(windows) -> folder of the undisturbed run in this process; each is computed once."""
    found = {}

    def run(windows=3):
        if windows not in found:
            found[windows] = tmp_path_factory.mktemp(f"{windows}")
            threads.run(build_scene(tables(windows)), found[windows])
        return found[windows]

    return run


@contextmanager
def arriving(order):
    """Discrete processes say HELLO in this order of ranks, each after the one before was admitted."""
    come, changed = [], threading.Condition()
    note, join = handshake.Arrivals.note, window_side.join

    def noted(self, rank):
        note(self, rank)
        with changed:
            come.append(rank)
            changed.notify_all()

    def in_turn(conversation, *words):
        before = order[: order.index(conversation.rank)]
        with changed:
            assert changed.wait_for(lambda: set(before) <= set(come), 100.0)
        return join(conversation, *words)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(handshake.Arrivals, "note", noted)
        patch.setattr(window_side, "join", in_turn)
        yield come


def test_each_window_has_its_own_discs_stones_and_file(straight):
    with open_run(straight()) as run:
        assert [window["name"] for window in run.info["windows"]] == list(THREE)
        assert run.windows == [1, 2, 3]
        radius = {name: run.discs(-1, rank).radius for name, rank in RANKS.items()}
        free = {name: values[run.discs(-1, RANKS[name]).control == 0] for name, values in radius.items()}
        for name, mean in (("stiff", 0.08), ("stony", 0.06), ("loose", 0.08)):
            assert free[name].mean() == pytest.approx(mean, rel=0.05), name
        assert [bool(run.stones(rank)) for rank in run.windows] == [False, True, False]
        assert ["bond_state" in run.contacts(-1, rank) for rank in run.windows] == [True, True, False]


@pytest.mark.long
def test_two_and_three_windows_carry_the_stress_of_the_ground(straight):
    """Uniform stress passes all windows: each takes over that of its zones, within the granularity of so few discs."""
    for windows in (2, 3):
        with open_run(straight(windows)) as run:
            reports = run.info["windows"]
            assert len(reports) == len(run.windows) == windows
            assert all(report["error_yy"] < 0.35 for report in reports)
            assert all(np.isfinite(run.discs(-1, rank).xy).all() for rank in run.windows)


def test_the_end_of_a_run_and_its_status_name_all_windows(straight):
    with open_run(straight()) as run:
        said = " ".join(sentences(run.info))
        assert [run.name_of(rank) for rank in run.windows] == list(THREE)
        assert [run.stones_table(rank).get("content") for rank in run.windows] == [None, 0.2, None]
    assert all(f"window {name}" in said or f"window {name!r}" in said for name in THREE), said
    text = "\n".join(status.lines(straight(), status.of_folder(straight())))
    assert all(f"{name} on" in text for name in ("fdm.rank0", "dem.rank1", "dem.rank2", "dem.rank3"))


def test_an_export_has_the_parts_of_all_windows(tmp_path, straight):
    written = {path.name for form in ("vtu", "csv") for path in export.write_folder(straight(), form, out=tmp_path)}
    with open_run(straight()) as run:
        last = len(run.frames) - 1
        for rank in run.windows:
            files = {f"{part}.rank{rank}.{last}.{form}" for part in ("discs", "contacts") for form in ("vtu", "csv")}
            assert files | {f"histories.rank{rank}.csv"} <= written
            free = int((run.discs(-1, rank).control == 0).sum())
            assert export.write(straight(), rank=rank, out=tmp_path / f"{rank}.csv") == free


@pytest.mark.long
def test_a_report_has_pictures_of_all_windows(tmp_path, straight):
    """Figures of one window are drawn for each; those of an earlier report of one window are removed."""
    for name in ("window.png", "fabric.rank4.png"):
        (tmp_path / name).touch()
    skipped = {}
    written = {path.name for path in report.write(straight(), tmp_path, skipped=skipped.__setitem__)}
    for name in ("window", "force_chains", "displacement_vectors", "fabric"):
        assert {f"{name}.rank{rank}.png" for rank in (1, 2, 3)} <= written | set(skipped), name
    assert "mesostructure.rank2.png" in written
    assert skipped["mesostructure.rank1.png"] == "no stones"
    assert {path.name for path in tmp_path.iterdir()} == written


@pytest.mark.parametrize("order", [(3, 1, 2), pytest.param((2, 3, 1), marks=pytest.mark.long)])
def test_the_order_of_arrival_does_not_change_a_bit(tmp_path, straight, order):
    with arriving(order) as come:
        threads.run(build_scene(tables()), tmp_path)
    assert tuple(come) == order
    assert_same_runs(straight(), tmp_path)


@pytest.mark.long
@pytest.mark.parametrize("rank", [2, 3])
def test_a_run_goes_on_after_one_of_its_windows_was_killed(tmp_path, straight, rank):
    killed_run(build_scene(tables()), tmp_path / "run", kill_where(DiscreteSide, "record", of_rank(rank, 90)))
    with arriving((3, 2, 1)):
        goes_on(build_scene(tables()), tmp_path / "run")
    assert_same_runs(straight(), tmp_path / "run")


def of_rank(rank, step):
    """Condition of the window of `rank` from this step on."""
    return lambda side, *words: side.rank == rank and side.steps >= step


@pytest.mark.trial
@pytest.mark.long
def test_processes_in_three_folders_have_the_bits_of_one_and_a_killed_one_ends_the_others(tmp_path, straight):
    """The last rank is started first. The others name the window that was lost; the same commands then end the run."""
    scene = tmp_path / "scene.toml"
    scene.write_text(as_toml(tables()), encoding="utf-8")
    servers = started(scene, tmp_path, ["--set", "link.give_up=3.0", "--set", "link.timeout=1.0"])
    try:
        wait_for(lambda: coupled_frames(tmp_path / "2" / "dem.rank2.vtkhdf") > 1, 200, "coupled steps")
        servers[2].kill()
        codes = {rank: server.wait(100) for rank, server in servers.items() if rank != 2}
        said = {rank: server.communicate()[1] for rank, server in servers.items()}
    finally:
        end(*servers.values())
    if servers[2].returncode < 0 and set(codes.values()) != {exits.DONE}:  # not killed after its last step
        assert codes == dict.fromkeys((0, 1, 3), exits.PEER)
        assert all("rank 2 was lost" in said[rank] for rank in codes), said
    servers = started(scene, tmp_path, [])
    try:
        assert {server.wait(200) for server in servers.values()} == {exits.DONE}
    finally:
        end(*servers.values())
    together = tmp_path / "all"
    together.mkdir()
    for rank in (3, 2, 1, 0):
        for path in (tmp_path / str(rank)).iterdir():
            (together / path.name).write_bytes(path.read_bytes())
    assert_same_runs(straight(), together)


def started(scene, folder, more):
    """The four servers by rank, each with its own folder, rank 3 first."""
    options = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    found = {}
    for rank in (3, 1, 0, 2):
        words = ["--quiet", "--out", folder / str(rank), *more]
        if rank:
            words = ["dem_server", scene, "--connect", folder / "0" / "endpoint", "--rank", rank, *words]
        else:
            words = ["fdm_server", scene, "--bind", "tcp://127.0.0.1:0", *words]
        found[rank] = subprocess.Popen(command(*words), **options)
    return found
