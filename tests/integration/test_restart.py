"""Going on from the end of a stage gives the bits of the straight run, in one process and in two."""

import contextlib
import json
import os
import shutil
import signal
import subprocess
import sys

import h5py
import numpy as np
import pytest

import colluvium
from colluvium import closing, open_run, resume
from coupler_protocol.exits import FinishedBefore
from coupler_protocol.files import checkpoint
from coupler_protocol.scene.reader import build_scene
from tests.commands import command, finished, run_colluvium
from tests.integration.short_runs import SHORT, STONES, children_of, coupled_frames, overrides, wait_for
from tests.same_bits import differing

STAGES = ("equilibrium", "fill", "couple", "overload")
SIDES = ("fdm.rank0", "dem.rank1")
CHANGES = (  # of laws, sides and records from the last stages on
    "stage.2.boundary=[{ on = 'top', pressure = 1e3, over = 20 }]",
    "stage.3.material=[{ name = 'soil-rock mixture', mohr_coulomb = { cohesion = 40e3 }, elastic = { young = 300e6 } }]",
    "stage.3.discs={ soil = { friction = { coefficient = 0.4 }, spring = { normal = 60e6 } }, damping = { local = 0.5 } }",
    "stage.3.record={ every = 40, history = 5 }",
)
LARGE = ("grid.large_strain=true", "grid.mixed=nodal", *STONES, *CHANGES)


def quietly(*words):
    """The process of `colluvium WORDS --quiet` once it has ended."""
    return run_colluvium(*words, "--quiet")


@pytest.fixture(scope="module")
def scene(configs):
    return configs / "quick_slope.toml"


@pytest.fixture
def straight(short_run):
    """The short run without a stop, in small strain."""
    return short_run


@pytest.fixture(scope="module")
def straight_large(tmp_path_factory, scene):
    """The same in large strain, with stones, and with changes by stage."""
    out = tmp_path_factory.mktemp("large")
    done = quietly("run", scene, "--out", out, "--force", "--in-process", *overrides(*LARGE))
    assert done.returncode == 0, done.stderr
    return out


def assert_equal_runs(a, b, first):
    """All frames from the stage number `first` on are the same bits in both runs, for both sides, and so are the histories."""
    with open_run(a) as one, open_run(b) as two:
        later = [[i for i, frame in enumerate(run.frames) if frame.stage in STAGES[first:]] for run in (one, two)]
        assert [one.frames[i] for i in later[0]] == [two.frames[i] for i in later[1]]
        for i, j in zip(*later, strict=True):
            assert set(one._rows[i]) == set(two._rows[j])
            pairs = [(one.gridpoints(i), two.gridpoints(j)), (one.zones(i), two.zones(j))] if one.has(i, 0) else []
            pairs += [(one.discs(i), two.discs(j)), (one.contacts(i), two.contacts(j))] if one.has(i, 1) else []
            for x, y in pairs:
                assert x.names == y.names
                assert [name for name in x.names if x[name].tobytes() != y[name].tobytes()] == []
        begin = one.frames[later[0][0]].step if first else 0
        for rank in (0, 1):
            for name in one.files[rank].history_names():
                (steps, values), (other_steps, other) = one.history(name, rank), two.history(name, rank)
                late = steps > begin
                np.testing.assert_array_equal(steps[late], other_steps[other_steps > begin])
                assert values[late].tobytes() == other[other_steps > begin].tobytes()


IN_TWO = [pytest.param(stage, "two", marks=[] if stage == "couple" else pytest.mark.long) for stage in STAGES[:-1]]


@pytest.mark.parametrize(("stage", "processes"), [*((stage, "one") for stage in STAGES[:-1]), *IN_TWO])
def test_a_branch_without_changes_equals_the_straight_run_bit_for_bit(tmp_path, scene, straight, stage, processes):
    mode = ["--in-process"] if processes == "one" else []
    branch(tmp_path / "run", scene, straight, stage, *mode, *overrides())


@pytest.mark.parametrize("stage", STAGES[1:-1])
def test_so_does_one_with_stones_in_large_strain_and_changes_by_stage(tmp_path, scene, straight_large, stage):
    mode = ["--in-process"] if stage == "fill" else []
    branch(tmp_path / "run", scene, straight_large, stage, *mode, *overrides(*LARGE))


def test_changes_by_stage_are_told(straight_large):
    with open_run(straight_large) as run:
        rows = {row["name"]: row.get("changes") for row in run.info["stages"]}
        assert (rows["couple"], rows["equilibrium"]) == (None, None)
        assert "discs.soil: friction.coefficient 0.55 -> 0.4" in rows["overload"]["what"]
        assert rows["overload"]["strain_energy"][1] > rows["overload"]["strain_energy"][0]  # E is lower
        (change,) = run.info["windows"][0]["changes"]
        assert change["stored_energy"][1] < change["stored_energy"][0]  # springs are stiffer
        steps, _ = run.history("unbalanced_ratio", 1)
        assert np.diff(steps[-3:]).tolist() == [5, 5]
        text = "\n".join(closing.sentences(run.info))
        assert "from stage overload on: " in text
        assert "window band at the start of stage overload (energy of the contacts " in text


def branch(out, scene, before, stage, *options):
    """Branch off the run `before` without changing anything, and compare."""
    done = quietly("run", scene, "--out", out, "--from", f"{before}@{stage}", *options)
    assert done.returncode == 0, done.stderr
    first = STAGES.index(stage) + 1
    for later in STAGES[first:]:
        for side in SIDES:
            name = f"{side}.{later}.h5"
            assert differing(before / name, out / name) == [], name
    assert_equal_runs(before, out, first)
    info = json.loads((out / "run.json").read_text())
    assert [row["name"] for row in info["stages"]] == list(STAGES)
    assert info["begins_after"] == {"run": str(before), "stage": stage}
    with open_run(out) as run:
        assert run.frames[0].stage == stage  # the State it began with


def test_so_does_one_after_an_excavation(tmp_path, configs):
    """The pit is dug in large strain; the surcharge that follows stands on ground that is not the scene's any more."""
    text = (configs / "quick_excavation.toml").read_text(encoding="utf-8")
    text += '[[stage]]\nname = "load"\nkind = "surcharge"\nuntil = { steps = 90 }\n'
    text += "surcharge = { x = [0.5, 9.0], pressure = 50e3, over = 70 }\n"
    (tmp_path / "scene.toml").write_text(text, encoding="utf-8")
    changes = ("stage.3.until.steps=120", "stage.3.excavate.over=100", "stage.3.large_strain=true")
    more = [word for pair in (*SHORT[:3], *changes, "record.every=50") for word in ("--set", pair)]
    done = quietly("run", tmp_path / "scene.toml", "--out", tmp_path / "straight", "--in-process", *more)
    assert done.returncode == 0, done.stderr
    more += ["--from", f"{tmp_path / 'straight'}@pit", "--in-process"]
    done = quietly("run", tmp_path / "scene.toml", "--out", tmp_path / "run", *more)
    assert done.returncode == 0, done.stderr
    for side in SIDES:
        assert differing(tmp_path / "straight" / f"{side}.load.h5", tmp_path / "run" / f"{side}.load.h5") == []


GRID_ALONE = {
    "format": 1,
    "seed": 1,
    "grid": {"kind": "box", "length": 4.0, "height": 2.0, "zone_size": 0.5},
    "material": [{"name": "clay", "density": 2000.0, "elastic": {"bulk": 2e7, "shear": 1e7}}],
    "boundary": [{"on": "left", "fix": "x"}, {"on": "right", "fix": "x"}, {"on": "bottom", "fix": "xy"}],
    "damping": {"local": 0.8},
    "record": {"every": 20, "history": 10},
    "stage": [
        {"name": "equilibrium", "gravity": 9.81, "until": {"steps": 60}},
        {"name": "locate", "discard": True, "gravity_factor": {"to": 2.0, "over": 10}, "until": {"steps": 50}},
        {
            "name": "load",
            "kind": "surcharge",
            "surcharge": {"x": [1.0, 3.0], "pressure": 1e4, "over": 10},
            "until": {"steps": 40},
        },
    ],
}


def counted(path):
    """(step, stage) of the frames that VTK counts in a file."""
    with h5py.File(path, locking=False) as file:
        count = int(file["VTKHDF/Steps"].attrs["NSteps"])
        return list(zip(file["Frames/step"][:count].tolist(), file["Frames/stage"][:count].tolist(), strict=True))


def test_each_frame_is_in_the_files_once_also_after_a_resume(tmp_path):
    """VTK and open_run count the same frames; of a discarded stage the frames are those it computed, not the restored State."""
    out = tmp_path / "run"
    colluvium.run(build_scene(GRID_ALONE), out).close()
    names = [b"equilibrium"] * 3 + [b"locate"] * 3 + [b"load"] * 3
    expected = list(zip((20, 40, 60, 80, 100, 110, 120, 140, 150), names, strict=True))
    assert counted(out / "fdm.rank0.vtkhdf") == expected
    with open_run(out) as run:
        assert [(info.step, info.stage.encode()) for info in run.frames] == expected
        assert not run.gridpoints(run.last_frame("equilibrium")).displacement.any()
        located = run.gridpoints(run.last_frame("locate")).displacement
        assert np.abs(located).max() > 0.0
    (out / "fdm.rank0.load.h5").unlink()
    resume(out).close()
    assert counted(out / "fdm.rank0.part1.vtkhdf") == expected[6:]
    with open_run(out) as run:
        assert [(info.step, info.stage.encode()) for info in run.frames] == expected
        assert run.gridpoints(run.last_frame("locate")).displacement.tobytes() == located.tobytes()


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="reads /proc")
def test_a_killed_run_is_resumed_and_reads_as_one_run(tmp_path, scene, straight):
    out = tmp_path / "run"
    arguments = command("colluvium.cli", "run", scene, "--out", out, "--quiet", *overrides())
    launcher = subprocess.Popen(arguments, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        wait_for((out / "dem.rank1.couple.h5").exists, 200, "the end of the stage couple on the discs' side")
        wait_for((out / "fdm.rank0.couple.h5").exists, 20, "and on the grid's")
    finally:
        for pid in children_of(launcher.pid):
            os.kill(pid, signal.SIGKILL)
        launcher.kill()
        launcher.wait()
    for side in SIDES:
        (out / f"{side}.overload.h5").unlink(missing_ok=True)  # a fast machine may have got there before it was killed
    done = quietly("resume", out, "--in-process")
    assert done.returncode == 0, done.stderr
    assert "continuing after the end of stage 'couple'" in done.stderr
    assert (out / "fdm.rank0.part1.vtkhdf").exists()
    assert_equal_runs(straight, out, 0)
    for side in SIDES:
        assert differing(straight / f"{side}.overload.h5", out / f"{side}.overload.h5") == []
    numbers = run_numbers(out)
    assert len(set(numbers.values())) == 1, numbers
    assert {"run.json", "fdm.rank0.part1.vtkhdf", "dem.rank1.vtkhdf", "fdm.rank0.fill.h5", "dem.rank1.json"} <= set(numbers)
    (number,) = set(numbers.values())
    assert number not in run_numbers(straight).values()
    for side in SIDES:
        last = (out / f"{side}.log").read_text().splitlines()[-1]
        assert f"[run {number}, rank {side[-1]}, " in last
    again = quietly("resume", out)
    assert again.returncode == 0
    assert f"the run in {out} is finished (all stages done): nothing remains to be computed" in again.stderr


def run_numbers(out):
    """Numbers of the run {name: number} in all files of a run directory that have one."""
    found = {}
    for path in out.iterdir():
        if path.suffix in (".h5", ".vtkhdf"):
            with h5py.File(path, "r") as file:
                found[path.name] = file.attrs["run"]
        elif path.name in ("run.json", "dem.rank1.json") or path.name.endswith(".now.json"):
            found[path.name] = json.loads(path.read_text())["run"]
    return found


LIMITED = """
import resource, sys
from colluvium import cli
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[1]), resource.RLIM_INFINITY))
sys.exit(cli.main(sys.argv[2:]))
"""


@pytest.mark.parametrize(
    ("size", "processes", "what"),
    [
        (60_000, "two", "the account of the run"),
        pytest.param(300_000, "two", "the frame of step 50", marks=pytest.mark.long),
        pytest.param(740_000, "two", "the frame of step", marks=pytest.mark.long),
        (740_000, "one", "the frame of step 450"),
        pytest.param(1_000_000, "two", "the frame of step", marks=pytest.mark.long),
    ],
)
def test_a_run_without_room_is_resumed_as_if_there_had_always_been_some(tmp_path, scene, straight, size, processes, what):
    """No file may become larger than `size` bytes. The error names the first file without room; then there is room again."""
    out = tmp_path / "run"
    mode = ["--in-process"] if processes == "one" else []
    done = finished([sys.executable, "-c", LIMITED, size, "run", scene, "--out", out, "--quiet", *mode, *overrides()])
    assert done.returncode == 4, done.stderr
    assert "Traceback" not in done.stderr
    told = done.stderr.count("cannot be written to")  # two processes may both find no room before either hears of the other
    assert 1 <= told <= (2 if processes == "two" else 1), done.stderr
    assert f": {what}" in done.stderr
    assert "File too large; it needs " in done.stderr
    assert json.loads((out / "run.json").read_text())["exit_code"] == 4
    with contextlib.suppress(FileNotFoundError), open_run(out) as run:
        for i in range(len(run.frames)):
            assert all(np.isfinite(body.xy).all() for body in run.bodies(i))
        for rank in run.files:
            for name in run.files[rank].history_names():
                steps, _ = run.history(name, rank)
                assert (np.diff(steps) > 0).all()
                assert steps[0] > 0
    done = quietly("resume", out, "--in-process")
    if not list(out.glob("fdm.rank0.equilibrium.h5")):
        assert done.returncode in (3, 4)
        return
    assert done.returncode == 0, done.stderr
    assert_equal_runs(straight, out, 0)
    for side in SIDES:
        assert differing(straight / f"{side}.overload.h5", out / f"{side}.overload.h5") == []


def test_a_run_resumed_twice_from_ever_earlier_ends_is_still_one_run(tmp_path, straight):
    out = tmp_path / "run"
    shutil.copytree(straight, out)
    for gone in (["overload"], ["couple", "overload"]):
        for path in [out / f"{side}.{stage}.h5" for side in SIDES for stage in gone]:
            path.unlink()
        assert quietly("resume", out, "--in-process").returncode == 0
        assert_equal_runs(straight, out, 0)
    assert sorted(path.name for path in out.glob("fdm*.vtkhdf")) == [
        "fdm.rank0.part1.vtkhdf",
        "fdm.rank0.part2.vtkhdf",
        "fdm.rank0.vtkhdf",
    ]


@pytest.mark.parametrize("in_process", [True, False])
def test_a_run_is_resumed_from_python(tmp_path, scene, straight, in_process):
    out = tmp_path / "run"
    shutil.copytree(straight, out)
    for side in SIDES:
        (out / f"{side}.overload.h5").unlink()
    with resume(out, in_process=in_process) as run:
        assert run.info["exit_code"] == 0
        assert run.info["begins_after"]["stage"] == "couple"
    for side in SIDES:
        assert differing(straight / f"{side}.overload.h5", out / f"{side}.overload.h5") == []
    with pytest.raises(FinishedBefore, match="nothing remains to be computed"):
        resume(out)


def test_a_branch_may_record_differently(tmp_path, scene, straight):
    """Other intervals, and a trace: the State at the end is the same to the last bit."""
    more = ["--set", "record.every=30", "--set", "record.trace=3", "--set", "link.timeout=9.0"]
    done = quietly("run", scene, "--out", tmp_path / "run", "--in-process", "--from", f"{straight}@couple", *overrides(), *more)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "run" / "fdm.rank0.trace.csv").is_file()
    with open_run(tmp_path / "run") as run:
        assert {frame.step % 30 for frame in run.frames[1:-1]} == {0}
    for side in SIDES:
        assert differing(straight / f"{side}.overload.h5", tmp_path / "run" / f"{side}.overload.h5") == []


def test_a_branch_may_change_later_stages(tmp_path, scene, straight):
    more = ["--set", "stage.3.gravity_factor.to=1.5"]
    done = quietly("run", scene, "--out", tmp_path / "run", "--in-process", "--from", f"{straight}@couple", *overrides(), *more)
    assert done.returncode == 0, done.stderr
    assert json.loads((tmp_path / "run" / "run.json").read_text())["stages"][-1]["gravity_factor"] == 1.5
    assert differing(straight / "fdm.rank0.overload.h5", tmp_path / "run" / "fdm.rank0.overload.h5")


@pytest.mark.parametrize(
    ("stage", "override", "code", "words"),
    [
        ("couple", "material.0.density=2600", 3, "material.0.density: 2600.0 on this scene, 2700.0 on "),
        ("couple", "stage.2.handover=50", 3, "stage.2.handover: 50 on this scene, 100 on "),
        ("overload", "seed=1", 4, "this is the last stage"),
        ("nowhere", "seed=1", 4, "the scene has no stage 'nowhere'; it has equilibrium, fill, couple, overload"),
    ],
)
def test_anything_else_is_refused_by_its_name_before_anything_is_written(tmp_path, scene, straight, stage, override, code, words):
    more = [*overrides(), "--set", override]
    done = quietly("run", scene, "--out", tmp_path / "run", "--from", f"{straight}@{stage}", *more)
    assert done.returncode == code
    assert words in done.stderr
    assert not (tmp_path / "run").exists()


def test_a_run_is_not_overwritten_by_its_own_branch(scene, straight):
    done = quietly("run", scene, "--out", straight, "--force", "--from", f"{straight}@couple", *overrides())
    assert done.returncode == 4
    assert "colluvium resume" in done.stderr


def test_sides_that_go_on_from_different_runs_are_kept_apart(tmp_path, scene, straight):
    """Started by hand: the continuum goes on from one run, the discs from another one of the same scene."""
    assert quietly("run", scene, "--out", tmp_path / "other", "--in-process", *overrides()).returncode == 0
    grid = [scene, "--bind", "tcp://127.0.0.1:0", "--out", tmp_path / "a", "--from", f"{straight}@couple", *overrides()]
    discs = [scene, "--connect", tmp_path / "a" / "endpoint", "--out", tmp_path / "b", *overrides()]
    fdm = subprocess.Popen(command("fdm_server", *grid, "--quiet"), stderr=subprocess.PIPE, text=True)
    try:
        for origin in (["--from", f"{tmp_path / 'other'}@couple"], ["--from", f"{straight}@fill"], []):
            wrong = command("dem_server", *discs, *origin, "--force", "--quiet")
            done = finished(wrong, timeout=60)
            assert done.returncode == 5
            assert "one side begins elsewhere" in done.stderr
        right = command("dem_server", *discs, "--from", f"{straight}@couple", "--force", "--quiet")
        assert finished(right, timeout=120).returncode == 0
        assert fdm.wait(30) == 0
    finally:
        fdm.kill()
        fdm.communicate()
    assert coupled_frames(tmp_path / "b" / "dem.rank1.vtkhdf") > 1
    with h5py.File(tmp_path / "a" / "fdm.rank0.overload.h5") as file:
        assert file.attrs["step"] == checkpoint.attributes(straight / "fdm.rank0.overload.h5")["step"]
