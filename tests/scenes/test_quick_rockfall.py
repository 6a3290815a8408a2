"""configs/quick_rockfall.toml: rocks that lose their bonds; one falls and rolls to rest, its energies explain each other."""

import numpy as np
import pytest

from colluvium import open_run
from tests.commands import run_colluvium

G, BENCH = 9.81, 4.0


@pytest.fixture(scope="module")
def run(tmp_path_factory, configs):
    out = tmp_path_factory.mktemp("rockfall") / "run"
    words = ["--in-process", "--quiet", "--set", "record.energy=true"]
    done = run_colluvium("run", configs / "quick_rockfall.toml", "--out", out, *words)
    assert done.returncode == 0, done.stderr
    with open_run(out) as found:
        yield found


def moved(run, frame):
    """Largest displacement of each rock and of the soil [m], and the positions of the rocks' discs."""
    discs = run.discs(frame)
    rocks = [discs.stone == rock for rock in range(3)]
    size = np.hypot(*discs.displacement.T)
    soil = (discs.stone < 0) & (discs.control == 0)
    return [size[rock].max() for rock in rocks], size[soil].max(), [discs.xy[rock] for rock in rocks]


@pytest.mark.long
def test_rocks_hold_by_their_bonds_and_one_falls_without(run):
    before, soil, places = moved(run, run.last_frame("couple"))
    assert max(*before, soil) < 2e-3
    falls = int(np.argmax([place[:, 1].max() for place in places]))  # the highest
    after, soil, places = moved(run, run.last_frame("rest"))
    assert after[falls] > 5.0
    assert max(size for rock, size in enumerate(after) if rock != falls) < 0.1
    assert soil < 1.0  # the ground that stays bonded; what the rock breaks off slides a little
    assert places[falls][:, 1].min() < BENCH + 0.5
    assert run.info["stages"][-1]["ended_by"].startswith("ratio")


@pytest.mark.long
def test_nothing_is_faster_than_its_height_allows(run):
    for frame in range(run.last_frame("couple") + 1, run.last_frame("fall") + 1):
        discs = run.discs(frame)
        high = np.clip(-discs.displacement[:, 1], 0.0, None)
        speed = np.hypot(*discs.velocity.T)
        assert (speed[discs.stone >= 0] < np.sqrt(2.0 * G * (high[discs.stone >= 0] + 0.1))).all()


@pytest.mark.long
def test_the_ledger_of_the_fall_closes(run):
    begin, end = (run.frames[run.last_frame(name)].step for name in ("couple", "fall"))
    steps, error = run.history("energy_error", 1)
    falling = (steps > begin + 100) & (steps <= end)
    weight, dashpots, friction = (run.history(f"energy_{name}", 1)[1][falling] for name in ("gravity", "dashpots", "friction"))
    assert np.abs(error[falling]).max() < 1e-4 * weight[-1]
    assert dashpots[-1] > 0.2 * weight[-1]
    assert friction[-1] > 0.2 * weight[-1]
