"""Scenes without a grid, from the scene to the files: laboratory cases with closed forms, piles, restart, refusals."""

import json

import numpy as np
import pytest
from verification.discrete import collision, incline
from verification.discrete.scenes import SOIL, disc_file

import colluvium
from colluvium import closing
from colluvium.forecast import check
from colluvium.results import export
from colluvium.results.run import open_run
from colluvium.running import processes
from colluvium.running.threads import run
from coupler_protocol.exits import PHYSICS, EnvironmentFailed, Interrupted, PhysicsFailed
from coupler_protocol.files import disc_csv as disc_files
from coupler_protocol.files.checkpoint import load
from coupler_protocol.files.restart import Origin
from coupler_protocol.problems import SceneError
from coupler_protocol.process.plugin import Plugin
from coupler_protocol.scene.reader import build_scene
from dem_server.packing.alone_window import fill
from dem_server.pairs import contacts
from dem_server.step.contact_pass import contact_forces
from tests.commands import run_colluvium
from tests.integration.measured_frames import assert_histories_are_those_of_frames

G, R = 9.81, 0.03
GROUND = {"ends": [[-2.0, 0.0], [4.0, 0.0]]}


def scene_of(stages, window=True, stones=None, **discs):
    """A scene of discs alone: a small block, or what `file` holds."""
    data = {
        "format": 1,
        "seed": 3,
        "record": {"every": 500, "history": 20},
        "discs": {"radius": 0.05, "confinement": 5e3, "soil": SOIL} | discs,
        "stage": [{"name": "fill"}, *stages],
    }
    if window:
        data["window"] = [{"name": "block", "polygon": [[0.0, 0.0], [0.0, 0.9], [0.9, 0.9], [0.9, 0.0]]}]
    return data | ({"stones": stones} if stones else {})


def computed(data, out):
    out.mkdir()
    run(build_scene(data), out)
    return open_run(out)


def test_restitution_from_a_scene():
    """No tension, beta = .1: e = .7441."""
    speed, seconds = collision.of_scene(0.1)
    assert speed == pytest.approx(0.7441, abs=1e-4)
    assert seconds == pytest.approx(2e-3, rel=1e-3)


@pytest.mark.parametrize(("friction", "expected"), [(0.3, 3.27), (0.1, 4.0554)])
def test_incline_from_a_scene(friction, expected):
    assert incline.of_scene(friction) == pytest.approx(expected, rel=1e-4)


PILE = [
    {"name": "settle", "kind": "discs", "gravity": G, "damping": {"local": 0.7}, "until": {"ratio": 1e-3, "steps": 60000}},
    {"name": "shake", "kind": "discs", "time": "real", "until": {"time": 0.01}},
    {"name": "rest", "kind": "discs", "damping": {"local": 0.7}, "until": {"steps": 200}},
]
WALLS = [GROUND, {"ends": [[0.0, 0.0], [0.0, 3.0]]}, {"ends": [[0.9, 0.0], [0.9, 3.0]]}]


@pytest.fixture(scope="module")
def pile(tmp_path_factory):
    out = tmp_path_factory.mktemp("pile") / "run"
    data = scene_of(PILE, wall=WALLS) | {"measure": [{"name": "heap", "centre": [0.42, 0.4], "radius": 0.38}]}
    data["record"]["measure"] = 300
    computed(data, out).close()
    return data, out


def test_a_pile_between_walls_comes_to_rest(pile):
    _, out = pile
    with open_run(out) as found:
        assert found.info["exit_code"] == 0
        settled = found.info["stages"][1]
        assert settled["ended_by"].startswith("ratio")
        last = max(i for i, frame in enumerate(found.frames) if frame.stage == "settle")
        discs = found.discs(last)
        weight = 2000.0 * np.pi * (discs.radius**2).sum() * G
        steps, force = found.history("wall_force_y", 1)
        assert -force[steps <= found.frames[last].step][-1] == pytest.approx(weight, rel=1e-2)
        assert (discs.xy[:, 0] > 0.8 * discs.radius).all()
        assert (discs.xy[:, 1] > 0.8 * discs.radius).all()
        for name in ("kinetic_energy", "elastic_energy", "weight_energy", "time"):
            assert np.isfinite(found.history(name, 1)[1]).all()


def test_regions_are_measured_as_frames_are(pile):
    """Also beside walls; at rest the vertical stress is of the order of the weight above."""
    with open_run(pile[1]) as found:
        assert assert_histories_are_those_of_frames(found, {"heap": (0.42, 0.4, 0.38)}) > 5
        steps, stress = found.history("stress_yy:heap")
        settled = stress[steps == found.frames[found.last_frame("settle")].step][0]
        height = found.discs(-1).xy[:, 1].max()
        assert 0.4 < settled / (-2000.0 * 0.85 * G * (height - 0.4)) < 1.6
        assert (
            not set(steps.tolist())
            - {n for n in range(steps[-1] + 1) if n % 300 == 0 or n % 500 == 0}
            - {found.frames[found.last_frame(stage)].step for stage in found.stages}
        )


def test_going_on_from_a_stage_gives_the_same_bits(pile, tmp_path):
    data, out = pile
    run(build_scene(data), tmp_path, origin=Origin(out, "settle"))
    for stage in ("shake", "rest"):
        one, other = (load(folder / f"dem.rank1.{stage}.h5")[0]["discs"] for folder in (out, tmp_path))
        for name in ("disc", "load", "shear"):
            assert one[name].tobytes() == other[name].tobytes()
        assert one["walls"]["shear"].tobytes() == other["walls"]["shear"].tobytes()


def test_a_process_of_its_own_gives_the_same_bits(pile, tmp_path):
    data, out = pile
    scene = build_scene(data)
    path = tmp_path / "scene.toml"
    path.write_text(processes.as_toml(scene.model_dump(mode="json", exclude_none=True)), encoding="utf-8")
    assert processes.run_files(path, tmp_path / "run", processes.windows_of(scene), ["--quiet"]) == 0
    one, other = (load(folder / "dem.rank1.rest.h5")[0]["discs"]["disc"] for folder in (out, tmp_path / "run"))
    assert one.tobytes() == other.tobytes()


def test_a_plugin_is_called(tmp_path):
    seen = []
    plugin = Plugin("test", on_step=lambda m: seen.append(m.step), on_stage=lambda m: seen.append(m.stage), every=7)
    data = scene_of([{"name": "go", "kind": "discs", "until": {"steps": 20}}])
    run(build_scene(data), tmp_path, plugin=plugin)
    assert seen == ["fill", 7, 14, "go"]


def test_stones_and_bonds(tmp_path):
    grain = SOIL | {"density": 2700.0, "spring": {"normal": 5e8, "shear": 5e8}}
    size = {"mean": 0.3, "sigma": 0.2, "min": 0.2, "max": 0.4}
    stage = {"name": "fall", "kind": "discs", "time": "real", "gravity": G, "until": {"time": 0.02}}
    data = scene_of([stage], stones={"content": 0.3, "size": size}, stone=grain, wall=[GROUND])
    with computed(data, tmp_path / "run") as found:
        assert (found.discs(-1).stone >= 0).any()
        assert len(found.stones()) > 0


def test_discs_that_fly_apart_end_with_code_6(tmp_path):
    """Two discs that hit each other at 1e7 m/s: no sensible step."""
    file = disc_file(tmp_path, [[0.0, 0.0, R, 1e7, 0.0, 0.0], [2.0 * R, 0.0, R, -1e7, 0.0, 0.0]])
    stage = {"name": "burst", "kind": "discs", "time": "real", "until": {"time": 1.0}}
    with pytest.raises(PhysicsFailed, match="too fast"):
        computed(scene_of([stage], window=False, file=file), tmp_path / "run")
    info = json.loads((tmp_path / "run" / "run.json").read_text(encoding="utf-8"))
    assert info["exit_code"] == PHYSICS
    assert [(row["name"], row["ended_by"]) for row in info["stages"]] == [("fill", ""), ("burst", "")]
    assert (tmp_path / "run" / "dem.rank1.stopped.h5").exists()


STAGE = {"name": "go", "kind": "discs", "until": {"steps": 1}}
MOVING = {"radius": 0.1, "soil": SOIL, "wall": [GROUND | {"velocity": [0.0, 0.1]}]}


CORE = {"name": "core", "centre": [0.45, 0.45], "radius": 0.4}


@pytest.mark.parametrize(
    ("change", "why"),
    [
        ({"window": []}, "discs alone fill one window"),
        ({"window": [{"name": "w", "columns": [1, 2], "rows": [1, 2]}]}, "columns and rows need a grid"),
        ({"boundary": [{"on": "left", "fix": "x"}]}, "this needs a grid"),
        ({"record": {"trace": 10}}, "nothing to wait for"),
        ({"measure": [CORE, CORE]}, "two regions are named 'core'"),
        ({"measure": [CORE | {"centre": [0.8, 0.5]}]}, "'core' reaches out of window 'block'"),
        ({"measure": [{"name": "p", "polygon": [[0.1, 0.1], [0.8, 0.8], [0.8, 0.1], [0.1, 0.8]]}]}, "crosses or touches itself"),
        ({"measure": [CORE | {"polygon": [[0.1, 0.1], [0.8, 0.1], [0.5, 0.8]]}]}, "centre and radius, or a polygon"),
        ({"measure": [CORE | {"radius": 0.1}]}, "smaller than 4 discs"),
        ({"measure": [CORE | {"window": "other"}]}, "no window is named 'other'"),
        ({"stage": [STAGE]}, "put it first"),
        ({"stage": [{"name": "fill"}, {"name": "couple", "until": {"steps": 1}}]}, "needs a grid"),
        ({"stage": [{"name": "fill"}, STAGE | {"until": {"time": 1.0}}]}, "no seconds"),
        ({"stage": [{"name": "fill"}, {"name": "go", "kind": "discs"}]}, "never end"),
        ({"stage": [{"name": "fill"}, STAGE | {"until": {"band": "complete"}}]}, "band"),
        ({"discs": MOVING, "stage": [{"name": "fill"}, STAGE, STAGE | {"name": "b", "time": "real"}]}, "m a step"),
        ({"discs": {"radius": 0.1, "soil": SOIL, "wall": [{"ends": [[0.0, 0.0], [0.0, 0.0]]}]}}, "same point"),
    ],
)
def test_what_discs_alone_refuse(change, why):
    with pytest.raises(SceneError, match=why):
        build_scene(scene_of([STAGE]) | change)


def test_check_reads_the_file_of_discs(tmp_path):
    with pytest.raises(SceneError, match="'radius' is missing"):
        build_scene(scene_of([STAGE], window=False, file=disc_file(tmp_path, [[0.0, 0.0]], "x,y")))
    with pytest.raises(SceneError, match="there is no file"):
        build_scene(scene_of([STAGE], window=False, file=str(tmp_path / "none.csv")))
    scene = build_scene(scene_of([STAGE], window=False, file=disc_file(tmp_path, [[0.0, 0.0, R]], "x,y,radius")))
    assert check.describe(scene)["file"]["discs"] == 1


def test_all_problems_of_a_file_are_told_before_anything_is_written(tmp_path):
    """A bad file leaves the results of the run before it alone, and two mistakes are two problems."""
    overlapping = [[0.0, 0.0, R], [0.5 * R, 0.0, R], [3.0, 0.01, R]]
    scene = scene_of([STAGE | {"time": "real"}], window=False, file=disc_file(tmp_path, overlapping, "x,y,radius"))
    scene["discs"]["wall"] = [{"ends": [[2.0, 0.0], [4.0, 0.0]]}]
    with pytest.raises(SceneError) as told:
        build_scene(scene)
    assert len(told.value.problems) == 2
    assert "burst apart" in str(told.value)
    assert "disc 3 overlaps wall 1 by 0.6" in str(told.value)
    path, out = tmp_path / "scene.json", tmp_path / "run"
    path.write_text(json.dumps(scene))
    out.mkdir()
    (out / "dem.rank1.vtkhdf").write_text("earlier results")
    done = run_colluvium("run", path, "--out", out, "--force")
    assert done.returncode == 3
    assert [file.name for file in out.iterdir()] == ["dem.rank1.vtkhdf"]


def test_a_file_of_a_spreadsheet(tmp_path):
    """A mark of byte order is no part of a name; semicolons are told as such."""
    (tmp_path / "a.csv").write_text(f"x,y,radius\n0,0,{R}\n", encoding="utf-8-sig")
    assert len(disc_files.read(tmp_path / "a.csv").radius) == 1
    (tmp_path / "b.csv").write_text(f"x;y;radius\n0;0;{R}\n")
    with pytest.raises(SceneError, match="semicolons"):
        disc_files.read(tmp_path / "b.csv")


def contacts_of(scene_tables):
    """Positions, radii and contacts of the discs of a scene after the first force pass."""
    model, state, _, _ = fill(build_scene(scene_tables), lambda *_: None)
    contact_forces(model, state)
    pairs = contacts(state)
    return state.x.copy(), state.radius.copy(), pairs.disc_a, pairs.disc_b, pairs.gap


def test_exported_discs_come_back_with_the_same_bits(pile, tmp_path):
    data, out = pile
    assert export.write(out, stage="fill", out=tmp_path / "discs.csv") > 50
    file = {key: value for key, value in data.items() if key != "window"}
    file["discs"] = data["discs"] | {"file": str(tmp_path / "discs.csv")}
    for before, after in zip(contacts_of(data), contacts_of(file), strict=True):
        assert before.tobytes() == after.tobytes()


def test_exported_motion_and_stones(tmp_path):
    """Velocities come from stages in real time only; stones keep their numbers."""
    grain = SOIL | {"density": 2700.0}
    rows = [[0.0, 1.0, R, 0.5, 0.0, 2.0], [2.0 * R, 1.0, R, 0.5, 2.0 * 2.0 * R, 2.0], [1.0, 1.0, R, 0.0, 0.0, 0.0]]
    path = tmp_path / "in.csv"
    lines = ["x,y,radius,vx,vy,spin,stone", *(f"{','.join(map(repr, row))},{k}" for row, k in zip(rows, (0, 0, -1), strict=True))]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    stages = [{"name": "fly", "kind": "discs", "time": "real", "until": {"time": 1e-3}}]
    stages += [{"name": "stop", "kind": "discs", "until": {"steps": 1}}]
    with computed(scene_of(stages, window=False, file=str(path), stone=grain), tmp_path / "run") as found:
        last = found.discs(found.last_frame("fly"))
        export.write(tmp_path / "run", stage="fly", out=tmp_path / "fly.csv")
        read = disc_files.read(tmp_path / "fly.csv")
        assert read.motion.tobytes() == np.column_stack([last.velocity, last.spin]).tobytes()
        assert read.stone.tolist() == [0, 0, -1]
        assert read.motion[1, 2] == pytest.approx(2.0, rel=1e-9)
    export.write(tmp_path / "run", out=tmp_path / "stop.csv")
    assert not disc_files.read(tmp_path / "stop.csv").motion.any()


def test_a_stage_in_real_time_ends_on_time(tmp_path):
    """Free fall for .01 s from rest: g t^2 / 2 whatever the length of the steps, though no whole number of them fits."""
    file = disc_file(tmp_path, [[0.0, 1.0, R, 0.0, 0.0, 0.0]])
    stage = {"name": "fall", "kind": "discs", "time": "real", "gravity": G, "until": {"time": 0.01}}
    with computed(scene_of([stage], window=False, file=file), tmp_path / "run") as found:
        row = found.info["stages"][1]
        assert row["seconds_simulated"] == pytest.approx(0.01, rel=1e-9)
        fallen = 1.0 - found.discs(-1).xy[0, 1]
        assert fallen == pytest.approx(0.5 * G * 0.01**2, rel=1e-9)
        assert found.frames[-1].time == pytest.approx(0.01, rel=1e-9)
        assert found.history("kinetic_energy")[0].size > 0  # the only rank there is


def test_the_closing_table_of_discs_alone(tmp_path):
    file = disc_file(tmp_path, [[0.0, 1.0, R, 0.0, 0.0, 0.0]])
    stages = [{"name": "rest", "kind": "discs", "until": {"steps": 3}}]
    stages += [{"name": "fall", "kind": "discs", "gravity": G, "until": {"steps": 3}}]
    with computed(scene_of(stages, window=False, file=file), tmp_path / "run") as found:
        assert [row[3] for row in closing.rows(found.info)] == ["", "none", "1.00 g"]
        first = next(closing.sentences(found.info))
        assert "1 discs" in first
        assert "ring" not in first


@pytest.mark.parametrize("name", ["functions", "look.py"])
def test_a_run_with_a_plugin_names_it_and_does_not_lose_it_in_silence(tmp_path, caplog, name):
    file = disc_file(tmp_path, [[0.0, 1.0, R, 0.0, 0.0, 0.0]])
    stages = [{"name": stage, "kind": "discs", "gravity": G, "until": {"steps": 3}} for stage in ("fall", "go")]
    seen, out = [], tmp_path / "run"
    out.mkdir()

    def look(moment):
        seen.append((moment.stage, moment.step))
        if len(seen) == 5:
            raise Interrupted("enough")

    with pytest.raises(Interrupted):
        run(build_scene(scene_of(stages, window=False, file=file)), out, plugin=Plugin(name, look))
    info = json.loads((out / "run.json").read_text(encoding="utf-8"))
    assert info["plugin"] == name
    assert [row["name"] for row in info["stages"]] == ["fill", "fall", "go"]
    if name == "look.py":
        with pytest.raises(EnvironmentFailed, match=r"computed with the plugin look.py: give it again \(--plugin look.py\)"):
            colluvium.resume(out)
        assert (out / "run.json").exists()
        kept = {"on_step": (1, look)}
    else:
        kept = {}
    with colluvium.resume(out, **kept) as found:
        (before,) = found.info["attempts"]
        assert (before["plugin"], before["exit_code"], before["reason"]) == (name, 130, "enough")
        assert found.info.get("plugin") == ("functions" if kept else None)
    assert ("the run goes on without them" in caplog.text) == (not kept)
    assert len(seen) == (8 if kept else 5)
