"""configs/quick_biaxial.toml from the command line: pressures held, and a peak friction angle where eight seeds have it."""

import numpy as np
import pytest

from colluvium import open_run
from tests.commands import run_colluvium


def computed(configs, out, *more):
    done = run_colluvium("run", configs / "quick_biaxial.toml", "--out", out, "--in-process", "--quiet", *more)
    assert done.returncode == 0, done.stderr


@pytest.fixture(scope="module")
def folder(tmp_path_factory, configs):
    out = tmp_path_factory.mktemp("biaxial") / "run"
    computed(configs, out)
    return out


@pytest.fixture
def run(folder):
    with open_run(folder) as opened:
        yield opened


def parts(run, name):
    """A history before and in the stage `shorten`."""
    steps, values = run.history(name)
    pressed = steps <= run.frames[run.last_frame("press")].step
    return values[pressed], values[~pressed]


def test_it_is_pressed_from_all_sides_and_then_from_two(run):
    assert run.info["stages"][1]["ended_by"].startswith("ratio")
    for name in ("top", "left", "right"):
        assert parts(run, f"wall_pressure:{name}")[0][-1] == pytest.approx(1e5, rel=1e-4)
    for name in ("left", "right"):
        pressure = parts(run, f"wall_pressure:{name}")[1]
        assert pressure == pytest.approx(1e5, rel=0.05)
        for part in np.array_split(pressure, 8):  # the sample dilates faster and faster: a servo that lags is 1 % off at the end
            assert part.mean() == pytest.approx(1e5, rel=2e-3)
    before, after = parts(run, "wall_y:top")
    assert before[-1] - after[-1] == pytest.approx(0.1, rel=1e-9)


def test_peak_friction_angle(run):
    """Seeds 1 to 8 give 27.9 to 33.4 degrees, mean 30.7, deviation 1.7; here seed 1, within three deviations."""
    axial, side = parts(run, "wall_pressure:top")[1], parts(run, "wall_pressure:left")[1]
    peak = np.degrees(np.arcsin(((axial - side) / (axial + side)).max()))
    assert 25.6 < peak < 35.8


def test_walls_carry_what_the_discs_do(run):
    """Smooth walls opposite each other carry the same force, as nothing else pushes: slow enough for 20 %, on average for 1 %."""
    top, bottom = parts(run, "wall_force_y:top")[1], parts(run, "wall_force_y:bottom")[1]
    assert np.abs(top + bottom).max() < 0.2 * top.max()
    assert np.abs((top + bottom).mean()) < 0.01 * top.mean()


def test_the_core_has_the_pressure_of_the_walls(run):
    """At the end of the press, within three standard errors of the vertical stress.

    Every full section between smooth walls has the force of the upper wall; along the height, the horizontal stress varies.
    """
    steps, _ = run.history("stress_yy:core")
    values = {name: run.history(f"{name}:core")[1] for name in ("stress_xx", "stress_yy", "porosity", "coordination", "bodies")}
    errors = {name: run.history(f"{name}_error:core")[1] for name in ("stress_xx", "stress_yy")}
    pressed = steps.tolist().index(run.frames[run.last_frame("press")].step)
    assert abs(values["stress_yy"][pressed] + 1e5) < 3.0 * errors["stress_yy"][pressed]
    for error in errors.values():
        assert 1e3 < error[pressed] < 3e4
    strip = [[-0.1, 0.6], [1.1, 0.6], [1.1, 1.4], [-0.1, 1.4]]
    walls = [run.history(f"wall_x:{name}")[1][-1] for name in ("left", "right")]
    with pytest.warns(UserWarning, match="counts the rest as 0"):
        section = run.average_stress(-1, strip)[1] * 1.2 / (walls[1] - walls[0])
    assert section == pytest.approx(-run.history("wall_pressure:top")[1][-1], rel=0.02)
    assert 0.13 < values["porosity"][pressed] < 0.2
    assert values["porosity"][-1] > values["porosity"][pressed]  # it dilates
    assert values["coordination"][-1] < values["coordination"][pressed]
    assert 80 < values["bodies"][pressed] < 130


def test_the_stress_is_that_of_fabric_and_forces(run):
    """The identity explains the mobilised sine but for what the sizes of discs and higher orders leave."""
    found = run.stress_force_fabric(-1)
    assert 0.25 < found.sine < 0.6
    assert abs(found.residual) < 0.05 * found.sine
    assert abs(found.theta - 90.0) < 8.0
    assert abs(found.fabric.theta_n - 90.0) < 12.0
    assert min(found.fit_n, found.fit_t) > 0.6
    chains = run.force_chains(-1)
    assert 0.2 < chains.share < 0.7
    assert abs(chains.direction - 90.0) < 12.0


def test_servos_go_on_from_a_stage_with_the_same_bits(run, folder, configs, tmp_path):
    computed(configs, tmp_path / "on", "--from", f"{folder}@press", "--set", "stage.shorten.until.steps=500")
    with open_run(tmp_path / "on") as other:
        for name in ("wall_pressure:top", "wall_force_x:left", "wall_x:right", "unbalanced_ratio"):
            steps, values = other.history(name)
            before, straight = run.history(name)
            assert len(steps) == 10
            assert values.tobytes() == straight[np.isin(before, steps)].tobytes()
