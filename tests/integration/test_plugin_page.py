"""Every example of docs/plugins.md runs as it is printed; a disc whose mass a function takes away ends the run in words."""

import re
from pathlib import Path

import numpy as np
import pytest

import colluvium
from coupler_protocol.exits import PhysicsFailed
from tests.commands import run_colluvium
from tests.integration.short_runs import SHORT, overrides

PAGE = (Path(__file__).parents[2] / "docs" / "plugins.md").read_text(encoding="utf-8")
FOLLOW, FROM_PYTHON = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)


@pytest.fixture(scope="module")
def scene(configs):
    """The quick slope on zones so fine that there is a gridpoint with the number that the page names."""
    return colluvium.Scene.read(configs / "quick_slope.toml", SHORT)


def test_the_file_of_the_page_is_a_plugin(tmp_path, configs):
    assert FOLLOW.startswith("# follow.py")
    (tmp_path / "follow.py").write_text(FOLLOW, encoding="utf-8")
    words = ["run", configs / "quick_slope.toml", "--in-process", "--quiet", *overrides()]
    done = run_colluvium(*words, "--plugin", tmp_path / "follow.py", "--out", tmp_path / "run")
    assert done.returncode == 0, done.stderr
    printed = [line.split() for line in done.stdout.splitlines() if re.match(r"\d+00 \w+ [\d.e-]+$", line)]
    assert [(row[0], row[1]) for row in printed][:4] == [(str(n), "equilibrium") for n in (100, 200, 300, 400)]
    assert np.isfinite([float(row[2]) for row in printed]).all()


def test_the_call_from_python_of_the_page_runs(tmp_path, scene, monkeypatch):
    seen = {"steps": 0, "stages": []}

    def follow(moment):
        seen["steps"] += 1

    def change(moment):
        seen["stages"].append(moment.stage)

    monkeypatch.chdir(tmp_path)
    exec(FROM_PYTHON, {"colluvium": colluvium, "scene": scene, "follow": follow, "change": change})
    assert seen["steps"] > 4
    assert seen["stages"].count("couple") == 2
    assert (tmp_path / "runs" / "followed" / "run.json").exists()


@pytest.mark.parametrize("name", ["velocity", "displacement", "force", "applied", "added_mass"])
def test_fields_of_the_table_of_the_grid_have_the_shape_it_says(tmp_path_factory, scene, name):
    shapes = _shapes(tmp_path_factory, scene)
    assert shapes[name] == (("N",) if name == "added_mass" else ("N", 2))


_FOUND: dict = {}


def _shapes(tmp_path_factory, scene):
    """Shapes of the fields of the grid's State at the end of the first stage, N for the number of gridpoints."""

    def look(moment):
        if moment.rank == 0 and not _FOUND:
            points = len(moment.model.grid.xy)
            for field in ("velocity", "displacement", "force", "applied", "added_mass"):
                shape = getattr(moment.state, field).shape
                _FOUND[field] = tuple("N" if n == points else n for n in shape)

    if not _FOUND:
        colluvium.run(scene, tmp_path_factory.mktemp("shapes") / "run", on_stage=look).close()
    return _FOUND


def test_a_disc_without_mass_ends_a_run_in_real_time_with_its_number(tmp_path):
    (tmp_path / "row.csv").write_text("x,y,radius\n0,0,0.1\n0.5,0,0.1\n", encoding="utf-8")
    discs = {"radius": 0.1, "file": str(tmp_path / "row.csv"), "soil": {"density": 2e3, "spring": {"normal": 1e7, "shear": 1e7}}}
    stages = [{"name": "fill"}, {"name": "go", "kind": "discs", "time": "real", "gravity": 9.81, "until": {"steps": 100_000}}]
    scene = colluvium.Scene(format=1, seed=1, discs=discs, stage=stages)

    def unweigh(moment):
        moment.state.weight[1] = 0.0

    with pytest.raises(PhysicsFailed, match="disc or clump 1 has a mass or inertia of 0 in real time"):
        colluvium.run(scene, tmp_path / "run", on_step=(1, unweigh))
