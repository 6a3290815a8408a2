"""Scenes of points, and which of them share their first stages."""

import pytest

from colluvium.ensemble import plan
from colluvium.ensemble.scenes import Scenes, shared_key, shared_stage
from coupler_protocol.problems import SceneError
from tests.integration.short_runs import STONES


@pytest.fixture(scope="module")
def scenes(configs):
    return Scenes(configs / "quick_slope.toml", STONES)


def keys_of(scenes, *texts, seeds=(1,)):
    points = plan.grid(plan.axes_of(texts), seeds)
    return [shared_key(scene, shared_stage(scene)) for scene in scenes.checked(points)]


def test_points_share_the_stages_before_the_discs_if_only_discs_differ(scenes):
    assert shared_stage(scenes.checked([plan.Point({}, 1)])[0]) == 0
    assert len({*keys_of(scenes, "stones.content=0,0.2,0.4", "discs.radius=0.045,0.05", seeds=(1, 2))}) == 1
    assert len({*keys_of(scenes, "material.0.mohr_coulomb.cohesion=4e4,5e4", "stones.content=0,0.2")}) == 2
    assert len({*keys_of(scenes, "stage.0.until.ratio=1e-4,1e-5")}) == 2
    assert len({*keys_of(scenes, "stage.3.gravity_factor.to=3.0,4.0")}) == 1


def test_a_content_of_zero_is_the_scene_without_stones(scenes):
    nothing, some = scenes.checked(plan.grid(plan.axes_of(["stones.content=0,0.2"]), [3]))
    assert nothing.stones is None
    assert some.stones.content == 0.2
    assert nothing.seed == some.seed == 3


def test_problems_of_all_points_are_said_at_once(scenes):
    with pytest.raises(SceneError) as refused:
        scenes.checked(plan.grid(plan.axes_of(["stones.content=0.2,2", "discs.radius=0.045,-1", "nonsense=1,2"]), [1, 2]))
    assert {problem.key for problem in refused.value.problems} == {"stones.content", "discs.radius", "nonsense"}


def test_discs_alone_share_nothing(configs):
    scene = Scenes(configs / "quick_biaxial.toml", ()).checked([plan.Point({}, 1)])[0]
    assert shared_stage(scene) is None
