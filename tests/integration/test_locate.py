"""A discarded stage of kind locate leaves every later bit as it was, and `colluvium check` computes it by itself."""

import json
import tomllib

import pytest

import colluvium
from tests.commands import run_colluvium

LOOK = '[[stage]]\nname = "locate"\ngravity_factor = 12.0\nuntil = { steps = 1600 }\ndiscard = true\n'


@pytest.fixture
def scene(configs, tmp_path):
    """The quick scene with a stage locate behind its equilibrium, as a file."""
    text = (configs / "quick_slope.toml").read_text()
    path = tmp_path / "scene.toml"
    path.write_text(text.replace('[[stage]]\nname = "fill"', LOOK + '[[stage]]\nname = "fill"'))
    return path


def check(*arguments):
    done = run_colluvium("check", *arguments)
    assert done.returncode == 0, done.stderr
    return done


def test_check_computes_the_grid_alone_and_says_where_its_band_is(scene):
    done = check(scene, "--json")
    found = json.loads(done.stdout)["locate"]
    assert found["gravity_factor"] == 12.0
    assert found["windows"][0]["crosses"]
    assert found["windows"][0]["enters"][0] == pytest.approx(2 / 3 * 16)  # the window's left side
    assert "rank 0" in done.stderr


def test_a_window_off_the_band_is_warned_of(scene):
    said = " ".join(check(scene, "--quiet", "--set", "window.0.columns=[24, 26]").stdout.split())
    assert "warning: the band misses window band" in said
    assert "it would cross" in said


def test_nothing_is_computed_where_nothing_asks_for_it(scene, configs):
    assert "locate" not in json.loads(check(scene, "--no-locate", "--json").stdout)
    assert "locate" not in json.loads(check(configs / "quick_slope.toml", "--json").stdout)


def test_a_grid_that_cannot_be_computed_ends_with_its_exit_code(scene):
    done = run_colluvium("check", scene, "--quiet", "--set", "stage.locate.gravity_factor=1e12")
    assert done.returncode == 6
    assert "--no-locate leaves it out" in done.stderr


def arrays(run, frame, rank):
    """All recorded fields of a frame, {name: bits}."""
    kinds = (run.gridpoints, run.zones) if rank == 0 else (run.discs, run.contacts)
    found = [kind(frame, rank) for kind in kinds]
    return {(number, name): fields[name].tobytes() for number, fields in enumerate(found) for name in fields.names}


def test_later_stages_keep_their_bits(scene, tmp_path):
    """But for the numbers of their steps. 400 is a whole number of frames and histories, so both fall on the same steps."""
    data = tomllib.loads(scene.read_text())
    for name, until in {"equilibrium": 400, "locate": 400, "couple": 300, "overload": 250}.items():
        next(stage for stage in data["stage"] if stage["name"] == name)["until"] = {"steps": until}
    data["record"] = {"every": 50}
    runs = [colluvium.run(colluvium.Scene(**data), tmp_path / "with")]
    data["stage"] = [stage for stage in data["stage"] if stage["name"] != "locate"]
    runs.append(colluvium.run(colluvium.Scene(**data), tmp_path / "without"))
    later, plain = ([i for i, info in enumerate(run.frames) if info.stage != "locate"] for run in runs)
    assert len(later) == len(plain) > 15
    for i, j in zip(later, plain, strict=True):
        a, b = runs[0].frames[i], runs[1].frames[j]
        shift = 0 if a.stage == "equilibrium" else 400
        assert (a.stage, a.step - shift, a.gravity_factor) == (b.stage, b.step, b.gravity_factor)
        for rank in (0, 1):
            assert runs[0].has(i, rank) == runs[1].has(j, rank)
            if runs[0].has(i, rank):
                assert arrays(runs[0], i, rank) == arrays(runs[1], j, rank), (a, rank)
    for run in runs:
        run.close()
