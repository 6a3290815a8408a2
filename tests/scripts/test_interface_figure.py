"""scripts/studies/interface_figure.py: reflection and restitution at the interface, as predicted."""

import json

import pytest

interface_figure = pytest.importorskip("interface_figure")


@pytest.fixture(scope="module")
def rows(tmp_path_factory):
    """Rows of the fast run."""
    pytest.importorskip("matplotlib")
    folder = tmp_path_factory.mktemp("interface")
    interface_figure.main(["--fast", "--json", str(folder / "rows.json"), "--picture", str(folder / "picture.png")])
    assert (folder / "picture.png").stat().st_size > 10_000
    return json.loads((folder / "rows.json").read_text())


@pytest.mark.parametrize(("panel", "within"), [("impedance", 3e-4), ("impact", 1e-4)])
def test_waves_and_impacts_are_those_of_closed_forms(rows, panel, within):
    own = [row for row in rows if row["panel"] == panel]
    assert len({row["predicted"] for row in own}) == len(own) > 2
    for row in own:
        assert row["measured"] == pytest.approx(row["predicted"], abs=within)


def test_without_the_half_discs_mass_a_short_wave_comes_back_as_its_mass_says(rows):
    without, mass = (
        {row["at"]: row for row in rows if row["panel"] == "pulse" and row["curve"] == curve}
        for curve in ("without it", "half disc's mass at the rim")
    )
    longest = max(without)
    assert without[longest]["measured"] == pytest.approx(without[longest]["predicted"], rel=0.01)
    assert all(mass[width]["measured"] < 0.03 * row["measured"] for width, row in without.items())
