"""What tests of whole runs share."""

import json

import pytest

from coupler_protocol.files.run_json import misfits


@pytest.fixture(scope="module")
def scene_file(tables, tmp_path_factory):
    """The module's `tables` as a file for the command line."""
    path = tmp_path_factory.mktemp("scene") / "scene.json"
    path.write_text(json.dumps(tables))
    return path


@pytest.fixture(scope="session", autouse=True)
def _every_run_json_fits_its_schema(tmp_path_factory):
    """Whatever the runs of these tests left in run.json is declared."""
    yield
    found = {path: path.read_text(encoding="utf-8") for path in tmp_path_factory.getbasetemp().rglob("run.json")}
    found = {path: json.loads(text) for path, text in found.items() if "scene_hash" in text}  # others are planted by tests
    assert {str(path): misfits(info) for path, info in found.items() if misfits(info)} == {}
