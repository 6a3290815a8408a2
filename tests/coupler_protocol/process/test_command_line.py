"""Exit codes say whose fault the end was; options, folders and progress do no harm."""

import argparse
import io
import json
import logging
import os
from pathlib import Path

import pytest

from coupler_protocol import exits
from coupler_protocol.compiled import threads
from coupler_protocol.problems import Problem, SceneError
from coupler_protocol.process import command_line
from coupler_protocol.process.interrupt import StopRequest
from coupler_protocol.process.progress import Progress, as_line
from coupler_protocol.wire.frames import WireError


def raiser(error):
    def work():
        raise error

    return work


@pytest.mark.parametrize(
    ("error", "code"),
    [
        (SceneError([Problem("a.toml", 3, "grid", "bad")]), 3),
        (exits.EnvironmentFailed("port 5555 is taken"), 4),
        (FileNotFoundError(2, "No such file", "a.toml"), 4),
        (exits.PeerLost("silence"), 5),
        (WireError("another size was agreed"), 5),
        (exits.PhysicsFailed("a zone turned inside out"), 6),
        (exits.Interrupted("interrupted by SIGINT"), 130),
    ],
)
def test_an_end_has_one_message_and_one_code(capsys, error, code):
    assert command_line.exit_code_of("fdm-server", raiser(error)) == code
    said = capsys.readouterr().err
    assert said.startswith("fdm-server: ")
    assert str(error) in said
    assert "Traceback" not in said


def test_what_nobody_expected_is_our_own_fault_and_shows_where(capsys, caplog):
    assert command_line.exit_code_of("dem-server", raiser(KeyError("rim"))) == 7
    said = capsys.readouterr().err
    assert "a fault of this program, please report it" in said
    assert "KeyError: 'rim'" in said
    assert "KeyError: 'rim'" in caplog.text


def test_the_second_ctrl_c_ends_at_once(capsys):
    assert command_line.exit_code_of("fdm-server", raiser(KeyboardInterrupt())) == 130
    assert "twice" in capsys.readouterr().err


def test_a_good_end_is_zero_and_silent(capsys):
    assert command_line.exit_code_of("fdm-server", lambda: None) == 0
    assert capsys.readouterr() == ("", "")


def test_every_code_has_a_meaning():
    codes = {cls.code for cls in (exits.RunEnded, *exits.RunEnded.__subclasses__())}
    assert codes == {0, 7, 4, 5, 6, 130}
    assert codes | {2, 3, 8} == set(exits.MEANING)


@pytest.mark.parametrize("text", ["0", "-1", "1.5", "two", "", "²"])
def test_numbers_of_things_are_whole_and_positive(text):
    with pytest.raises(argparse.ArgumentTypeError, match="not a whole number from 1"):
        command_line.positive(text)
    assert command_line.positive("12") == 12


def test_a_wrong_command_line_is_code_two(capsys):
    with pytest.raises(SystemExit) as ended:
        command_line.server_parser("fdm-server", "").parse_args(["scene.toml", "--out", "x", "--threads", "0"])
    assert ended.value.code == exits.COMMAND_LINE
    assert "not a whole number from 1" in capsys.readouterr().err


def test_results_are_kept_unless_force_is_said(tmp_path):
    out = tmp_path / "deep" / "run"
    assert command_line.prepare_folder(out, ["run.json"], False) == out
    (out / "run.json").write_text("old")
    (out / "notes.txt").write_text("mine")
    with pytest.raises(exits.EnvironmentFailed, match=r"holds results already \(run.json\).*--force"):
        command_line.prepare_folder(out, ["run.json"], False)
    command_line.prepare_folder(out, ["run.json"], True)
    assert [path.name for path in out.iterdir()] == ["notes.txt"]


def test_both_processes_of_a_run_clear_its_folder_at_the_same_time(tmp_path, monkeypatch):
    """What one has seen there, the other has already removed."""
    (tmp_path / "report").mkdir()
    monkeypatch.setattr(Path, "exists", lambda path: True)
    monkeypatch.setattr(Path, "glob", lambda folder, pattern: [folder / "stress.png"])
    assert command_line.prepare_folder(tmp_path, ["fdm.rank0.now.json"], True) == tmp_path


def test_the_report_of_an_earlier_run_is_removed_by_force(tmp_path):
    """Its pictures show the earlier run; files of the user stay."""
    report = tmp_path / "report"
    report.mkdir()
    for name in ("stress.png", "report.html", "notes.txt"):
        (report / name).write_text("old")
    (tmp_path / "run.json").write_text("old")
    command_line.prepare_folder(tmp_path, ["run.json"], True)
    assert [path.name for path in report.iterdir()] == ["notes.txt"]
    (report / "notes.txt").unlink()
    command_line.remove_report(tmp_path)
    assert not report.exists()
    command_line.remove_report(tmp_path)


@pytest.mark.parametrize("name", ["scene.json", "export/discs.csv"])
def test_force_removes_nothing_where_an_input_of_the_run_would_go(tmp_path, name):
    (tmp_path / "export").mkdir()
    for own in (name, "run.json"):
        (tmp_path / own).write_text("old")
    with pytest.raises(exits.EnvironmentFailed, match=f"{name} is an input of this run .* copy it to another folder"):
        command_line.prepare_folder(tmp_path, ["run.json", "scene.json"], True, [tmp_path / "other", tmp_path / name])
    assert all((tmp_path / own).exists() for own in (name, "run.json"))


def test_a_file_in_the_folders_place_is_a_fault_of_the_environment(tmp_path):
    (tmp_path / "run").write_text("a file")
    with pytest.raises(exits.EnvironmentFailed, match="cannot write to"):
        command_line.prepare_folder(tmp_path / "run", [], False)


def test_threads_asked_for_are_those_that_share_a_step():
    before = threads.size()
    command_line.set_threads(3)
    try:
        assert threads.size() == 3
    finally:
        threads.set_size(before)


def test_the_log_file_says_what_happened(tmp_path):
    root, before = logging.getLogger(), logging.getLogger().level
    handlers = list(root.handlers)
    try:
        command_line.log_to(tmp_path / "a.log", Progress(1, "none"))
        command_line.exit_code_of("fdm-server", raiser(exits.PeerLost("silence")))
    finally:
        for handler in set(root.handlers) - set(handlers):
            root.removeHandler(handler)
            handler.close()
        root.setLevel(before)
    assert "stage start, step 0] silence" in (tmp_path / "a.log").read_text()


# -- stop requests and progress ------------------------------------------------------------------------------------------


def test_the_first_reason_to_stop_is_kept():
    stop = StopRequest()
    stop.check()
    stop.ask("interrupted by SIGINT")
    stop.ask("the launcher is gone")
    with pytest.raises(exits.Interrupted, match="SIGINT"):
        stop.check()


def test_progress_is_told_as_a_line_as_json_or_to_a_function(capsys):
    rows = []
    Progress(0, rows.append)("couple", step=10, of=20, ratio=1e-3, factor=1.0)
    assert as_line(rows[0]).split() == ["rank", "0", "couple", "step", "10/20", "1.00", "g", "ratio", "1.00e-03"]
    Progress(1, "json")("fill", "sweep 3")
    assert json.loads(capsys.readouterr().out)["text"] == "sweep 3"
    Progress(1, "plain")("fill", "sweep 3")
    assert "rank 1  fill          sweep 3" in capsys.readouterr().err
    Progress(1, "none")("fill", "sweep 3")
    assert capsys.readouterr() == ("", "")


def test_progress_is_told_now_and_then_unless_it_matters():
    rows = []
    progress = Progress(0, rows.append, interval=60.0)
    for step in range(100):
        progress("couple", step=step)
    progress("done", now=True)
    assert [row["stage"] for row in rows] == ["couple", "done"]


def test_a_reader_that_goes_away_does_not_end_the_run(monkeypatch):
    class Broken(io.StringIO):
        def write(self, text):
            raise BrokenPipeError(32, "Broken pipe")

    for name, form in (("stdout", "json"), ("stderr", "plain")):
        progress = Progress(0, form, interval=0.0)
        monkeypatch.setattr(f"sys.{name}", Broken())
        progress("couple")
        progress("couple")
        monkeypatch.undo()


def test_a_scene_that_comes_through_a_pipe_is_refused(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(SceneError, match="write the scene to a file"):
        command_line.scene_file(str(tmp_path / "pipe"))
    ends = os.pipe()
    try:
        with pytest.raises(SceneError, match="write the scene to a file"):
            command_line.scene_file(f"/dev/fd/{ends[0]}")
    finally:
        for end in ends:
            os.close(end)


def test_a_file_that_is_redirected_is_found(tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text("format = 1", encoding="utf-8")
    with open(path, encoding="utf-8") as file:
        assert command_line.scene_file(f"/dev/fd/{file.fileno()}") == str(path.resolve())
    assert command_line.scene_file(str(path)) == str(path)
    assert command_line.scene_file("missing.toml") == "missing.toml"
