"""Coupled runs of windows that are no rectangles: they come to rest on both codes, and uniform stress passes them."""

import json

import numpy as np
import pytest

import colluvium
from colluvium import closing
from coupler_protocol.exits import PHYSICS, PhysicsFailed
from tests.commands import run_colluvium
from tests.same_bits import differing
from tests.window_scenes import BOX, CIRCLE, L_SHAPE, RING, SECTOR, STRESS, uniform

SHAPES = {"L": (BOX, L_SHAPE), "circle": (BOX, CIRCLE), "sector": (RING, SECTOR)}


@pytest.mark.parametrize(("shape", "misfit"), [("L", 0.07), ("circle", 0.09), ("sector", 0.17)])
def test_uniform_stress_stays_uniform_round_a_window_of_any_shape(tmp_path, shape, misfit):
    """Elastic ground under one stress everywhere: after the discs have taken over, zones beside the window have kept it.

    misfit: of P / l, rms over the rim's gridpoints. It is the grain of the discs: there are 5 on a segment of L and circle, 3 to
    9 on those of the sector.
    """
    with colluvium.run(colluvium.Scene(**uniform(*SHAPES[shape])), tmp_path / shape) as run:
        couple = run.info["stages"][-1]
        assert couple["ended_by"].startswith("ratio")
        assert max(couple["ratio_continuum"], *couple["ratio_discrete"]) <= 1e-5
        assert couple["bonds_broken"] == [0]
        assert max(couple["traction_difference"]) < misfit
        change = run.zones(-1).stress[:, [0, 1, 3]] - [STRESS["xx"], STRESS["yy"], STRESS["xy"]]
        assert np.sqrt(np.mean(change**2)) < 0.02 * abs(STRESS["yy"])


def test_a_disc_put_outside_the_ring_ends_the_run(tmp_path):
    """Both sides stop with the exit code of physics, say which disc it was, and save their State."""
    moved = {}

    def take_out(moment):
        if moment.rank == 1 and moment.stage == "couple" and not moved:
            disc = moved["disc"] = moment.model.ring + 11
            moment.state.x[disc] = 4.2, 4.0  # in the notch of the L

    scene = colluvium.Scene(**uniform(BOX, L_SHAPE))
    with pytest.raises(PhysicsFailed, match=r"1 disc has left the ring: disc \d+ .* at \(4\.2, ") as ended:
        colluvium.run(scene, tmp_path / "run", on_step=(20, take_out))
    assert ended.value.code == PHYSICS
    assert f"disc {moved['disc']} (radius" in str(ended.value)
    assert json.loads((tmp_path / "run" / "run.json").read_text())["exit_code"] == PHYSICS
    assert (tmp_path / "run" / "dem.rank1.stopped.h5").is_file()
    assert (tmp_path / "run" / "fdm.rank0.stopped.h5").is_file()


@pytest.mark.long
def test_a_stretched_ring_is_warned_of_once_in_its_stage(tmp_path, caplog):
    """A side of the box is pulled in large strain until the ring's gaps are wider than a smallest radius."""
    data = uniform(BOX | {"large_strain": True}, L_SHAPE)
    data["boundary"] = [{"on": "left", "fix": "xy"}, {"on": "bottom", "fix": "y"}, {"on": "top", "fix": "y"}]
    del data["discs"]["soil"]["bond"]
    for stage, steps in zip(data["stage"][::2], (200, 320), strict=True):
        stage["until"] = {"steps": steps}
    pull = {"on": "right", "velocity": {"x": 6e-3, "y": 0.0}, "over": 100}
    data["stage"].append({"name": "pull", "kind": "load", "until": {"steps": 360}, "boundary": [pull]})
    with colluvium.run(colluvium.Scene(**data), tmp_path / "run") as run:
        (opened,) = run.info["windows"][0]["ring_opened"]
        assert opened["stage"] == "pull"
        assert 1.0 < opened["radii"] < 2.0
        xy, discs = np.array(opened["place"]), run.discs(-1)
        assert np.hypot(*(discs.xy[discs.control == 1] - xy).T).min() < 0.3
        said = [text for text in closing.sentences(run.info) if text.startswith("warning: in stage pull a gap")]
    assert said == [
        f"warning: in stage pull a gap of {opened['radii']:.1f} r opened in the ring of window hole at "
        f"({xy[0]:.1f}, {xy[1]:.1f}) m (r: smallest disc radius; a gap of 2 r lets a disc escape)"
    ]
    assert [r.message for r in caplog.records if "the ring has opened" in r.message and "stage pull" in r.message] != []
    assert len([r for r in caplog.records if "the ring has opened" in r.message]) == 1


@pytest.mark.long
def test_two_processes_give_the_bits_of_one_for_an_oblique_l(tmp_path, configs):
    until = {0: 300, 2: 100, 3: 50}
    short = [f"stage.{i}.until.steps={n}" for i, n in until.items()] + ["stage.2.handover=50", "record.every=50"]
    words = ["run", configs / "quick_notch.toml", "--quiet", *(word for pair in short for word in ("--set", pair))]
    for name, more in (("one", ["--in-process"]), ("two", [])):
        done = run_colluvium(*words, *more, "--out", tmp_path / name)
        assert done.returncode == 0, done.stderr
    for name in ("fdm.rank0.vtkhdf", "dem.rank1.vtkhdf", "fdm.rank0.overload.h5", "dem.rank1.overload.h5"):
        assert differing(tmp_path / "one" / name, tmp_path / "two" / name) == [], name
