"""With kinetic damping slopes have the same factor of safety, and grid and discs the same rest, in fewer steps."""

import json

import numpy as np
import pytest

from colluvium import open_run
from colluvium.running import processes, threads
from coupler_protocol.scene.reader import read_scene
from tests.commands import run_colluvium
from tests.integration.kills import goes_on, kill_at, killed_run
from tests.integration.same_runs import assert_same_runs

KINETIC = 'damping={kind="kinetic"}'
KINDS = {"local": [], "kinetic": [KINETIC]}


def factor(configs, name, out, *words):
    """(low, high, steps of all trials) of a search."""
    done = run_colluvium("fos", configs / f"{name}.toml", "--out", out, "--quiet", "--no-pictures", "--grid", *words)
    assert done.returncode == 0, done.stderr
    (found,) = json.loads((out / "fos.json").read_text())["meshes"]
    return found["low"], found["high"], sum(trial["steps"] for trial in found["trials"])


@pytest.mark.long
@pytest.mark.parametrize(("name", "size"), [("dawson_slope", 1.0), ("griffiths_lane", 2.5)])
def test_the_factor_of_safety_is_the_same(configs, tmp_path, name, size):
    """Brackets of 1 % that overlap, on a coarse mesh."""
    words = ["--set", "fos.resolution=0.01", "--set", f"fos.zone_sizes=[{size}]"]
    local = factor(configs, name, tmp_path / "local", *words)
    kinetic = factor(configs, name, tmp_path / "kinetic", *words, "--set", KINETIC)
    assert max(local[0], kinetic[0]) <= min(local[1], kinetic[1])


@pytest.fixture(scope="module")
def coupled(tmp_path_factory, configs):
    """Folders of the quick slope at rest under 1.2 g with local and with kinetic damping."""
    folder = tmp_path_factory.mktemp("kinetic")
    words = [
        "discs.soil.bond={tension=1e9, shear=1e9}",
        "record.every=100000",
        "record.checkpoint_steps=30",
        "record.checkpoint=0.0",
    ]
    words += ["stage.overload.gravity_factor={to=1.2, over=100}", "stage.couple.until={ratio=1e-6, steps=20000}"]
    words += ["stage.overload.until={ratio=1e-6, steps=20000}", "stage.equilibrium.until={ratio=1e-6, steps=20000}"]
    scenes = {name: read_scene(configs / "quick_slope.toml", [*words, *more]) for name, more in KINDS.items()}
    for name, scene in scenes.items():
        (folder / name).mkdir()
        threads.run(scene, folder / name)
    return folder, scenes


@pytest.mark.long
def test_grid_and_discs_come_to_the_same_rest_in_fewer_steps(coupled):
    """Contacts that slip remember the way: displacements agree within 3 %."""
    folder, _ = coupled
    with open_run(folder / "local") as local, open_run(folder / "kinetic") as kinetic:
        steps = [{row["name"]: row["steps"] for row in run.info["stages"]} for run in (local, kinetic)]
        assert all(row["ended_by"].startswith("ratio") for row in kinetic.info["stages"] if row["name"] != "fill")
        own, other = (run.gridpoints(-1).displacement for run in (local, kinetic))
    assert steps[1]["equilibrium"] < 0.5 * steps[0]["equilibrium"]
    assert sum(steps[1].values()) < sum(steps[0].values())
    assert np.abs(own - other).max() < 0.03 * np.abs(own).max()


@pytest.mark.long
def test_two_processes_have_the_bits_of_one(coupled, tmp_path):
    folder, scenes = coupled
    processes.run_scene(scenes["kinetic"], tmp_path)
    assert_same_runs(folder / "kinetic", tmp_path)


@pytest.mark.long
def test_a_killed_run_goes_on_with_the_same_bits(coupled, tmp_path):
    """The energy before the last peak is in the checkpoint."""
    folder, scenes = coupled
    with open_run(folder / "kinetic") as run:
        begin = sum(row["steps"] for row in run.info["stages"][:2])
    killed_run(scenes["kinetic"], tmp_path / "run", kill_at(begin + 100))
    goes_on(scenes["kinetic"], tmp_path / "run")
    assert_same_runs(folder / "kinetic", tmp_path / "run")
