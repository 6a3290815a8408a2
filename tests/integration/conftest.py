"""What tests of whole runs share."""

import json

import pytest


@pytest.fixture(scope="module")
def scene_file(tables, tmp_path_factory):
    """The module's `tables` as a file for the command line."""
    path = tmp_path_factory.mktemp("scene") / "scene.json"
    path.write_text(json.dumps(tables))
    return path
