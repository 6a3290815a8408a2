"""configs/quick_runout.toml: a window over the face of a slope, set free in real time; the first part of its fall."""

import numpy as np
import pytest

from colluvium import open_run
from tests.commands import run_colluvium

DENSITY, G, TIME = 2200.0, 9.81, 0.5


@pytest.fixture(scope="module")
def run(tmp_path_factory, configs):
    out = tmp_path_factory.mktemp("runout") / "run"
    changes = (f"stage.run-out.until={{time={TIME}}}", "stage.rest.until={steps=20}", "record.history=50", "record.energy=true")
    words = [word for change in changes for word in ("--set", change)]
    done = run_colluvium("run", configs / "quick_runout.toml", "--out", out, "--in-process", "--quiet", *words)
    assert done.returncode == 0, done.stderr
    with open_run(out) as found:
        yield found


@pytest.mark.long
def test_bonded_discs_rest_behind_their_free_surface(run):
    """The bottom carries the whole weight, with and without the window; no bond breaks as the discs take over."""
    alone, couple = (next(row for row in run.info["stages"] if row["name"] == name) for name in ("equilibrium", "couple"))
    assert couple["ended_by"].startswith("ratio")
    assert couple["bonds_broken"] == [0]
    assert couple["reactions"]["bottom"]["y"] == pytest.approx(alone["reactions"]["bottom"]["y"], rel=0.01)
    discs = run.discs(run.last_frame("couple"))
    assert np.abs(discs.displacement).max() < 0.02


@pytest.mark.long
def test_without_bonds_the_face_falls_and_gains_no_energy(run):
    """Weights drive it, friction and dashpots take the rest; nothing is faster than g t."""
    last = run.last_frame("run-out")
    discs = run.discs(last)
    free = discs.control == 0
    speed = np.hypot(*discs.velocity[free].T)
    assert 0.3 < speed.max() < 1.02 * G * TIME
    moved = np.hypot(*discs.displacement[free].T)
    assert 0.1 < moved.max() < 0.51 * G * TIME**2
    steps, kinetic = run.history("energy_kinetic", 1)
    falling = (steps > run.frames[run.last_frame("couple")].step + 100) & (steps <= run.frames[last].step)
    weight, friction = (run.history(f"energy_{name}", 1)[1][falling] for name in ("gravity", "friction"))
    released = run.history("energy_stored", 1)[1][falling][0]
    assert np.diff(friction).min() >= 0.0
    assert (kinetic[falling] + friction < weight + released).all()
    assert kinetic[falling][-1] > 0.1 * weight[-1]
    dashpots, error = (run.history(f"energy_{name}", 1)[1][falling] for name in ("dashpots", "error"))
    assert dashpots[-1] > 0.05 * weight[-1]
    assert np.abs(error).max() < 1e-3 * weight[-1]  # the ledger closes
    steps, grid = run.history("energy_error", 0)
    moving = (steps > run.frames[run.last_frame("couple")].step) & (steps <= run.frames[last].step)
    external, shape = (run.history(f"energy_{name}", 0)[1][moving[-len(steps) :]] for name in ("external", "strain"))
    assert np.abs(grid[moving]).max() < 1e-3 * max(np.abs(external).max(), np.abs(shape).max())
    assert run.has_history("energy_shape", 0)
