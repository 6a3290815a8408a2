"""The command from end to end, on columns of a few zones."""

import json

import pytest

from colluvium.accuracy.command import closed_form
from coupler_protocol.files import restart
from coupler_protocol.problems import SceneError
from coupler_protocol.scene.reader import read_scene
from tests.commands import run_colluvium
from tests.small_grounds import BOX

LOADED = """
[[stage]]
name = "start"
kind = "equilibrium"
gravity = 0.0
until = { steps = 1 }
[[stage]]
name = "rest"
kind = "load"
gravity = 9.81
until = { ratio = 1e-3, steps = 8000 }
"""


@pytest.fixture
def scene(tmp_path):
    path = tmp_path / "box.toml"
    path.write_text(BOX + LOADED)
    return path


@pytest.mark.long
def test_a_smaller_ratio_costs_time_and_leaves_less_error(scene, tmp_path):
    """Settlement of the surface: rho g H^2 / 2 M."""
    exact = -2000.0 * 9.81 * 4.0 / (2 * (5e7 + 4 / 3 * 2e7))
    words = ["accuracy", scene, "--of", "displacement_y(1, 2)", "--knob", "ratio=1e-2,1e-4,1e-6", f"--reference={exact}"]
    words += ["--source", "uniaxial strain", "--out", tmp_path / "study", "--target", "2%", "--no-pictures"]
    done = run_colluvium(*words, "--json", tmp_path / "found.json")
    assert done.returncode == 0, done.stderr
    found = json.loads((tmp_path / "found.json").read_text())
    errors = [one["error"] for one in found["settings"]]
    steps = [one["steps"] for one in found["settings"]]
    assert errors[0] > 5 * errors[-1]
    assert steps == sorted(steps)
    assert found["reference"]["source"] == "uniaxial strain"
    before = {path: path.stat().st_mtime_ns for path in (tmp_path / "study" / "settings").rglob("*.vtkhdf")}
    again = run_colluvium(*words, "--knob", "zone_size=1.0,0.5")
    assert again.returncode == 0, again.stderr
    known = {path: path.stat().st_mtime_ns for path in before}
    assert known == before  # settings that were computed are not computed again
    assert again.stdout.count("ratio=") >= 6
    assert "± 95 %" in again.stdout
    assert "front" in again.stdout


def test_settings_are_listed_without_computing(scene, tmp_path):
    words = ["accuracy", scene, "--of", "max_displacement", "--knob", "ratio=1e-2,1e-4", "--seeds", "2", "--dry-run"]
    done = run_colluvium(*words, "--out", tmp_path / "study")
    assert done.stdout.splitlines() == [f"ratio={ratio}, seed={seed}" for ratio in ("0.01", "0.0001") for seed in (1, 2)]
    assert not (tmp_path / "study").exists()


class Options:
    """Options of the command that name a reference."""

    def __init__(self, of, reference=None, source="", changes=()):
        self.of, self.reference, self.source, self.set = of, reference, source, list(changes)


def test_a_scene_names_the_closed_form_of_its_quantity(configs):
    scene = read_scene(configs / "hole.toml")
    assert closed_form(Options("stress_xx(0,2)"), scene) == (-36.5625e6, "Kirsch (1898)")
    assert closed_form(Options("stress_xx(0, 3)"), scene) == (None, "")
    assert closed_form(Options("stress_xx(0, 2)", -1.0, "mine"), scene) == (-1.0, "mine")
    _, source = closed_form(Options("stress_xx(0, 2)", changes=["accuracy.x=1", "grid.outer=20"]), scene)
    assert source == "Kirsch (1898); if it is not changed by grid.outer=20"
    assert closed_form(Options("fos"), read_scene(configs / "quick_slope.toml")) == (None, "")


def test_no_result_depends_on_a_reference(configs):
    """Another reference: the same hash, so kept results of the scene stay, and a run may be continued."""
    scenes = [read_scene(configs / "hole.toml", [f"accuracy.reference.0.value={v}"]) for v in (-36e6, -37e6)]
    assert scenes[0].accuracy != scenes[1].accuracy
    assert scenes[0].digest() == scenes[1].digest()
    assert restart.identity(scenes[0]) == restart.identity(scenes[1])


def test_a_quantity_with_two_references_is_refused(configs):
    twice = 'accuracy.reference=[{of="fos", value=1, source="a"}, {of=" fos", value=2, source="b"}]'
    with pytest.raises(SceneError, match="fos has two references: remove one"):
        read_scene(configs / "hole.toml", [twice])


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ([], "there is nothing to vary"),
        (["--knob", "zone_size"], "has no values"),
        (["--knob", "ratio=1e-2,1e-3", "--budget", "soon"], "is no time"),
        (["--knob", "ratio=1e-2,1e-3", "--target", "all"], "is no share"),
        (["--knob", "zone_size", "--budget", "1min", "--at-once", "2"], "takes one setting after the other"),
    ],
)
def test_options_that_do_not_go_together_are_refused(scene, words, said):
    done = run_colluvium("accuracy", scene, "--of", "max_displacement", *words)
    assert done.returncode == 3
    assert said in done.stderr
