"""Functions of a user see both sides, and change the run to the same bits in one process and in two."""

import json
import re
import tomllib
from pathlib import Path

import numpy as np
import pytest

import colluvium
from colluvium import cli
from dem_server.model import Model as DiscModel
from dem_server.model import State as DiscState
from fdm_server.model import Model as GridModel
from fdm_server.model import State as GridState
from tests.commands import run_colluvium
from tests.integration.drawn_slopes import SOIL, slope_with_a_window
from tests.integration.short_runs import FILES, SHORT, overrides
from tests.same_bits import differing

PUSH = """
EVERY = 10

def on_step(moment):
    if moment.rank == 0 and moment.stage == "overload":
        moment.state.velocity[:] *= 0.5

def on_stage(moment):
    if moment.rank == 1 and moment.stage == "couple":
        moment.state.v[moment.model.ring :] += 1e-7
"""


def test_functions_are_called_on_both_sides_and_looking_changes_nothing(tmp_path, configs, short_run):
    scene = colluvium.Scene.read(configs / "quick_slope.toml", SHORT)
    steps, ends = {0: [], 1: []}, {0: [], 1: []}

    def on_step(moment):
        assert np.isfinite(moment.state.velocity if moment.rank == 0 else moment.state.v).all()
        steps[moment.rank].append((moment.stage, moment.step))

    colluvium.run(
        scene, tmp_path / "seen", on_step=(100, on_step), on_stage=lambda m: ends[m.rank].append((m.stage, m.step))
    ).close()
    for name in FILES:
        assert differing(short_run / name, tmp_path / "seen" / name) == [], name
    coupled = [("couple", 500), ("couple", 600), ("overload", 700)]
    assert steps == {0: [("equilibrium", n) for n in (100, 200, 300, 400)] + coupled, 1: coupled}
    both = [("fill", 400), ("couple", 600), ("overload", 750)]
    assert ends == {0: [("equilibrium", 400), *both], 1: both}


def test_a_text_for_the_grid_ends_the_stage_with_the_next_step(tmp_path, configs):
    """The text is the reason in run.json; a text of the discs ends nothing, and the next stage begins as after any other end."""
    scene = colluvium.Scene.read(configs / "quick_slope.toml", SHORT)

    def on_step(moment):
        wanted = {"equilibrium": (0, 50), "couple": (0, 150), "overload": (1, 160)}.get(moment.stage)
        return f"enough at {moment.step}" if wanted and moment.rank == wanted[0] and moment.step >= wanted[1] else None

    colluvium.run(scene, tmp_path / "out", on_step=(50, on_step)).close()
    rows = {row["name"]: row for row in json.loads((tmp_path / "out" / "run.json").read_text())["stages"]}
    assert (rows["equilibrium"]["ended_by"], rows["equilibrium"]["steps"]) == ("enough at 50", 51)
    assert (rows["couple"]["ended_by"], rows["couple"]["steps"]) == ("enough at 150", 100)
    assert rows["overload"]["ended_by"] == "150 steps"


def test_a_file_changes_the_same_bits_in_one_process_and_two(tmp_path, configs, short_run):
    path = tmp_path / "push.py"
    path.write_text(PUSH)
    words = ["run", configs / "quick_slope.toml", "--quiet", *overrides()]
    ways = {"two": ["--plugin", path], "one": ["--plugin", path, "--in-process"]}
    for name, more in ways.items():
        done = run_colluvium(*words, *more, "--out", tmp_path / name)
        assert done.returncode == 0, done.stderr
    for name in FILES:
        assert differing(tmp_path / "one" / name, tmp_path / "two" / name) == [], name
        assert differing(tmp_path / "one" / name, short_run / name), name
    assert json.loads((tmp_path / "two" / "run.json").read_text())["plugin"] == str(path)


def test_a_force_put_on_a_gridpoint_moves_it_and_rests_on_the_bottom(tmp_path, configs):
    data = tomllib.loads((configs / "quick_slope.toml").read_text())
    del data["discs"]
    stages = [{"name": "equilibrium", "until": {"steps": 10}}, {"name": "overload", "until": {"ratio": 1e-6, "steps": 9000}}]
    data |= {"window": [], "stage": stages}
    seen = {}

    def push(moment):
        if moment.stage == "equilibrium":
            top = np.argmax(moment.model.grid.xy @ [1e-3, 1.0])  # a gridpoint of the crest, at its right end
            moment.state.applied[top - 2] = 0.0, -1000.0
            seen["point"] = top - 2
        else:
            seen["resting"] = moment.state.force[moment.model.grid.xy[:, 1] == 0.0, 1].sum()

    with colluvium.run(colluvium.Scene(**data), tmp_path / "run", on_stage=push) as run:
        assert run.gridpoints(-1).displacement[seen["point"], 1] < 0.0
    assert seen["resting"] == pytest.approx(-1000.0, rel=1e-3)


def test_functions_cannot_be_called_in_other_processes(tmp_path, configs):
    with pytest.raises(ValueError, match="--plugin FILE"):
        colluvium.run(colluvium.Scene.read(configs / "quick_slope.toml"), tmp_path / "run", in_process=False, on_stage=print)
    assert not (tmp_path / "run").exists()


def test_a_plugin_that_cannot_be_run_ends_the_run_at_once(tmp_path, configs):
    arguments = ["run", configs / "quick_slope.toml", "--plugin", tmp_path / "none.py", "--out", tmp_path / "o"]
    done = run_colluvium(*arguments)
    assert done.returncode == 4
    assert "cannot be run: FileNotFoundError" in done.stderr


def test_what_the_page_names_of_model_and_state_is_there():
    page = (Path(__file__).parents[2] / "docs" / "plugins.md").read_text(encoding="utf-8")
    grid, discs = page[page.index("| grid,") : page.index("| discs,")], page[page.index("| discs,") :]
    for text, model, state in ((grid, GridModel, GridState), (discs, DiscModel, DiscState)):
        names = set(re.findall(r"state\.(\w+)", text))
        assert len(names) >= 5
        assert [name for name in names if not hasattr(state, name) and name not in state.__annotations__] == []
        for name in set(re.findall(r"model\.(\w+)", text)) - {"py"}:
            assert hasattr(model, name) or name in model.__annotations__, name


PILE = {
    "format": 1,
    "seed": 1,
    "window": [{"name": "w", "polygon": [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]}],
    "discs": {"radius": 0.06, "confinement": 5e3, "damping": {"local": 0.7}, "soil": SOIL},
    "stage": [
        {"name": "fill"},
        {"name": "couple", "kind": "discs", "gravity": 9.81, "until": {"steps": 20}},
        {"name": "last", "kind": "discs", "until": {"steps": 20}},
    ],
}
SHAKE = """
def on_stage(moment):
    if moment.stage == "last":
        (moment.state.v if moment.rank else moment.state.velocity)[-1] += 1e-6
"""


@pytest.mark.parametrize("way", ["in process", "two processes", "discs alone"])
def test_a_run_is_resumed_with_its_plugin_or_not_at_all(tmp_path, capsys, way):
    data = PILE if way == "discs alone" else slope_with_a_window()
    if way != "discs alone":
        data["stage"].append({"name": "last", "kind": "load", "until": {"steps": 20}})
    scene, plugin, out = tmp_path / "scene.json", tmp_path / "shake.py", tmp_path / "run"
    scene.write_text(json.dumps(data), encoding="utf-8")
    plugin.write_text(SHAKE, encoding="utf-8")
    more = [] if way == "two processes" else ["--in-process"]

    def called(*words):
        words = [*map(str, words), "--quiet", *more]
        if way == "two processes":
            done = run_colluvium(*words)
            return done.returncode, done.stderr
        return cli.main(words), capsys.readouterr().err

    code, said = called("run", scene, "--out", out, "--plugin", plugin)
    assert code == 0, said
    last = sorted(out.glob("*.last.h5"))
    assert len(last) == (1 if way == "discs alone" else 2)
    for path in last:
        path.rename(tmp_path / path.name)
    code, said = called("resume", out)
    assert code == 4
    assert f"was computed with the plugin {plugin}: give it again (--plugin {plugin})" in said
    code, said = called("resume", out, "--plugin", plugin)
    assert code == 0, said
    assert [differing(path, tmp_path / path.name) for path in last] == [[] for _ in last]
    assert json.loads((out / "run.json").read_text(encoding="utf-8"))["plugin"] == str(plugin)
