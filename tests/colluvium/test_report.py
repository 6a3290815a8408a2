"""`report.write` draws what was recorded, each figure with its data and nothing else."""

import shutil
import subprocess
import sys

import numpy as np
import pytest

from colluvium import report
from colluvium.figures import frames, stress, style
from colluvium.results.run import open_run

pytest.importorskip("matplotlib")
pytest.importorskip("cmcrameri")


def test_every_figure_of_a_coupled_run_is_drawn(run_folder, tmp_path):
    seen, skipped = [], {}
    paths = report.write(run_folder, tmp_path / "pictures", progress=seen.append, skipped=skipped.setdefault)
    assert set(skipped) == {"mesostructure.png", "timeline.png"}
    assert skipped["timeline.png"].startswith("no trace")
    figures = [name for name, _, _ in report.FIGURES if f"{name}.png" not in skipped]
    assert [p.name for p in paths] == [*(f"{name}.png" for name in figures), "report.html"]
    assert paths == seen
    for path in paths[:-1]:
        assert path.read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"
        assert path.stat().st_size > 20_000


@pytest.mark.parametrize(
    ("file", "drawn"),
    [
        ("dem.rank1.vtkhdf", {"window", "displacement", "force_chains", "displacement_vectors", "fabric", "histories", "report"}),
        (
            "fdm.rank0.vtkhdf",
            {"mesh", "stress", "displacement", "shear_strain_rate", "shear_strain", "plastic_zones", "histories", "report"},
        ),
    ],
)
def test_one_side_alone_is_drawn(run_folder, tmp_path, file, drawn):
    shutil.copy(run_folder / file, tmp_path)
    paths = report.write(tmp_path)
    assert {p.stem for p in paths} == drawn
    assert {p.parent for p in paths} == {tmp_path / "report"}


def test_stress_is_compared_before_and_after_the_discs_come_in(run_folder):
    with open_run(run_folder) as run:
        assert stress.moments(run) == (1, 3)
        figure = stress.draw(run)
        titles = [axes.get_title(loc="left") for axes in figure.axes]
        assert titles[0] == "vertical stress: equilibrium, step 1,000"
        assert titles[1] == "vertical stress: couple, step 3,000"
        labels = [axes.get_ylabel() for axes in figure.axes]
        assert "syy, tension + [kPa]" in labels
        shown = [c.get_clim() for axes in figure.axes[:2] for c in axes.collections if c.get_array() is not None]
        assert len(shown) == 2
        assert len(set(shown)) == 1  # one colour scale


def test_pictures_stop_before_the_slope_runs_away(run_folder):
    """The model is 20 m long; the last frame has moved by .8 m, less than a twentieth of it."""
    with open_run(run_folder) as run:
        assert frames.farthest(run, -1) == pytest.approx(0.8, rel=1e-3)
        assert frames.before_run_out(run) == [0, 1, 2, 3, 4, 5]
        assert frames.of_last_stage(run, 0, 4) == [4, 5]
        assert frames.last_of_stages(run, 1, 4) == [3, 5]


def test_a_run_away_is_left_out(run_folder, monkeypatch):
    monkeypatch.setattr(frames, "REACH", 0.03)
    with open_run(run_folder) as run:
        assert frames.before_run_out(run) == [0, 1, 2, 3, 4]
        assert frames.of_last_stage(run, 0, 4) == [4]
        assert frames.last_of_stages(run, 1, 1) == [4]


@pytest.mark.parametrize(
    ("unit", "largest", "expected"),
    [
        ("Pa", 3.0e5, "kPa"),
        ("Pa", 2.0e6, "MPa"),
        ("m", 0.02, "mm"),
        ("m", 1.5, "m"),
        ("N", 10.0, "N"),
        ("-", 5.0, "-"),
    ],
)
def test_units_a_reader_likes(unit, largest, expected):
    factor, name = style.readable(unit, np.array([0.0, -largest, np.nan]))
    assert name == expected
    assert 0.5 <= factor * largest < 1000.0


def test_importing_the_report_does_not_import_matplotlib():
    code = "import sys, colluvium.report; sys.exit('matplotlib' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
