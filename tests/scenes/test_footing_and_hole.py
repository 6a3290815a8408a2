"""configs/footing.toml and configs/hole.toml: run as a user would, against closed forms."""

import numpy as np
import pytest

from colluvium import open_run
from tests.commands import run_colluvium


@pytest.fixture(scope="module")
def folders(tmp_path_factory, configs):
    """Run directories of the two scenes, computed from the command line."""
    out = tmp_path_factory.mktemp("shipped")
    for name, how in (("footing", []), ("hole", ["--in-process"])):
        done = run_colluvium("run", configs / f"{name}.toml", "--out", out / name, "--quiet", *how)
        assert done.returncode == 0, done.stderr
    return out


def test_bearing_capacity(folders):
    """Prandtl (1921): (2 + pi) c; the footing pushes on half a zone beyond its edge."""
    with open_run(folders / "footing") as run:
        steps, force = run.history("reaction_y:footing")
        across = run.history("reaction_x:footing")[1][-1]
        moved, settlement = run.history("moved_y:footing")
        carried = run.history("reaction_y:bottom")[1][-1]
    assert moved.tolist() == steps.tolist()
    assert settlement[-1] == pytest.approx(-1e-5 * (0.5 * 501 + 3500), rel=1e-9)  # at full speed after 500 steps
    pressure = -force / (1.0 + 0.125 / 2) / 0.1e6
    assert 0.0 < pressure[-1] / (2 + np.pi) - 1 < 0.03
    assert pressure[steps > 3500].std() < 5e-3  # it flows
    assert carried == pytest.approx(-force[-1], rel=1e-3)
    assert abs(across) < 0.1 * abs(force[-1])


def test_stress_around_a_hole(folders):
    """Kirsch (1898) under p in x: with k = a2/r2, radial -p/2 [(1 - k) + (1 - 4k + 3k2) cos 2t],
    tangential -p/2 [(1 + k) - (1 + 3k2) cos 2t], shear p/2 (1 + 2k - 3k2) sin 2t."""
    with open_run(folders / "hole") as run:
        (x, y), (xx, yy, _, xy), rows = run.zones(-1).xy.T, run.zones(-1).stress.T, run.info["stages"]
        moved = [run.gridpoints(i).displacement for i, frame in enumerate(run.frames) if frame.stage == "before"]
    assert np.abs(moved[-1]).max() < 1e-15  # in equilibrium from the first step
    assert rows[1]["ended_by"].startswith("ratio")
    assert rows[1]["reactions"]["left"]["x"] == pytest.approx(30.0 * 30e6, rel=1e-4)
    k, t = 1 / (x**2 + y**2), np.arctan2(y, x)
    radial = -15e6 * ((1 - k) + (1 - 4 * k + 3 * k**2) * np.cos(2 * t))
    tangential = -15e6 * ((1 + k) - (1 + 3 * k**2) * np.cos(2 * t))
    c, s = np.cos(t), np.sin(t)
    found = xx * c**2 + yy * s**2 + 2 * xy * s * c, xx * s**2 + yy * c**2 - 2 * xy * s * c
    at = np.argmin(np.hypot(x, y - 2.0))
    assert found[1][at] == pytest.approx(tangential[at], rel=0.02)
    assert found[1][at] == pytest.approx(-36.5625e6, rel=0.03)
    assert found[0][at] == pytest.approx(radial[at], rel=0.02)
    near = np.hypot(x, y) < 5.0
    error = np.sqrt(np.mean((found[0] - radial)[near] ** 2 + (found[1] - tangential)[near] ** 2))
    assert error < 0.01 * 30e6


@pytest.mark.long
@pytest.mark.parametrize("name", ["footing", "hole"])
def test_grids_without_a_profile_are_drawn(folders, tmp_path, name):
    pytest.importorskip("matplotlib")
    pytest.importorskip("cmcrameri")
    done = run_colluvium("report", folders / name, "--out", tmp_path)
    assert done.returncode == 0, done.stderr
    drawn = {path.name for path in tmp_path.iterdir()}
    assert {"mesh.png", "stress.png", "displacement.png", "histories.png", "report.html"} <= drawn
