"""scripts/count_instructions.py: the parts of the last stage are that stage, and counts of callgrind are read as such."""

import os
import shutil
import subprocess
import sys
import tomllib

import pytest
from bench import counted_server
from count_instructions import SETTLED, counted_scene, counts_in

from coupler_protocol.scene.reader import build_scene

LOOP = """
import sys
sys.path.insert(0, {folder!r})
import counted_server as server
ask = server.asker()
for name, turns in (("counted short", 1000), ("counted long", 3000)):
    ask(server.START)
    for _ in range(turns):
        pass
    ask(server.DUMP_AT, name.encode())
    ask(server.STOP)
"""


@pytest.fixture
def scene(configs):
    return tomllib.loads((configs / "paper_slope.toml").read_text(encoding="utf-8"))


def test_the_parts_take_the_steps_of_the_last_stage_under_its_gravity(scene):
    """12 g over 40,000 steps: 2.375 g after 5,000 steps, on the same straight line at the end of every part."""
    stages = counted_scene(scene, 5000, 100)["stage"]
    assert stages[:-5] == scene["stage"][:-1]
    begun, *_ = parts = stages[-5:]
    assert [part["until"]["steps"] for part in parts] == [5000, SETTLED, 100, 500, 1]
    reached = 0
    for part in parts:
        reached += part["until"]["steps"]
        assert part["gravity_factor"]["to"] == pytest.approx(1.0 + 11.0 * reached / 40_000, rel=1e-12)
        assert part["gravity_factor"]["over"] == part["until"]["steps"]
        assert part["large_strain"]
    assert begun["gravity_factor"]["to"] == pytest.approx(2.375)


def test_the_scene_is_read(scene):
    read = build_scene(counted_scene(scene, 5000, 100))
    assert [stage.kind for stage in read.stage[-5:]] == ["overload"] * 5
    assert read.record.every > 10_000


def test_counts_are_read_by_stage(tmp_path):
    for number, (text, total) in enumerate((("Client Request: counted short", 12), ("Client Request: counted long", 30))):
        (tmp_path / f"grid.{number + 1}").write_text(f"desc: Trigger: {text}\nevents: Ir\nsummary: 7\n1 5\ntotals: {total}\n")
    (tmp_path / "grid").write_text("desc: Trigger: Program termination\ntotals: 99\n")
    (tmp_path / "discs.1").write_text("desc: Trigger: Client Request: counted short\ntotals: 5\n")
    assert counts_in(tmp_path, "grid") == {"counted short": 12, "counted long": 30}


def test_without_valgrind_a_request_does_nothing():
    ask = counted_server.asker()
    assert [ask(counted_server.START), ask(counted_server.DUMP_AT, b"a"), ask(counted_server.STOP)] == [0, 0, 0]


@pytest.mark.trial
@pytest.mark.long
@pytest.mark.skipif(shutil.which("valgrind") is None, reason="valgrind is not installed")
def test_three_times_the_turns_are_three_times_the_instructions(tmp_path):
    """Beside what a start and an end cost once, which is the same for both."""
    program = LOOP.format(folder=os.path.dirname(counted_server.__file__))
    words = ["valgrind", "--tool=callgrind", "--instr-atstart=no", "--quiet", f"--callgrind-out-file={tmp_path / 'grid'}"]
    subprocess.run([*words, sys.executable, "-c", program], check=True, timeout=120)
    counts = counts_in(tmp_path, "grid")
    turn = (counts["counted long"] - counts["counted short"]) / 2000
    assert 20 < turn < 2000
    assert abs(counts["counted short"] - 1000 * turn) < 50_000
