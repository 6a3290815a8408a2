"""Large strain with a window: both sides agree where the rim is, and a zone that turns inside out ends the run cleanly."""

import json

import numpy as np
import pytest

from colluvium import open_run
from coupler_protocol.files import checkpoint
from tests.commands import run_colluvium


def run(configs, out, *overrides):
    """quick_slope.toml in one process, with overrides."""
    sets = [word for pair in overrides for word in ("--set", pair)]
    return run_colluvium("run", configs / "quick_slope.toml", "--out", out, "--in-process", "--quiet", *sets)


def test_the_rim_is_at_the_same_place_for_discs_and_zones(tmp_path, configs):
    """The slope fails at 12 g and moves by half a metre: control discs on gridpoints still sit on them."""
    more = ("stage.3.large_strain=true", "stage.3.gravity_factor.to=12", "stage.3.until.displacement=0.5")
    done = run(configs, tmp_path / "run", *more)
    assert done.returncode == 0, done.stderr
    with open_run(tmp_path / "run") as found:
        grid, discs = found.gridpoints(-1), found.discs(-1)
        ring = discs.control == 1
        drawn, now = (discs.xy - discs.displacement)[ring], discs.xy[ring]
        moved = grid.xy + grid.displacement
        near = [int(np.argmin(np.hypot(*(grid.xy - xy).T))) for xy in drawn]
        on_node = [k for k, n in enumerate(near) if np.hypot(*(grid.xy[n] - drawn[k])) < 1e-9]
        assert len(on_node) == 20
        np.testing.assert_allclose(now[on_node], moved[[near[k] for k in on_node]], atol=1e-11)
        assert np.abs(grid.displacement[[near[k] for k in on_node]]).max() > 0.05
        assert found.info["stages"][-1]["ended_by"].startswith("displacement")
    assert checkpoint.load(tmp_path / "run" / "fdm.rank0.couple.h5")[0]["grid"]["mass"] is None
    assert checkpoint.load(tmp_path / "run" / "fdm.rank0.overload.h5")[0]["grid"]["mass"].min() > 0


def test_an_inverted_zone_ends_both_sides_with_their_states_saved(tmp_path, configs):
    done = run(configs, tmp_path / "run", "grid.large_strain=true", "stage.3.gravity_factor.to=60")
    assert done.returncode == 6
    assert "zones are inverted" in done.stderr
    info = json.loads((tmp_path / "run" / "run.json").read_text())
    assert info["exit_code"] == 6
    assert "the first is zone" in info["reason"]
    for name in ("fdm.rank0.stopped.h5", "dem.rank1.stopped.h5"):
        assert checkpoint.load(tmp_path / "run" / name)[1]["phase"] != "end of step"


@pytest.mark.parametrize(
    ("overrides", "words"),
    [
        (("stage.0.large_strain=true",), "computes in the initial shape"),
        (("stage.0.name=push", "stage.0.kind=locate", "grid.large_strain=true"), "which stage 'push' has changed"),
        (("stage.3.large_strain=false",), "stage[3].large_strain"),
    ],
)
def test_scenes_that_cannot_be_meant(tmp_path, configs, overrides, words):
    done = run(configs, tmp_path / "run", *overrides)
    assert done.returncode == 3
    assert words in done.stderr
