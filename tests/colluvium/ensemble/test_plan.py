"""Plans of sweeps: grids, hypercubes, lists."""

import time

import numpy as np
import pytest

from colluvium.ensemble import plan
from coupler_protocol.problems import SceneError


def test_a_grid_has_every_combination_with_every_seed():
    axes = plan.axes_of(["stones.content=0,.15,0.3", "stones.body=clump,cluster", "stones.vertices=[6,8],[6,12]"])
    points = plan.grid(axes, [4, 5])
    assert len(points) == 3 * 2 * 2 * 2
    assert points[1].name == "stones.content = 0, stones.body = clump, stones.vertices = [6, 8], seed 5"
    assert points[-1].values == {"stones.content": 0.3, "stones.body": "cluster", "stones.vertices": [6, 12]}
    assert points[-1].changes == ["stones.content=0.3", "stones.body=cluster", "stones.vertices=[6, 12]", "seed=5"]


def test_a_content_of_zero_leaves_the_table_out():
    """A scene refuses stones of content 0."""
    nothing, some = plan.grid(plan.axes_of(["stones.content=0,0.3"]), [1])
    assert (nothing.left_out, nothing.changes) == (["stones"], ["seed=1"])
    assert (some.left_out, some.changes) == ([], ["stones.content=0.3", "seed=1"])


def test_each_part_of_a_range_has_one_point_of_a_latin_hypercube():
    axes = plan.axes_of(["stones.content=.1..0.5", "discs.radius=0.02,0.03", "stones.gap=0..2e-2"])
    points = plan.hypercube(axes, 8, [1, 2], random=3)
    assert len(points) == 8 * 2 * 2
    assert list(points[0].values) == ["stones.content", "discs.radius", "stones.gap"]
    for key, low, high in (("stones.content", 0.1, 0.5), ("stones.gap", 0.0, 0.02)):
        values = np.unique([point.values[key] for point in points])
        parts = np.floor(8 * (values - low) / (high - low)).astype(int)
        assert parts.tolist() == list(range(8))
    assert points == plan.hypercube(axes, 8, [1, 2], random=3)
    assert points != plan.hypercube(axes, 8, [1, 2], random=4)


def test_a_list_has_a_row_for_each_point(tmp_path):
    path = tmp_path / "points.csv"
    path.write_text("stones.content,stones.body,seed\n.2,clump,7\n\n0.4,cluster,8\n0.4,cluster,8\n")
    points = plan.without_doubles(plan.listed(path, [1, 2]))
    assert [(point.values["stones.content"], point.seed) for point in points] == [(0.2, 7), (0.4, 8)]
    path.write_text("stones.content\n.2\n0.4\n")
    assert [(p.values["stones.content"], p.seed) for p in plan.listed(path, [1, 2])] == [(0.2, 1), (0.2, 2), (0.4, 1), (0.4, 2)]


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("stones.content", "is not of the form KEY=VALUES"),
        ("stones.content=", "has no values"),
        ("stones.content=0.1,0.1", "has a value twice"),
        ("stones.content=0.5..0.1", "LOW < HIGH"),
        ("stones.content=a..b", "'a' is no number"),
        ("stones.content=nan,1", "nan is not finite"),
        ("seed=1,2", "use --seeds"),
    ],
)
def test_what_is_no_axis_is_refused_in_words(text, why):
    with pytest.raises(SceneError, match=why):
        plan.axes_of([text])


def test_all_that_is_wrong_is_said_at_once():
    with pytest.raises(SceneError) as refused:
        plan.axes_of(["a", "b=1,1", "c=1,2", "c=3,4"])
    assert [problem.key for problem in refused.value.problems] == ["a", "b=1,1", "c"]


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("", "has no points"),
        ("stones.content\n", "has no points"),
        ("a,a\n1,2\n", "has a column twice"),
        ("a,b\n1\n", "has 1 values for 2 keys"),
        ("a,seed\n1,x\n", "the seed 'x' is no integer"),
        ("a,b\n1,\n", "has an empty value"),
    ],
)
def test_a_list_that_is_none_is_refused_with_its_line(tmp_path, text, why):
    path = tmp_path / "points.csv"
    path.write_text(text)
    with pytest.raises(SceneError, match=why):
        plan.listed(path, [1])


def test_a_plan_of_10000_points_needs_no_scene():
    """Work, not seconds: a plan is combinations, whose scenes are read later."""
    axes = plan.axes_of([f"a={','.join(map(str, range(10)))}", f"b={','.join(map(str, range(10)))}"])
    begin = time.process_time()
    points = plan.grid(axes, range(100))
    print(f"{time.process_time() - begin:.3f} s")
    assert len(points) == len(plan.without_doubles(points)) == 10_000
