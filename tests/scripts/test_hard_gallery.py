"""scripts/studies/hard_gallery.py: the naive scheme fails in every panel, this project does not."""

import json

import pytest

hard_gallery = pytest.importorskip("hard_gallery")
pytestmark = [pytest.mark.long, pytest.mark.trial]


@pytest.fixture(scope="module")
def panels(tmp_path_factory):
    """Panels of the fast run."""
    pytest.importorskip("matplotlib")
    folder = tmp_path_factory.mktemp("gallery")
    hard_gallery.main(["--fast", "--json", str(folder / "panels.json"), "--picture", str(folder / "picture.png")])
    assert (folder / "picture.png").stat().st_size > 10_000
    return {panel["naive"]: panel["curves"] for panel in json.loads((folder / "panels.json").read_text())}


def test_there_are_ten(panels):
    assert len(panels) == 10


@pytest.mark.parametrize("naive", ["no mass rule at the rim", "step 1 % above the limit"])
def test_speeds_grow_without_a_rule_and_stay_bounded_with_it(panels, naive):
    (_, bad), (_, good) = panels[naive]
    assert max(bad) > 1e4
    assert max(good) < 20.0


@pytest.mark.parametrize(
    ("naive", "growth"),
    [("forces one step late", 1.05), ("forces held over ten steps", 1.3), ("the last force acts again", 1.002)],
)
def test_a_body_keeps_its_energy_only_with_the_forces_of_its_step(panels, naive, growth):
    (_, bad), (_, good) = panels[naive]
    assert bad[-1] > growth
    assert max(abs(value - 1.0) for value in good) < 1e-4


def test_discs_pass_through_each_other_without_lists_and_guards(panels):
    """The sign of the distance changes."""
    for naive in ("the list of pairs is not renewed", "no guard: discs pass"):
        (_, bad), (_, good) = panels[naive]
        assert min(bad) < 0.0 < min(good)


def test_stones_switched_on_store_no_more_than_before(panels):
    (_, bad), (_, good) = panels["contacts lose their reference"]
    assert max(good) <= 1.0
    assert min(bad) > 100.0
