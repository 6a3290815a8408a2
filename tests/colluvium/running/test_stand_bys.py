"""Servers that stand by compute the same as servers that are started with their arguments, and none of them is left."""

import queue
import subprocess

import pytest

from colluvium.running.processes import Process
from colluvium.running.stand_bys import StandBys, expected, start
from coupler_protocol import exits
from coupler_protocol.process import stand_by
from tests.commands import ROOT, run_colluvium


@pytest.mark.parametrize(
    ("name", "servers"),
    [("quick_slope", ["fdm_server", "dem_server"]), ("quick_pile", ["dem_server"]), ("footing", ["fdm_server"])],
)
def test_a_scene_file_tells_which_servers_it_needs(name, servers):
    assert expected(ROOT / "configs" / f"{name}.toml") == servers


def test_a_file_that_is_no_scene_needs_none(tmp_path):
    (tmp_path / "latin.toml").write_bytes(b"title = '\xe9'\n")
    assert expected(tmp_path / "latin.toml") == expected(tmp_path / "absent.toml") == expected(tmp_path) == []


def test_a_server_that_stands_by_ends_without_a_word_if_no_order_comes():
    server = start("fdm_server", [stand_by.OPTION])
    out, errors = server.communicate(timeout=60)
    assert (server.returncode, out, errors) == (exits.DONE, "", "")


def test_an_order_reaches_the_server_that_stands_by_once_and_its_answer_is_that_of_any_server(tmp_path):
    absent = str(tmp_path / "absent.toml")
    with StandBys(["dem_server"]) as ahead:
        standing = ahead._waiting["dem_server"]
        rows = queue.Queue()
        processes = [Process("discs", ["dem_server", absent, f"--out={tmp_path}"], rows, ahead) for _ in range(2)]
    codes = [process.end(60.0) for process in processes]
    assert (processes[0].popen, codes) == (standing, [exits.SCENE] * 2)
    assert processes[0].errors == processes[1].errors
    assert "there is no such file" in "".join(processes[0].errors)


def test_servers_without_an_order_are_gone_with_their_launcher_s_block():
    with StandBys(["fdm_server", "dem_server"]) as ahead:
        servers = list(ahead._waiting.values())
    assert all(server.poll() is not None for server in servers)


def test_a_server_that_has_failed_is_replaced(tmp_path):
    with StandBys(["dem_server"]) as ahead:
        failed = ahead._waiting["dem_server"]
        failed.kill()
        failed.wait()
        assert ahead.order("dem_server", ["scene.toml"]) is None


def test_a_refused_scene_leaves_no_server(tmp_path, monkeypatch):
    started = []

    def noted(*arguments, **options):
        started.append(popen(*arguments, **options))
        return started[-1]

    popen = subprocess.Popen
    monkeypatch.setattr("colluvium.running.stand_bys.subprocess.Popen", noted)
    (tmp_path / "scene.toml").write_text("[grid]\n[[window]]\n", encoding="utf-8")
    done = run_colluvium("run", tmp_path / "scene.toml", "--out", tmp_path / "run")
    assert (done.returncode, len(started)) == (exits.SCENE, 2)
    assert all(server.poll() is not None for server in started)
    assert not (tmp_path / "run").exists()
