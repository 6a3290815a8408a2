"""configs/quick_excavation.toml and quick_surcharge.toml, branched off the coupled state of quick_slope.toml."""

import numpy as np
import pytest

from colluvium import open_run
from coupler_protocol.files import checkpoint
from tests.commands import run_colluvium

WEIGHT = 2700.0 * 9.81  # of the soil [N/m3]


@pytest.fixture(scope="module")
def outcome(tmp_path_factory, configs, quick_run):
    """A function of (scene, stage): change of the force on the bottom [N], and displacements since the coupled state by place."""

    def compute(scene, stage):
        out, before = tmp_path_factory.mktemp(scene) / "run", quick_run[0]
        arguments = ["run", configs / f"{scene}.toml", "--out", out, "--from", f"{before}@couple", "--in-process", "--quiet"]
        done = run_colluvium(*arguments)
        assert done.returncode == 0, done.stderr
        with open_run(out) as run:
            assert run.info["stages"][-1]["ended_by"].startswith("ratio")
            first, last = run.gridpoints(run.last_frame("couple")), run.gridpoints(-1)
            xy, moved = last.xy, last.displacement - first.displacement
        bottom = xy[:, 1] == 0.0
        forces = [
            -checkpoint.load(path)[0]["grid"]["force"][bottom, 1].sum()
            for path in (before / "fdm.rank0.couple.h5", out / f"fdm.rank0.{stage}.h5")
        ]
        return forces[1] - forces[0], lambda x, y: moved[np.argmin(np.hypot(*(xy - [x, y]).T))]

    return compute


def test_the_pit(outcome):
    """The bottom is relieved of the weight of the six zones; the floor of the pit rises by 0.16 mm, its walls move into it."""
    relief, at = outcome("quick_excavation", "pit")
    assert relief == pytest.approx(-6 * (2 / 3) ** 2 * WEIGHT, rel=3e-3)
    assert at(2.0, 8 / 3)[1] == pytest.approx(1.6e-4, rel=0.1)
    assert at(10 / 3, 4.0)[0] < -3e-4 < 0.0 < at(4 / 3, 4.0)[0]


def test_the_load_on_the_crest(outcome):
    """The bottom carries 3 m x 100 kPa more; below the load the ground settles by 1.2 mm (a column: p H/A1 = 1.7 mm)."""
    load, at = outcome("quick_surcharge", "load")
    assert load == pytest.approx(3.0 * 100e3, rel=1e-3)
    assert at(44 / 3, 12.0)[1] == pytest.approx(-1.2e-3, rel=0.05)
    assert abs(at(2.0, 4.0)[1]) < 1e-4
