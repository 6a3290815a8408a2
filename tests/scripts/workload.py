"""The fast form of a workload of scripts/accuracy_cost.py."""

import json

import accuracy_cost
import pytest


def computed(name, folder, *options):
    """(rows, page) of the workload `name`, computed into `folder` with further options; asserts that its picture was drawn."""
    pytest.importorskip("matplotlib")
    page, rows = folder / "accuracy.md", folder / "rows.json"
    accuracy_cost.main([name, "--fast", "--page", str(page), "--json", str(rows), *options])
    assert (folder / "pictures" / f"accuracy_{name.lower()}.png").stat().st_size > 10_000
    return json.loads(rows.read_text()), page.read_text()
