"""A stage that should rest and does not is told; broken files of a run are refused in words; signals stop runs in scripts."""

import json
import os
import signal
import subprocess
import sys

import pytest

from coupler_protocol.files.run_json import misfits
from tests.commands import command, run_colluvium
from tests.integration.short_runs import wait_for
from tests.small_grounds import BOX

STAGES = """
[[stage]]
name = "rest"
kind = "equilibrium"
gravity = 9.81
until = { ratio = 1e-5, steps = 2000 }
[[stage]]
name = "load"
kind = "load"
until = { steps = 200 }
"""


@pytest.fixture
def scene(tmp_path):
    path = tmp_path / "box.toml"
    path.write_text(BOX + STAGES, encoding="utf-8")
    return path


def colluvium(*words):
    return run_colluvium(*words, "--quiet")


@pytest.mark.parametrize("processes", ["one", pytest.param("two", marks=pytest.mark.long)])
def test_a_stage_that_ends_in_motion_is_told_and_strict_gives_it_a_code(tmp_path, scene, processes):
    mode = ["--in-process"] if processes == "one" else []
    cut = ["--set", "stage.rest.until.steps=40"]
    done = colluvium("run", scene, "--out", tmp_path / "a", *mode, *cut)
    assert done.returncode == 0, done.stderr
    info = json.loads((tmp_path / "a" / "run.json").read_text())
    (warning,) = info["warnings"]
    assert (warning["stage"], warning["step"], warning["name"]) == ("rest", 40, "not at rest")
    assert "ended after 40 steps at a ratio of " in warning["text"]
    assert "warning: in step 40 of stage rest: not at rest: the stage ended after 40 steps" in done.stdout.replace("\n", " ")
    assert misfits(info) == []
    done = colluvium("run", scene, "--out", tmp_path / "b", "--strict", *mode, *cut)
    assert done.returncode == 8, done.stderr
    info = json.loads((tmp_path / "b" / "run.json").read_text())
    assert (info["exit_code"], info["reason"]) == (8, "all stages done, but not at rest at the end: rest")
    done = colluvium("run", scene, "--out", tmp_path / "c", "--strict", *mode)
    assert done.returncode == 0, done.stderr
    assert "warnings" not in json.loads((tmp_path / "c" / "run.json").read_text())


def test_discs_alone_are_told_too_and_keep_it_when_they_are_resumed(tmp_path):
    (tmp_path / "row.csv").write_text("x,y,radius\n0,0.3,0.1\n0.5,0.3,0.1\n", encoding="utf-8")
    (tmp_path / "discs.toml").write_text(
        'format = 1\nseed = 1\n[discs]\nradius = 0.1\nfile = "row.csv"\n'
        "soil = { density = 2000.0, spring = { normal = 1e7, shear = 1e7 } }\n"
        '[[discs.wall]]\nends = [[-1.0, 0.0], [2.0, 0.0]]\n[[stage]]\nname = "fill"\n'
        '[[stage]]\nname = "fall"\nkind = "discs"\ngravity = 9.81\nuntil = { steps = 5 }\n'
        '[[stage]]\nname = "more"\nkind = "discs"\nuntil = { ratio = 1e-4, steps = 10 }\n',
        encoding="utf-8",
    )
    done = colluvium("run", tmp_path / "discs.toml", "--out", tmp_path / "a", "--strict", "--in-process")
    assert done.returncode == 8, done.stderr
    whole = json.loads((tmp_path / "a" / "run.json").read_text())
    assert [warning["stage"] for warning in whole["warnings"]] == ["fall", "more"]
    (tmp_path / "a" / "dem.rank1.more.h5").unlink()
    done = run_colluvium("resume", "a", "--quiet", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    again = json.loads((tmp_path / "a" / "run.json").read_text())
    assert again["warnings"] == whole["warnings"]
    assert [row["name"] for row in again["stages"]] == ["fill", "fall", "more"]
    assert again["windows"][0]["discs"] == 2


def test_a_byte_order_mark_and_a_json_scene_are_computed_as_any_other(tmp_path, scene):
    assert colluvium("run", "--in-process", scene, "--out", tmp_path / "a", "--set", "seed=3").returncode == 0
    marked = tmp_path / "bom.toml"
    marked.write_bytes(b"\xef\xbb\xbf" + scene.read_bytes())
    assert colluvium("run", "--in-process", marked, "--out", tmp_path / "b", "--set", "seed=3").returncode == 0
    done = colluvium(
        "run", "--in-process", tmp_path / "a" / "scene.json", "--out", tmp_path / "c", "--set", "seed=3", "--set", "title=x"
    )
    assert done.returncode == 0, done.stderr
    found = [json.loads((tmp_path / name / "scene.json").read_text()) for name in "abc"]
    assert found[0] == found[1]
    assert found[2] == found[0] | {"title": "x"}


def test_broken_files_of_a_run_are_refused_in_words(tmp_path, scene):
    out = tmp_path / "a"
    assert colluvium("run", "--in-process", scene, "--out", out).returncode == 0
    (out / "fdm.rank0.load.h5").unlink()
    whole = (out / "run.json").read_text()
    for broken in (whole[: len(whole) // 2], "[1]", "\xff\xfe"):
        (out / "run.json").write_text(broken, encoding="latin-1")
        for words in (["status", out], ["report", out], ["resume", out]):
            done = run_colluvium(*words)
            assert done.returncode == 4, (words, done.stderr)
            assert f"{out / 'run.json'} is " in done.stderr
            assert "Traceback" not in done.stderr
            assert done.stderr.count("run.json is ") == 1
    (out / "run.json").unlink()
    text = (out / "scene.json").read_text()
    (out / "scene.json").write_text(text[:-20])
    done = colluvium("resume", "--in-process", out)
    assert done.returncode == 3
    assert "scene.json:" in done.stderr
    assert "not valid JSON" in done.stderr
    (out / "scene.json").write_text(text)
    assert colluvium("resume", "--in-process", out).returncode == 0


def test_a_scene_is_not_removed_with_the_results_it_lies_among(tmp_path, scene):
    out = tmp_path / "a"
    assert colluvium("run", "--in-process", scene, "--out", out).returncode == 0
    for name in ("scene.json", "scene.toml"):
        done = colluvium("run", "--in-process", out / name, "--out", out, "--force")
        assert done.returncode == 4
        assert "belongs to the run in" in done.stderr
        assert (out / name).exists()


def test_a_folder_may_have_a_name_like_an_option(tmp_path, scene):
    done = run_colluvium("run", scene, "--out=-odd", "--quiet", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "-odd" / "run.json").exists()


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="signals of a shell")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_run_in_the_background_of_a_script_stops_with_its_state_saved(tmp_path, scene, number):
    """A shell without job control starts such commands with SIGINT ignored; other signals may be ignored where the tests run."""

    def as_a_shell():
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        if number != signal.SIGINT:
            signal.signal(number, signal.SIG_DFL)

    out = tmp_path / "run"
    endless = ["--set", "stage.rest.until.steps=100000000", "--set", "stage.rest.until.ratio=1e-30"]
    words = command("colluvium.cli", "run", scene, "--out", out, "--quiet", *endless)
    process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, preexec_fn=as_a_shell)
    try:
        wait_for((out / "fdm.rank0.vtkhdf").exists, 120, "the first frame")
        os.kill(process.pid, number)
        assert process.wait(60) == 130
    finally:
        process.kill()
        process.communicate()
    assert not (out / "fdm.rank0.stopped.h5").exists()
    info = json.loads((out / "run.json").read_text())
    assert info["exit_code"] == 130
    (path,) = out.glob("fdm.rank0.rest@*.h5")
    assert path.name == f"fdm.rank0.rest@{info['steps']}.h5"  # nothing is lost
