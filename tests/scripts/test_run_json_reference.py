"""The tables of run.json in docs/output.md are those of the schema, key by key."""

import pytest
from pydantic import create_model
from run_json_reference import PAGE, page
from scene_reference import tables

from coupler_protocol.files.run_schema import RunJson
from coupler_protocol.scene.declare import quantity
from tests.commands import run_script


def rows(text):
    """Keys, units and meanings by table: {"": .., "stages": .., ...} of the page's part on run.json."""
    found, path = {"": []}, ""
    for line in text.partition("\n## run.json\n")[2].partition("\n## ")[0].splitlines():
        if line.startswith("### "):
            path = line.strip("# `")
            found[path] = []
        elif line.startswith("| `"):
            found[path].append(tuple(cell.strip(" `") for cell in line.strip("| ").split(" | ")))
    return found


def test_the_page_is_up_to_date():
    done = run_script("run_json_reference.py", "--check", timeout=60)
    assert done.returncode == 0, "run: python scripts/run_json_reference.py"


def test_the_page_has_every_key_of_the_schema_with_unit_and_meaning():
    shown = rows(PAGE.read_text(encoding="utf-8"))
    declared = {path: part.model_fields for path, part, _ in tables(RunJson, "")}
    top = {"", "stages", "begins_after", "warnings", "doubts", "compiled", "compiled.most_expensive"}
    of_stages = {f"stages.{name}" for name in ("seconds", "limits", "rim_stretched", "changes")}
    assert set(shown) == set(declared) == top | of_stages
    for path, fields in declared.items():
        assert [key for key, *_ in shown[path]] == list(fields)
        for key, unit, meaning in shown[path]:
            assert (unit, meaning.strip("`")) == (fields[key].json_schema_extra["unit"], fields[key].description.strip("`"))
            assert len(meaning) > 5


def test_a_key_more_or_another_meaning_is_another_page():
    text = PAGE.read_text(encoding="utf-8")
    assert page(text) == text
    more = create_model("More", __base__=RunJson, planted=(int, quantity(0, meaning="a planted key")))
    assert "| `planted` | - | a planted key |" in page(text, more)
    other = create_model("Other", __base__=RunJson, reason=(str, quantity(meaning="another meaning")))
    assert page(text, other) != text
    with pytest.raises(ValueError, match="no marks"):
        page("# Output")
