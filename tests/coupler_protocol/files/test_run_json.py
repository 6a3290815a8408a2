"""What run.json may hold, and what a run that goes on keeps of the attempts before it."""

import json

import pytest

from coupler_protocol import exits
from coupler_protocol.files import run_json

ENDED = {"exit_code": 6, "reason": "blown up", "stages": [], "plugin": "a.py", "seed": 3, "end": "now"}


def test_a_key_that_nobody_declared_is_found_and_logged(tmp_path, caplog):
    assert run_json.misfits(ENDED) == []
    run_json.write(tmp_path, ENDED | {"tine": 3})
    assert "tine: Extra inputs" in caplog.text
    assert json.loads((tmp_path / "run.json").read_text())["tine"] == 3


def test_a_stage_without_its_seconds_is_found():
    (found,) = [text for text in run_json.misfits(ENDED | {"stages": [{"name": "go"}]}) if "seconds_simulated" in text]
    assert found.startswith("stages.0.seconds_simulated: Field required")


def test_attempts_are_kept_in_order(tmp_path):
    for reason in ("first", "second"):
        about = run_json.history_content(tmp_path, None)
        run_json.write(tmp_path, ENDED | {"reason": reason} | about)
    about = run_json.history_content(tmp_path, None)
    assert [attempt["reason"] for attempt in about["attempts"]] == ["first", "second"]
    assert about["attempts"][0] == {"exit_code": 6, "reason": "first", "plugin": "a.py", "end": "now"}
    assert not (tmp_path / "run.json").exists()
    assert run_json.history_content(tmp_path, None) == about  # the third one was killed, and wrote none


def test_the_first_attempt_has_none_before_it(tmp_path):
    assert run_json.history_content(tmp_path, None) == {}


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("{", "is damaged"),
        ("[]", "not what a run writes"),
        ("{}", "not what a search for a factor writes"),
        ('{"quantity": "f", "meshes": []}', "not what a search for a factor writes"),
        ('{"quantity": "f", "meshes": [{"zone_size": 1.0, "trials": [1]}]}', "not what a search for a factor writes"),
    ],
)
def test_a_damaged_account_of_a_search_is_refused_in_words(tmp_path, text, words):
    path = tmp_path / "fos.json"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(exits.EnvironmentFailed, match=words) as found:
        run_json.read_search(path)
    assert "search again" in str(found.value)
    whole = {"quantity": "f", "meshes": [{"zone_size": 1.0, "trials": []}]}
    path.write_text(json.dumps(whole), encoding="utf-8")
    assert run_json.read_search(path) == whole
