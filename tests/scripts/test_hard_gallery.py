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


def ends(panels, naive):
    """Last values of the naive scheme and of this project."""
    (_, bad), (_, good) = panels[naive]
    return bad[-1], good[-1]


def test_there_are_ten(panels):
    assert len(panels) == 10


@pytest.mark.parametrize("naive", ["no mass rule at the rim", "step 1 % above the limit", "forces one step late"])
def test_what_grows_without_a_rule_stays_bounded_with_it(panels, naive):
    (_, bad), (_, good) = panels[naive]
    assert max(bad) > 30.0 * max(good)
    assert max(good) < 10.0


def test_discs_pass_through_each_other_without_lists_and_guards(panels):
    """The sign of the distance changes."""
    for naive in ("the list of pairs is not renewed", "no guard: discs pass"):
        (_, bad), (_, good) = panels[naive]
        assert min(bad) < 0.0 < min(good)


def test_stones_switched_on_keep_their_energy(panels):
    bad, good = ends(panels, "contacts lose their reference")
    assert good == pytest.approx(1.0, rel=0.2)
    assert abs(bad - 1.0) > 2.0


def test_discs_come_to_rest_about_a_local_origin(panels):
    bad, good = ends(panels, "positions from the origin of UTM")
    assert good < 0.1 * bad
