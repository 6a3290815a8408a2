"""How a server's process begins, what it leaves however its side ends, and whom it tells."""

import argparse
import json
from contextlib import nullcontext
from types import SimpleNamespace

import pytest

import dem_server.__main__
from coupler_protocol import exits
from coupler_protocol.files import locks
from coupler_protocol.files.restart import Origin
from coupler_protocol.files.run_schema import RunJson
from coupler_protocol.process import command_line, server
from coupler_protocol.process.interrupt import StopRequest
from coupler_protocol.process.progress import Progress
from coupler_protocol.scene.reader import build_scene
from coupler_protocol.wire import frames, messages
from coupler_protocol.wire.link_inproc import transports
from dem_server.__main__ import compute

SPRING = {"normal": 5e7, "shear": 2e7}
ALONE = {
    "format": 1,
    "seed": 1,
    "window": [{"name": "box", "polygon": [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]}],
    "discs": {"radius": 0.05, "soil": {"density": 2000.0, "spring": SPRING}},
    "stage": [{"name": "fill"}, {"name": "fall", "kind": "discs", "until": {"steps": 5}}],
}
COUPLED = {
    "format": 1,
    "seed": 1,
    "grid": {"kind": "box", "length": 10.0, "height": 10.0, "zone_size": [1.0, 1.0]},
    "material": [{"name": "soil", "density": 2000.0, "elastic": {"bulk": 1e8, "shear": 5e7}}],
    "window": [{"name": "box", "columns": [3, 6], "rows": [3, 6]}],
    "discs": {"radius": 0.1, "soil": {"density": 2000.0, "spring": SPRING}},
    "stage": [
        {"name": "rest", "kind": "equilibrium", "gravity": 9.81, "until": {"steps": 5}},
        {"name": "pack", "kind": "fill"},
        {"name": "join", "kind": "couple", "until": {"steps": 5}},
    ],
}


class Side:
    """A side whose run ends with an exception, or with a reason."""

    def __init__(self, end, state="some"):
        self.end, self.state, self.saved = end, state, []

    def run(self):
        if isinstance(self.end, BaseException):
            raise self.end
        return self.end

    def save(self, stage, phase):
        self.saved.append((stage, phase))
        return "the path"

    def summary(self):
        return {"stages": [], "steps": 12}


@pytest.fixture
def context(tmp_path):
    """A RunContext whose progress is kept in `context.rows`."""
    rows = []
    made = server.RunContext(tmp_path, Progress(1, rows.append), StopRequest())
    return SimpleNamespace(made=made, rows=rows)


def test_a_side_that_ends_well_reports_its_reason_and_saves_nothing(context):
    side = Side("all stages done")
    assert server.run_side(lambda: side, context.made.progress) == "all stages done"
    assert [(row["stage"], row["text"]) for row in context.rows] == [("done", "all stages done")]
    assert side.saved == []


@pytest.mark.parametrize(
    ("end", "kind", "words"),
    [
        (exits.PhysicsFailed("a zone turned inside out"), exits.PhysicsFailed, "a zone turned inside out"),
        (
            ArithmeticError("discs pass through each other"),
            exits.PhysicsFailed,
            "discs pass through each other (stage 'start', after step 0)",
        ),
        (KeyError(), KeyError, "KeyError"),
    ],
)
def test_a_failure_reaches_the_peers_and_the_state_is_saved(context, end, kind, words):
    told, side = [], Side(end)
    with pytest.raises(kind):
        server.run_side(lambda: side, context.made.progress, lambda *said: told.append(said), "in the middle")
    assert told == [(messages.FAILURE, {"reason": words})]
    assert side.saved == [(server.STOPPED, "in the middle")]
    assert context.rows == []


def test_a_side_without_a_state_saves_none_and_one_that_cannot_be_made_is_told_too(context):
    told, side = [], Side(exits.PeerLost("silence"), state=None)
    with pytest.raises(exits.PeerLost):
        server.run_side(lambda: side, context.made.progress, lambda *said: told.append(said))
    assert (side.saved, len(told)) == ([], 1)

    def cannot():
        raise exits.EnvironmentFailed("no checkpoint")

    with pytest.raises(exits.EnvironmentFailed):
        server.run_side(cannot, context.made.progress, lambda *said: told.append(said))
    assert told[1:] == [(messages.FAILURE, {"reason": "no checkpoint"})]


@pytest.mark.parametrize(
    ("make", "code", "reason", "steps"),
    [
        (lambda: Side("all stages done"), 0, "all stages done", 12),
        (lambda: Side(exits.PhysicsFailed("blown up")), 6, "blown up", 12),
        (lambda: [][1], 7, "list index out of range", None),
    ],
)
def test_run_json_is_written_however_the_conductor_ends(context, make, code, reason, steps):
    scene = build_scene(ALONE)
    with nullcontext() if code == 0 else pytest.raises((exits.PhysicsFailed, IndexError)):
        server.conduct_run(make, scene, context.made)
    info = json.loads((context.made.out / "run.json").read_text(encoding="utf-8"))
    assert (info["exit_code"], info["reason"], info.get("steps")) == (code, reason, steps)
    assert info["scene_hash"] == scene.digest()
    assert RunJson.model_validate(info).seconds >= 0.0
    assert (context.made.out / "scene.json").exists() == (steps is not None)


def options(out, **more):
    """Options of a command line, parsed."""
    parser = command_line.server_parser("dem-server", "")
    words = [word for key, value in more.items() for word in (f"--{key}", *([] if value is True else [value]))]
    return parser.parse_args(["scene.toml", "--out", str(out), *words])


def begun(tmp_path, more=None, **given):
    """The RunContext of a process of discs, which has begun and ended."""
    with server.begun(options(tmp_path, **given), build_scene(ALONE), StopRequest(), 1, "dem.rank1", more) as context:
        assert (tmp_path / "dem.rank1.lock").exists()
    assert not (tmp_path / "dem.rank1.lock").exists()
    return context


def test_a_process_begins_in_a_folder_without_files_of_another_run(tmp_path):
    kept = ["other.log", "dem.rank2.log"]
    gone = ["run.json", "dem.rank1.vtkhdf", "dem.rank1.vtkhdf.undo", "dem.rank1.part2.vtkhdf", "dem.rank1.part1.vtkhdf.damaged"]
    for name in (*kept, *gone):
        (tmp_path / name).write_text("earlier")
    with pytest.raises(exits.EnvironmentFailed, match="--force"):
        begun(tmp_path, server.OF_CONDUCTOR)
    assert (tmp_path / "dem.rank1.vtkhdf").read_text() == "earlier"
    context = begun(tmp_path, server.OF_CONDUCTOR, force=True, quiet=True, checkpoint="7.5")
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted([*kept, "dem.rank1.log", "dem.rank1.now.json"])
    assert (context.out, context.origin, context.plugin, context.checkpoint) == (tmp_path, None, None, 7.5)
    assert (context.progress.rank, context.progress.form) == (1, "none")


def test_the_plugin_is_read_before_earlier_results_are_removed(tmp_path):
    (tmp_path / "run.json").write_text("earlier")
    with pytest.raises(exits.EnvironmentFailed, match="the plugin"):
        begun(tmp_path, ["run.json"], force=True, plugin=str(tmp_path / "none.py"))
    assert (tmp_path / "run.json").read_text() == "earlier"


def test_force_is_refused_where_a_process_that_lives_writes(tmp_path):
    (tmp_path / "dem.rank1.vtkhdf").write_text("alive")
    with locks.held(tmp_path, ["dem.rank1"]), pytest.raises(exits.EnvironmentFailed, match="is being written"):
        begun(tmp_path, force=True)
    assert (tmp_path / "dem.rank1.vtkhdf").read_text() == "alive"


def test_a_main_reads_the_scene_and_ends_with_the_code_of_its_fault(tmp_path, capsys):
    given = tmp_path / "scene.toml"
    given.write_text('format = 1\nseed = 1\n[[stage]]\nname = "nonsense"\n', encoding="utf-8")
    parser = argparse.ArgumentParser(parents=[command_line.server_parser("x", "")], add_help=False)
    called = []
    code = server.main("dem-server", parser, lambda *all_of: called.append(all_of), [str(given), "--out", str(tmp_path)])
    assert (code, called) == (exits.SCENE, [])
    assert "dem-server: " in capsys.readouterr().err


def test_the_continuum_is_told_where_a_window_cannot_even_begin(tmp_path):
    """The checkpoint that discs should go on from is missing: their peer must not wait for them in vain."""
    scene = build_scene(COUPLED)
    hub, (end,) = transports(1)
    context = server.RunContext(tmp_path, Progress(1, "none"), StopRequest(), Origin(tmp_path, "pack"))
    with pytest.raises(exits.EnvironmentFailed, match="does not exist"):
        compute(scene, 1, end, context)
    _, frame = hub.receive(1.0)
    kind, *_ = frames.open_header(frame)
    assert kind == messages.FAILURE
    assert "does not exist" in frames.content_of(frame)["reason"]


def test_a_server_that_overwrites_removes_parts_and_checkpoints_of_the_earlier_run(tmp_path):
    own = ["dem.rank1.vtkhdf", "dem.rank1.part1.vtkhdf", "dem.rank1.rest.h5", "dem.rank1.rest@40.h5", "dem.rank1.json"]
    for name in [*own, "dem.rank12.rest.h5", "fdm.rank0.rest.h5"]:
        (tmp_path / name).touch()
    with pytest.raises(exits.EnvironmentFailed, match="is damaged: the file is empty"):
        begun(tmp_path)
    begun(tmp_path, force=True)
    assert sorted(p.name for p in tmp_path.glob("*.*")) == [
        "dem.rank1.log", "dem.rank1.now.json", "dem.rank12.rest.h5", "fdm.rank0.rest.h5",
    ]  # fmt: skip


def test_a_finished_run_says_so(tmp_path, capsys):
    (tmp_path / "scene.json").write_text(json.dumps(ALONE))
    words = [str(tmp_path / "scene.json"), "--out", str(tmp_path / "run"), "--quiet"]
    assert dem_server.__main__.main(words) == exits.DONE
    before = content(tmp_path / "run")
    assert dem_server.__main__.main(words) == exits.DONE
    said = capsys.readouterr().err
    assert f"dem-server: the run in {tmp_path / 'run'} is finished (all stages done): nothing remains to be computed" in said
    assert content(tmp_path / "run") == before


def content(folder):
    """Contents of the files in a folder, logs excepted."""
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.suffix != ".log"}
