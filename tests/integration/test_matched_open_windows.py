"""A window at the surface whose packing has the stiffness of its zones is hardly felt: from 1 to 2 g, at crest, toe and face."""

import numpy as np
import pytest

from tests.integration.matched_windows import felt, lattice, tables
from tests.integration.test_open_windows import PLACES


def test_lattice_discs_touch_six_and_stay_clear_of_an_oblique_outline():
    outline = np.array(PLACES["crest"])
    discs = lattice(outline, 0.05)
    apart = np.hypot(*(discs[:, None, :2] - discs[None, :, :2]).transpose(2, 0, 1))
    assert np.max(np.sum(apart < 2.001 * 0.05, axis=1)) == 7  # and itself
    assert np.median(np.sum(apart < 2.001 * 0.05, axis=1)) == 7
    assert len(discs) * 2.0 * np.sqrt(3.0) * 0.05**2 > 0.8 * 11.5


@pytest.mark.long
@pytest.mark.parametrize(("place", "most"), [("crest", 0.02), ("toe", 0.04), ("face", 0.03)])
def test_a_matched_window_is_hardly_felt(tmp_path, configs, place, most):
    difference, _ = felt(tables(configs, PLACES[place], 0.05, tmp_path), tmp_path)
    assert difference < most


@pytest.mark.long
def test_a_window_ten_times_softer_is_felt(tmp_path, configs):
    difference, _ = felt(tables(configs, PLACES["toe"], 0.05, tmp_path, share=0.1), tmp_path)
    assert difference > 0.1


@pytest.mark.long
def test_a_matched_window_in_large_strain_is_hardly_felt(tmp_path, configs):
    """Ground a hundred times softer, which settles by a tenth of a metre and more; zones follow their gridpoints."""
    difference, largest = felt(tables(configs, PLACES["crest"], 0.05, tmp_path, soft=0.01, large_strain=True), tmp_path)
    assert largest > 0.1
    assert difference < 0.03
