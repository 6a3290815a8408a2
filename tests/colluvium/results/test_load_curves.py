"""Load-settlement and stress-strain curves are those of the recorded histories, over a true time axis; rates have true units."""

import json
import re

import numpy as np
import pytest

from colluvium.figures import histories
from colluvium.figures import load_curves as figure
from colluvium.html.histories import Axis, plots
from colluvium.html.packing import Packing
from colluvium.results import clock, load_curves
from colluvium.results.run import open_run
from coupler_protocol.files.recorder import FrameInfo, Recorder

BOX = [[-0.3, 0.0], [1.3, 0.0]], [[-0.3, 2.0], [1.3, 2.0]], [[0.0, -0.3], [0.0, 2.3]], [[1.0, -0.3], [1.0, 2.3]]
WALLS = dict(zip(("bottom", "top", "left", "right"), BOX, strict=True))


def record_biaxial(folder):
    """Static pressing, then a real-time stage of .5 s in which the top comes down by a tenth of the height, then rest."""
    stages = [
        {"name": "fill"},
        {"name": "press", "kind": "discs", "time": "static"},
        {"name": "shorten", "kind": "discs", "time": "real", "wall": [{"name": "top", "velocity": [0.0, -0.4]}]},
        {"name": "rest", "kind": "discs", "time": "static"},
    ]
    walls = [{"name": name, "ends": ends} for name, ends in WALLS.items()]
    (folder / "scene.json").write_text(json.dumps({"discs": {"wall": walls}, "stage": stages}))
    moments = [(0, 0.0, "fill"), (100, 100.0, "press"), (1100, 100.5, "shorten"), (1200, 200.5, "rest")]
    with Recorder(folder / "dem.rank1.vtkhdf", "discrete") as recorder:
        for step in range(0, 1201, 50):
            time = np.interp(step, [m[0] for m in moments], [m[1] for m in moments])
            share = np.clip((step - 100) / 1000, 0.0, 1.0)
            values = {"time": time, "unbalanced_ratio": 1e-3 / (step + 1), "velocity_caps": 0, "bonds_broken": 0}
            for name, ends in WALLS.items():
                x, y = np.mean(ends, axis=0) - ((0.0, 0.2 * share) if name == "top" else (0.0, 0.0))
                values |= {f"wall_x:{name}": x, f"wall_y:{name}": y, f"wall_force_y:{name}": 0.0}
                values[f"wall_pressure:{name}"] = 1e5 * (1.0 + 2.0 * share) if name in ("top", "bottom") else 1e5
            recorder.history(step, **values)
        for step, time, stage in moments:
            recorder.frame(
                FrameInfo(step, time, stage, 1.0),
                points=np.array([[0.2, 0.2], [0.3, 0.2]]),
                cells=np.array([[0, 1]]),
                point_fields={name: np.zeros((2, 2)) for name in ("displacement", "velocity")} | {"radius": np.full(2, 0.05)},
                cell_fields={"normal_force": np.ones(1)},
            )
    return folder


@pytest.fixture(scope="module")
def biaxial(tmp_path_factory):
    with open_run(record_biaxial(tmp_path_factory.mktemp("biaxial"))) as run:
        yield run


def test_stress_over_the_shortening_between_opposite_walls(biaxial):
    (curve,) = load_curves.curves(biaxial)
    assert (curve.title, curve.x_unit, curve.y_unit) == ("stage shorten: wall top", "%", "Pa")
    assert curve.x_label == "shortening between top and bottom"
    np.testing.assert_allclose(curve.x, np.linspace(0.0, 10.0, 21), atol=1e-9)
    assert set(curve.y) == set(WALLS)
    np.testing.assert_allclose(curve.y["top"], 1e5 * (1.0 + 0.2 * curve.x), rtol=1e-9)
    axes = figure.draw(biaxial).axes[0]
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("shortening between top and bottom [%]", "pressure on the walls [kPa]")
    assert max(line.get_ydata().max() for line in axes.lines) == pytest.approx(300.0)


def test_settlement_of_a_boundary_that_is_pressed_down(tmp_path):
    with Recorder(tmp_path / "fdm.rank0.vtkhdf", "continuum") as recorder:
        for step in range(0, 101, 10):
            own = {"moved_y:footing": -1e-4 * step, "reaction_y:footing": -3e3 * step, "moved_x:footing": 0.0}
            recorder.history(step, **own, **{"reaction_x:footing": 7.0, "reaction_y:bottom": 1e6})
        recorder.frame(
            FrameInfo(100, 100.0, "press", 1.0),
            points=np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]),
            cells=np.array([[0, 1, 2, 3]]),
            point_fields={"displacement": np.zeros((4, 2)), "velocity": np.zeros((4, 2))},
            cell_fields={"stress": np.zeros((1, 4)), "shear_strain_rate": np.zeros(1)},
        )
    (tmp_path / "scene.json").write_text(json.dumps({"stage": [{"name": "press", "kind": "load", "time": "static"}]}))
    with open_run(tmp_path) as run:
        (curve,) = load_curves.curves(run)
        assert (curve.x_label, curve.x_unit, curve.y_unit) == ("settlement", "m", "N")
        np.testing.assert_allclose(curve.x, 1e-4 * np.arange(0, 101, 10))
        np.testing.assert_allclose(curve.y["reaction"], 3e7 * curve.x)
        assert (run.units("velocity"), run.units("velocity", 0)) == ("m/s", "m per step")
        assert run.units("shear_strain_rate", 0) == "1 per step"
        assert run.units("stress", 0) == "Pa"
        assert "load [kN] over settlement [mm], boundary footing" in plots(run, Packing())[-1].svg


def test_without_motion_there_is_no_curve(run_folder):
    with open_run(run_folder) as run:
        assert load_curves.curves(run) == []
        assert figure.missing(run) == "no boundary or wall is moved"


def test_parts_of_a_run_have_steps_or_seconds(biaxial):
    parts = clock.parts(biaxial)
    assert [(part.real, part.first, part.last) for part in parts] == [(False, 0, 100), (True, 100, 1100), (False, 1100, 1200)]
    assert [[name for _, name in part.starts] for part in parts] == [["fill", "press"], ["shorten"], ["rest"]]
    np.testing.assert_allclose(clock.places(biaxial, parts[1], np.array([100, 600, 1100])), [0.0, 0.25, 0.5])
    assert clock.places(biaxial, parts[2], np.array([1150])).tolist() == [1150.0]
    labels = [axes.get_xlabel() for axes in histories.draw(biaxial).axes]
    assert [label for label in labels if label] == ["step [-]", "time since step 100 [s]", "step [-]"]
    axis = Axis(biaxial)
    across = axis.of(np.array([0, 50, 100, 600, 1100, 1200]))
    np.testing.assert_allclose(across, [0.0, 1 / 12, 1 / 6, 0.5, 5 / 6, 1.0], atol=1e-12)
    assert "0.4 s" in [words for _, words in axis.ticks()]


def test_histories_that_change_are_drawn_and_no_others(biaxial):
    rows = histories.recorded_rows(biaxial)
    assert [row.words for row in rows] == ["unbalanced force ratio", "pressure on walls"]
    assert {line.words for line in rows[1].lines} == {"top", "bottom"}


def test_files_name_the_unit_of_static_stages(biaxial):
    velocity = biaxial.files[1]._vtk["PointData/velocity"]
    assert (velocity.attrs["unit"], velocity.attrs["unit_static"]) == ("m/s", "m per step")
    assert "unit_static" not in biaxial.files[1]._vtk["PointData/displacement"].attrs
    assert biaxial.units("velocity", 2) == "m/s"
    assert biaxial.units("velocity", 3) == "m per step"


def test_a_ratio_of_zero_has_no_place_on_a_logarithmic_axis(tmp_path):
    """Before the first force the ratio is zero: no line comes up from below the axis."""
    with Recorder(tmp_path / "dem.rank1.vtkhdf", "discrete") as recorder:
        for step, ratio in enumerate((0.0, 0.1, 0.01)):
            recorder.history(50 * (step + 1), unbalanced_ratio=ratio)
        recorder.frame(
            FrameInfo(150, 150.0, "rest", 1.0),
            points=np.zeros((1, 2)),
            cells=np.empty((0, 2), int),
            point_fields={"radius": np.ones(1), "displacement": np.zeros((1, 2))},
            cell_fields={"normal_force": np.empty(0)},
        )
    with open_run(tmp_path) as run:
        axes = histories.draw(run).axes[0]
        (drawn,) = re.findall(r'<polyline points="(.*?)"', plots(run, Packing())[0].svg)
    places = axes.transScale.transform([(50.0, 0.0), (100.0, 0.1)])[:, 1]
    assert np.isfinite(places).tolist() == [False, True]
    assert len(drawn.split(" ")) == 2
