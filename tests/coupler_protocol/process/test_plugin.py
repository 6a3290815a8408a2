"""Which functions are called when, and what is no plugin."""

import pytest

from coupler_protocol.exits import EnvironmentFailed, Interrupted
from coupler_protocol.process import plugin
from coupler_protocol.process.plugin import Moment


def moment(step):
    return Moment(0, "overload", step, None, None)


def test_on_step_is_called_every_so_many_steps():
    steps, stages = [], []
    found = plugin.from_functions(lambda m: stages.append(m.stage), (3, lambda m: steps.append(m.step)))
    for step in range(1, 10):
        found.step(moment(step))
    found.stage(moment(9))
    assert (steps, stages) == ([3, 6, 9], ["overload"])


def test_one_function_is_enough_and_none_is_no_plugin():
    seen = []
    plugin.from_functions(on_step=(1, seen.append)).stage(moment(1))
    plugin.from_functions(on_stage=seen.append).step(moment(1))
    assert seen == []
    assert plugin.from_functions() is None
    with pytest.raises(ValueError, match="at least 1 step"):
        plugin.from_functions(on_step=(0, print))


def test_a_text_of_on_step_is_passed_on_and_nothing_else():
    found = plugin.from_functions(on_step=(2, lambda m: {2: "enough", 4: 7}.get(m.step)))
    assert [found.step(moment(step)) for step in range(1, 7)] == ["", "enough", "", "", "", ""]


def test_a_function_that_fails_is_named_with_its_place():
    found = plugin.from_functions(on_step=(1, lambda m: 1 / 0))
    with pytest.raises(EnvironmentFailed, match=r"\(functions, rank 0, step 7, stage 'overload'\): ZeroDivisionError"):
        found.step(moment(7))


def test_a_function_may_end_the_run():
    def stop(moment):
        raise Interrupted("enough")

    with pytest.raises(Interrupted, match="enough"):
        plugin.from_functions(on_stage=stop).stage(moment(7))


def test_a_file_is_a_plugin(tmp_path):
    path = tmp_path / "mine.py"
    path.write_text("EVERY = 2\nseen = []\ndef on_step(moment):\n    seen.append(moment.step)\n")
    found = plugin.from_file(path)
    for step in range(1, 6):
        found.step(moment(step))
    assert found.on_step.__globals__["seen"] == [2, 4]
    assert (found.on_stage, found.every, found.name) == (None, 2, str(path))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("x = 1", "neither on_step nor on_stage"),
        ("def on_step(moment) pass", "cannot be run: SyntaxError"),
        ("import nothing_of_this_name", "cannot be run: ModuleNotFoundError"),
        ("EVERY = 0\ndef on_step(moment): pass", "EVERY is a whole number of steps from 1, not 0"),
        ("EVERY = True\ndef on_step(moment): pass", "EVERY is a whole number of steps from 1, not True"),
        ("EVERY = '9'\ndef on_step(moment): pass", "EVERY is a whole number of steps from 1, not '9'"),
        ("EVERY = 2.0\ndef on_step(moment): pass", "EVERY is a whole number of steps from 1, not 2.0"),
    ],
)
def test_what_is_no_plugin_is_refused_in_words(tmp_path, text, words):
    path = tmp_path / "mine.py"
    path.write_text(text)
    with pytest.raises(EnvironmentFailed, match=words):
        plugin.from_file(path)


def test_a_file_that_is_not_there_is_refused_in_words(tmp_path):
    with pytest.raises(EnvironmentFailed, match="cannot be run: FileNotFoundError"):
        plugin.from_file(tmp_path / "none.py")
